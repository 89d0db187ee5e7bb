"""The wire form of events: ROS 2 message schemas (text) and CDR bytes, both derived from the event classes.

CDR (Common Data Representation) is the encoding of DDS and ROS 2, OMG DDSI-RTPS 2.5 section 10 and DDS-XTypes 1.3
section 7.4: a 4-byte header (`00 01 00 00`, little-endian plain CDR), then the fields in order, each primitive aligned
to its own size counted from the end of the header. Strings are a `uint32` length that counts the closing NUL,
sequences a `uint32` length and the elements. An empty sequence has no elements, so nothing is aligned for it.

A class is compiled once into a list of steps: neighbouring scalars become one `struct` run, padded for each of the
eight places where it can start.
"""

import ast
import inspect
import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from itertools import groupby, pairwise
from operator import attrgetter
from types import ModuleType
from typing import Any, get_type_hints

import numpy as np

from netsim.errors import TraceError
from netsim.trace.events import EVENT_TYPES, OUTCOMES, RADIO_STATES, Event, Frame, Log, RadioState

HEADER = b"\x00\x01\x00\x00"
SCHEMA_ENCODING = "ros2msg"
MESSAGE_ENCODING = "cdr"

_FORMATS = {"int32": "i", "int64": "q", "uint8": "B", "uint32": "I", "float32": "f", "float64": "d"}
_PADDING = tuple(bytes(count) for count in range(8))
_COUNT = struct.Struct("<I")
_SHORT = 64  # sequences up to this length have their own struct
CODES: Mapping[tuple[type[Event], str], Sequence[str]] = {
    (Frame, "rx_outcome"): OUTCOMES,
    (RadioState, "state"): RADIO_STATES,
}
"""Fields that hold a code, each with the meanings of 0, 1, 2, ..."""
_FOXGLOVE_LOG = """builtin_interfaces/Time timestamp
# 1 debug, 2 info, 3 warning, 4 error
uint8 level
string message
string name
string file
uint32 line
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
# A nested record is laid out as its fields, so these events keep their bytes and only change their description.
_WELL_KNOWN: dict[type[Event], tuple[str, str]] = {Log: ("foxglove_msgs/msg/Log", _FOXGLOVE_LOG)}

_Encode = Callable[[bytearray, Any], None]
_Decode = Callable[[bytes, int, list[Any]], int]


def wire_types(event_type: type[Any]) -> dict[str, str]:
    """The wire type (`uint32`, `float64[]`, `string`, ...) of each field of an event class, in order."""
    hints = get_type_hints(event_type, include_extras=True)
    return {field.name: hints[field.name].__metadata__[0] for field in fields(event_type)}


def schema_name(event_type: type[Event]) -> str:
    """The name under which an event class is described in a trace, such as `netsim/msg/Frame`."""
    well_known = _WELL_KNOWN.get(event_type)
    return well_known[0] if well_known else f"netsim/msg/{event_type.__name__}"


def schema_text(event_type: type[Event]) -> str:
    """The ROS 2 message definition of an event class, with its documentation as comments and its codes as constants."""
    if event_type in _WELL_KNOWN:
        return _WELL_KNOWN[event_type][1]
    notes = field_notes(event_type)
    lines = _comment(inspect.cleandoc(event_type.__doc__ or ""))
    for name, wire in wire_types(event_type).items():
        lines += _comment(notes.get(name, ""))
        for code, meaning in enumerate(CODES.get((event_type, name), ())):
            lines.append(f"uint8 {meaning.upper()}={code}")
        lines.append(f"{wire} {name}")
    return "\n".join(lines) + "\n"


def layout(text: str) -> list[str]:
    """The lines of a message definition that decide its bytes: without comments and constants."""
    lines = (line.split("#")[0].split() for line in text.splitlines())
    return [" ".join(words) for words in lines if words and "=" not in "".join(words)]


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in text.splitlines() if line]


def field_notes(event_type: type[Event]) -> dict[str, str]:
    """The string under each field of an event class, by name; nothing where the source is not at hand."""
    notes: dict[str, str] = {}
    for field, note in pairwise(_bodies(sys.modules[event_type.__module__]).get(event_type.__qualname__, [])):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(note, ast.Expr):
            notes[field.target.id] = inspect.cleandoc(str(ast.literal_eval(note.value)))
    return notes


@cache
def _bodies(module: ModuleType) -> dict[str, list[ast.stmt]]:
    """The statements of each class of a module, by name; it is parsed once, since that takes as long as a short run."""
    try:
        tree = ast.parse(inspect.getsource(module))
    except OSError:
        return {}
    return {node.name: node.body for node in tree.body if isinstance(node, ast.ClassDef)}


def encode(event: Event) -> bytes:
    """The CDR bytes of an event.

    Raises:
        TraceError: If a value does not fit its wire type, or the event's class is not of the vocabulary.
    """
    buffer = bytearray(HEADER)
    try:
        for step in _ENCODERS[type(event)]:
            step(buffer, event)
    except (KeyError, struct.error, OverflowError, TypeError, ValueError, AttributeError) as error:
        msg = f"cannot write {event!r}: {error}"
        raise TraceError(msg) from error
    return bytes(buffer)


def fields_of(event_type: type[Event], text: str) -> int | None:
    """How many fields of an event class a message definition describes: the first so many, one after the other.

    A definition may end earlier than the class, where what it lacks has defaults, or go on after it: fields may be added at
    the end without a new format version.

    Args:
        event_type: The class.
        text: A message definition in a trace.

    Returns:
        The number of fields; None where the bytes of one are not those of the other.
    """
    mine, theirs = layout(schema_text(event_type)), layout(text)
    if mine == theirs:
        return len(fields(event_type))
    count = min(len(mine), len(theirs))
    if event_type in _WELL_KNOWN or mine[:count] != theirs[:count]:
        return None
    lacking = fields(event_type)[count:]
    return None if any(each.default is MISSING for each in lacking) else count


def decode(event_type: type[Event], data: bytes, count: int | None = None) -> Event:
    """The event that was encoded; arrays come back as numpy arrays, texts as tuples of strings.

    Args:
        event_type: Its class.
        data: Its bytes; what follows the last field of the class is ignored.
        count: How many of its fields are there, the rest having their defaults; None for all.

    Raises:
        TraceError: If the bytes are not the CDR form of such an event.
    """
    if data[:4] != HEADER:
        msg = f"{event_type.__name__}: expected little-endian CDR, got header {data[:4].hex()}"
        raise TraceError(msg)
    values: list[Any] = []
    at = len(HEADER)
    try:
        # a class is hashable, whatever the type checker makes of the class variables of some
        steps = _DECODERS[event_type] if count is None else _first_steps(event_type, count)  # type: ignore[arg-type]
        for step in steps:
            at = step(data, at, values)
        return event_type(*values)
    except (struct.error, ValueError, TypeError) as error:
        msg = f"{event_type.__name__}: broken CDR bytes: {error}"
        raise TraceError(msg) from error


def leading_scalars(event_type: type[Event], data: bytes) -> list[Any]:
    """The numbers before the first text or array of an event that was encoded: a quick look without decoding all of it.

    Raises:
        TraceError: If the bytes are too short for them.
    """
    values: list[Any] = []
    try:
        _DECODERS[event_type][0](data, len(HEADER), values)
    except struct.error as error:
        msg = f"{event_type.__name__}: broken CDR bytes: {error}"
        raise TraceError(msg) from error
    return values


def _runs(event_type: type[Any], count: int | None = None) -> list[tuple[str, tuple[str, ...]]]:
    """The first fields in order, neighbouring scalars together: (format characters or wire type, names)."""
    runs: list[tuple[str, tuple[str, ...]]] = []
    for scalar, group in groupby(list(wire_types(event_type).items())[:count], key=lambda item: item[1] in _FORMATS):
        items = list(group)
        if scalar:
            runs.append(("".join(_FORMATS[wire] for _, wire in items), tuple(name for name, _ in items)))
        else:
            runs += [(wire, (name,)) for name, wire in items]
    return runs


@cache
def _first_steps(event_type: type[Any], count: int) -> tuple[_Decode, ...]:
    """What decodes the first so many fields."""
    return tuple(_decode_step(form) for form, _ in _runs(event_type, count))


def _encode_step(form: str, names: tuple[str, ...]) -> _Encode:
    value_of = attrgetter(*names)
    if form == "string":
        return _encode_text(value_of)
    if form == "string[]":
        return _encode_texts(value_of)
    if form.endswith("[]"):
        return _encode_array(value_of, form[:-2])
    return _encode_scalars(value_of, form, len(names))


def _decode_step(form: str) -> _Decode:
    if form == "string":
        return _decode_text
    if form == "string[]":
        return _decode_texts
    return _decode_array(form[:-2]) if form.endswith("[]") else _decode_scalars(form)


@cache
def _aligned(form: str, position: int) -> struct.Struct:
    """The struct of scalars whose first byte would stand at `position`, the padding they need included.

    Positions in a buffer include the header of 4 bytes; alignment does not.
    """
    layout, at = "<", position - len(HEADER)
    for character in form:
        size = struct.calcsize("<" + character)
        gap = -at % size
        layout += "x" * gap + character
        at += gap + size
    return struct.Struct(layout)


@cache
def _row(character: str, position: int, count: int) -> struct.Struct:
    """The struct of a sequence: its length and its elements."""
    return _aligned("I" + character * count, position)


def _structs(form: str) -> tuple[struct.Struct, ...]:
    return tuple(_aligned(form, position) for position in range(8))


def _encode_scalars(value_of: Callable[[Any], Any], form: str, count: int) -> _Encode:
    structs = _structs(form)

    def one(buffer: bytearray, event: Any) -> None:
        buffer += structs[len(buffer) & 7].pack(value_of(event))

    def several(buffer: bytearray, event: Any) -> None:
        buffer += structs[len(buffer) & 7].pack(*value_of(event))

    return one if count == 1 else several


def _decode_scalars(form: str) -> _Decode:
    structs = _structs(form)

    def step(data: bytes, at: int, values: list[Any]) -> int:
        layout = structs[at & 7]
        values += layout.unpack_from(data, at)
        return at + layout.size

    return step


def _add_count(buffer: bytearray, count: int) -> None:
    buffer += _PADDING[-len(buffer) & 3]
    buffer += _COUNT.pack(count)


def _count_at(data: bytes, at: int) -> tuple[int, int]:
    at += -at & 3
    return _COUNT.unpack_from(data, at)[0], at + 4


def _add_text(buffer: bytearray, text: str) -> None:
    encoded = text.encode()
    _add_count(buffer, len(encoded) + 1)
    buffer += encoded
    buffer += b"\0"


def _text_at(data: bytes, at: int) -> tuple[str, int]:
    count, at = _count_at(data, at)
    end = at + count
    if not at < end <= len(data):
        msg = f"a string of {count} bytes at {at} of {len(data)}"
        raise ValueError(msg)
    return data[at : end - 1].decode(), end


def _encode_text(value_of: Callable[[Any], Any]) -> _Encode:
    def step(buffer: bytearray, event: Any) -> None:
        _add_text(buffer, value_of(event))

    return step


def _decode_text(data: bytes, at: int, values: list[Any]) -> int:
    text, at = _text_at(data, at)
    values.append(text)
    return at


def _encode_texts(value_of: Callable[[Any], Any]) -> _Encode:
    def step(buffer: bytearray, event: Any) -> None:
        texts = value_of(event)
        _add_count(buffer, len(texts))
        for text in texts:
            _add_text(buffer, text)

    return step


def _decode_texts(data: bytes, at: int, values: list[Any]) -> int:
    count, at = _count_at(data, at)
    texts = []
    for _ in range(count):
        text, at = _text_at(data, at)
        texts.append(text)
    values.append(tuple(texts))
    return at


def _encode_array(value_of: Callable[[Any], Any], wire: str) -> _Encode:
    character = _FORMATS[wire]
    dtype = np.dtype("<" + character)
    misfit = dtype.itemsize - 1  # bits of a position that break the alignment

    def step(buffer: bytearray, event: Any) -> None:
        value = value_of(event)
        count = len(value)
        if not isinstance(value, np.ndarray) and count <= _SHORT:
            buffer += _row(character, len(buffer) & 7, count).pack(count, *value)
            return
        _add_count(buffer, count)
        if count:
            buffer += _PADDING[-(len(buffer) - 4) & misfit]
            buffer += _as_wire(np.asarray(value), dtype).tobytes()

    return step


def _as_wire(values: np.ndarray[Any, Any], dtype: np.dtype[Any]) -> np.ndarray[Any, Any]:
    """The values as one row of `dtype`; integers that do not fit are an error, not wrapped."""
    if values.ndim != 1:
        msg = f"expected one row of values, got shape {values.shape}"
        raise ValueError(msg)
    if values.dtype == dtype:
        return values
    cast = values.astype(dtype)
    if dtype.kind != "f" and not np.array_equal(cast, values):
        msg = f"values that do not fit {dtype.name}"
        raise OverflowError(msg)
    return cast


def _decode_array(wire: str) -> _Decode:
    dtype = np.dtype("<" + _FORMATS[wire])
    misfit = dtype.itemsize - 1

    def step(data: bytes, at: int, values: list[Any]) -> int:
        count, at = _count_at(data, at)
        if not count:
            values.append(np.empty(0, dtype))
            return at
        at += -(at - 4) & misfit
        # A copy, because the bytes of a message are neither writable nor aligned for float64.
        values.append(np.frombuffer(data, dtype, count, at).copy())
        return at + count * dtype.itemsize

    return step


_ENCODERS: dict[type[Any], tuple[_Encode, ...]] = {
    event_type: tuple(_encode_step(form, names) for form, names in _runs(event_type)) for event_type in EVENT_TYPES
}
_DECODERS: dict[type[Any], tuple[_Decode, ...]] = {
    event_type: tuple(_decode_step(form) for form, _ in _runs(event_type)) for event_type in EVENT_TYPES
}
