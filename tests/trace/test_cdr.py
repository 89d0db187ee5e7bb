"""The wire form of events: round trips, the letter of the standard, and agreement with Rerun's decoder."""

import math
import struct
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from netsim.errors import TraceError
from netsim.trace.cdr import decode, encode, schema_name, schema_text, wire_types
from netsim.trace.events import EVENT_TYPES, OUTCOMES, Event, Frame, GraphMessages, Log, Marginals, NodeLife, RadioState

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
SCALARS: dict[str, st.SearchStrategy[Any]] = {
    "int64": st.integers(-(2**63), 2**63 - 1),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "uint8": st.integers(0, 255),
    "float64": st.floats(),
    "float32": st.floats(width=32),
    "string": TEXT,
}


def values_of(wire: str) -> st.SearchStrategy[Any]:
    """Values of a wire type: arrays as numpy arrays, lists and (long) lists beyond the short form."""
    if wire == "string[]":
        return st.lists(TEXT, max_size=5)
    if wire.endswith("[]"):
        element = SCALARS[wire[:-2]]
        rows = npst.arrays(np.dtype(wire[:-2]), st.integers(0, 9), elements=element)
        return st.one_of(rows, st.lists(element, max_size=9), st.lists(element, min_size=70, max_size=72))
    return SCALARS[wire]


def events_of(event_type: type[Event]) -> st.SearchStrategy[Event]:
    """Any event of a class."""
    return st.builds(event_type, *(values_of(wire) for wire in wire_types(event_type).values()))


def assert_same(left: Event, right: Event) -> None:
    """Equal field by field, NaN equal to NaN."""
    assert type(left) is type(right)
    for field in fields(left):
        a, b = getattr(left, field.name), getattr(right, field.name)
        if isinstance(a, float):
            assert a == b or (math.isnan(a) and math.isnan(b))
        elif isinstance(a, int | str):
            assert a == b
        else:
            np.testing.assert_array_equal(np.asarray(a), np.asarray(b), strict=False)


@given(st.one_of([events_of(event_type) for event_type in EVENT_TYPES]))
def test_every_event_comes_back_as_it_went(event: Event) -> None:
    assert_same(decode(type(event), encode(event)), event)


@pytest.mark.parametrize("event_type", EVENT_TYPES)
def test_lists_and_arrays_have_the_same_bytes(event_type: type[Event]) -> None:
    plain = {"string": "ab", "string[]": ["x", ""]}
    lists = {name: plain.get(wire, [1, 2, 3] if "[]" in wire else 1) for name, wire in wire_types(event_type).items()}
    arrays = {
        name: np.array(value, wire_types(event_type)[name][:-2]) if value == [1, 2, 3] else value
        for name, value in lists.items()
    }
    assert encode(event_type(**lists)) == encode(event_type(**arrays))


def test_bytes_follow_the_standard_to_the_letter() -> None:
    event = GraphMessages(1, 2, [3], [], [1], 4, 0.5, 1, -9)
    expected = (
        b"\x00\x01\x00\x00" + struct.pack("<2I2II", 1, 2, 1, 3, 0) + struct.pack("<IB3xIdB7xq", 1, 1, 4, 0.5, 1, -9)
    )
    assert encode(event) == expected
    assert encode(Marginals(1, 2, [0.5], 3, 1))[4:] == struct.pack("<III4xdIB", 1, 2, 1, 0.5, 3, 1)
    assert encode(Marginals(1, 2, [], 3, 0))[4:] == struct.pack("<IIIIB", 1, 2, 0, 3, 0)
    assert encode(NodeLife(7, "died", "")) == b"\x00\x01\x00\x00" + struct.pack("<II5s3xI1s", 7, 5, b"died\0", 1, b"\0")


def test_schema_says_fields_units_and_codes() -> None:
    lines = schema_text(RadioState).splitlines()
    states = ("OFF", "SLEEP", "LISTEN", "RECEIVE", "TRANSMIT", "SWITCH", "DEAD", "IDLE")
    assert lines[0].startswith("# A node's radio entered a state.")
    assert [line for line in lines if not line.startswith("#")] == [
        "uint32 node",
        *(f"uint8 {name}={code}" for code, name in enumerate(states)),
        "uint8 state",
    ]
    assert f"uint8 {OUTCOMES[2].upper()}=2" in schema_text(Frame)
    assert schema_name(Frame) == "netsim/msg/Frame"
    assert schema_name(Log) == "foxglove_msgs/msg/Log"


@pytest.mark.parametrize(
    "event",
    [
        RadioState(-1, 0),
        RadioState(2**32, 0),
        RadioState(0, 256),
        NodeLife(0, 5, ""),  # type: ignore[arg-type]
        GraphMessages(0, 0, [-1], [0], [0], 0, 0.0, 1, 0),
        GraphMessages(0, 0, np.array([-1]), [0], [0], 0, 0.0, 1, 0),
        GraphMessages(0, 0, np.zeros((1, 1), np.uint32), [0], [0], 0, 0.0, 1, 0),
        GraphMessages(0, 0, [2**32] * 100, [0], [0], 0, 0.0, 1, 0),
        object(),
    ],
)
def test_values_that_do_not_fit_are_refused(event: Any) -> None:
    with pytest.raises(TraceError, match="cannot write"):
        encode(event)


@given(st.binary(max_size=80), st.sampled_from(EVENT_TYPES))
def test_broken_bytes_raise_nothing_but_a_trace_error(data: bytes, event_type: type[Event]) -> None:
    try:
        decode(event_type, b"\x00\x01\x00\x00" + data)
    except TraceError:
        return
