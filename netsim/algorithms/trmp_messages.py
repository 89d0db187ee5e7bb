"""What vertices tell each other in distributed tree-reweighted max-product, and how it is laid out in bytes.

An entry begins with its kind, the source and the destination vertex. Several entries for one node share a packet. What a
vertex concludes about sensors whose nodes do not host it goes the same way at the end, with the sensor in a vertex' place.
"""

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any

from netsim.codec import FloatWidth, decode_count, decode_floats, encode_count, encode_floats, size_byte
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, slots=True)
class Echo:
    """What the vertices beyond an edge have found out together, sent back towards the root of a growing tree.

    Attributes:
        vertices: How many there are.
        uncovered: Their edges that no tree has yet, each end counted.
        most_uncovered: Most such edges at one vertex.
        next_root: The vertex that has so many, of equals the lowest.
        height: Longest way down from the sender, in edges.
        longest: Longest path among them, in edges.
    """

    vertices: int
    uncovered: int
    most_uncovered: int
    next_root: int
    height: int
    longest: int


@dataclass(frozen=True, slots=True)
class Wave:
    """A tree grows: `echo` None on the way out, the answer of a child to its parent on the way back."""

    tree: int
    initiator: int
    echo: Echo | None


@dataclass(frozen=True, slots=True)
class Next:
    """Down the last tree: the next one begins at `root`; longest paths of the trees so far."""

    root: int
    diameters: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Go:
    """Down the last tree: all edges are covered, inference begins; longest paths of all trees."""

    diameters: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TreeMessage:
    """A max-product message on a tree, the sender's part of it; `round` is 0 with the two-pass schedule."""

    iteration: int
    tree: int
    round: int
    log_message: FloatArray


@dataclass(frozen=True, slots=True)
class Vote:
    """Up the first tree: whether all vertices below agree in an iteration."""

    iteration: int
    agrees: bool


@dataclass(frozen=True, slots=True)
class Verdict:
    """Down the first tree: what the root says after an iteration."""

    iteration: int
    proved: bool
    stop: bool


@dataclass(frozen=True, slots=True)
class Abandon:
    """To all neighbours, and on from them: this component cannot come to an end any more, for instance after a reboot."""


@dataclass(frozen=True, slots=True)
class Claim:
    """To a sensor: what a vertex concludes about its measurements in its last iteration.

    `rows`: for each target the weight of missed and of each measurement, shape (measurements + 1,).
    """

    iteration: int
    rows: Mapping[int, FloatArray]


@dataclass(frozen=True, slots=True)
class Heard:
    """A sensor's answer to a claim."""


Body = Wave | Next | Go | TreeMessage | Vote | Verdict | Claim | Heard | Abandon


@dataclass(frozen=True, slots=True)
class Entry:
    """One vertex's message to another.

    Attributes:
        source: Sending vertex; of `Heard` the sensor.
        destination: Receiving vertex, a neighbour in the model; of `Claim` the sensor.
        body: What it says.
        is_held: Whether it waits a little before it is sent, so that others of its tree come first.
    """

    source: int
    destination: int
    body: Body
    is_held: bool = False


_HEAD = struct.Struct("<BHH")
_FIELDS = {
    Wave: struct.Struct("<HHB"),
    TreeMessage: struct.Struct("<HBH"),
    Vote: struct.Struct("<HB"),
    Verdict: struct.Struct("<HBB"),
    Next: struct.Struct("<HB"),
    Go: struct.Struct("<B"),
    Claim: struct.Struct("<HB"),
    Heard: struct.Struct("<"),
    Abandon: struct.Struct("<"),
}
_ROW = struct.Struct("<HH")  # target, number of entries
_KINDS: tuple[type[Any], ...] = (Wave, Next, Go, TreeMessage, Vote, Verdict, Claim, Heard, Abandon)


def encode(entries: Iterable[Entry], width: FloatWidth) -> bytes:
    """Entries for one node as one payload."""
    parts = []
    for entry in entries:
        parts.append(_HEAD.pack(_KINDS.index(type(entry.body)), entry.source, entry.destination))
        parts.append(_encoded(entry.body, width))
    return b"".join(parts)


def _encoded(body: Body, width: FloatWidth) -> bytes:
    layout = _FIELDS[type(body)]
    match body:
        case Wave(tree, initiator, echo):
            told = b"" if echo is None else b"".join(map(encode_count, astuple(echo)))
            return layout.pack(tree, initiator, echo is not None) + told
        case Next(root, diameters):
            return layout.pack(root, len(diameters)) + _counts(diameters)
        case Go(diameters):
            return layout.pack(len(diameters)) + _counts(diameters)
        case TreeMessage(iteration, tree, number, log_message):
            size = encode_count(len(log_message))
            return layout.pack(iteration, tree, number) + size + encode_floats(log_message, width)
        case Vote() | Verdict() | Heard() | Abandon():
            return layout.pack(*astuple(body))
        case Claim(iteration, rows):
            return layout.pack(iteration, len(rows)) + _rows(rows, width)


def _rows(rows: Mapping[int, FloatArray], width: FloatWidth) -> bytes:
    return b"".join(_ROW.pack(target, len(row)) + encode_floats(row, width) for target, row in sorted(rows.items()))


def _counts(numbers: Sequence[int]) -> bytes:
    return struct.pack(f"<{len(numbers)}H", *numbers)


def decode(payload: bytes, width: FloatWidth) -> list[Entry]:
    """The entries that `encode` put into a payload."""
    entries, offset = [], 0
    while offset < len(payload):
        kind, source, destination = _HEAD.unpack_from(payload, offset)
        body, offset = _DECODERS[_KINDS[kind]](payload, offset + _HEAD.size, width)
        entries.append(Entry(source, destination, body))
    return entries


def _wave(payload: bytes, offset: int, __: FloatWidth) -> tuple[Body, int]:
    tree, initiator, has_echo = _FIELDS[Wave].unpack_from(payload, offset)
    offset += _FIELDS[Wave].size
    if not has_echo:
        return Wave(tree, initiator, None), offset
    numbers = []
    for _ in fields(Echo):
        number, offset = decode_count(payload, offset)
        numbers.append(number)
    return Wave(tree, initiator, Echo(*numbers)), offset


def _next(payload: bytes, offset: int, _: FloatWidth) -> tuple[Body, int]:
    root, count = _FIELDS[Next].unpack_from(payload, offset)
    offset += _FIELDS[Next].size
    return Next(root, struct.unpack_from(f"<{count}H", payload, offset)), offset + 2 * count


def _go(payload: bytes, offset: int, _: FloatWidth) -> tuple[Body, int]:
    (count,) = _FIELDS[Go].unpack_from(payload, offset)
    offset += _FIELDS[Go].size
    return Go(struct.unpack_from(f"<{count}H", payload, offset)), offset + 2 * count


def _tree_message(payload: bytes, offset: int, width: FloatWidth) -> tuple[Body, int]:
    iteration, tree, number = _FIELDS[TreeMessage].unpack_from(payload, offset)
    size, begin = decode_count(payload, offset + _FIELDS[TreeMessage].size)
    end = begin + size_byte(size, width)
    return TreeMessage(iteration, tree, number, decode_floats(payload[begin:end], width)), end


def _vote(payload: bytes, offset: int, _: FloatWidth) -> tuple[Body, int]:
    iteration, agrees = _FIELDS[Vote].unpack_from(payload, offset)
    return Vote(iteration, bool(agrees)), offset + _FIELDS[Vote].size


def _verdict(payload: bytes, offset: int, _: FloatWidth) -> tuple[Body, int]:
    iteration, proved, stop = _FIELDS[Verdict].unpack_from(payload, offset)
    return Verdict(iteration, bool(proved), bool(stop)), offset + _FIELDS[Verdict].size


def _claim(payload: bytes, offset: int, width: FloatWidth) -> tuple[Body, int]:
    iteration, count = _FIELDS[Claim].unpack_from(payload, offset)
    offset += _FIELDS[Claim].size
    rows: dict[int, FloatArray] = {}
    for _ in range(count):
        target, size = _ROW.unpack_from(payload, offset)
        begin = offset + _ROW.size
        offset = begin + size_byte(size, width)
        rows[target] = decode_floats(payload[begin:offset], width)
    return Claim(iteration, rows), offset


def _heard(_: bytes, offset: int, __: FloatWidth) -> tuple[Body, int]:
    return Heard(), offset


def _abandon(_: bytes, offset: int, __: FloatWidth) -> tuple[Body, int]:
    return Abandon(), offset


_DECODERS: dict[type[Any], Callable[[bytes, int, FloatWidth], tuple[Body, int]]] = {
    Wave: _wave,
    Next: _next,
    Go: _go,
    TreeMessage: _tree_message,
    Vote: _vote,
    Verdict: _verdict,
    Claim: _claim,
    Heard: _heard,
    Abandon: _abandon,
}
