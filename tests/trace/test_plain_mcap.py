"""Traces are read by the tools of MCAP alone: the reader that docs/trace-format.md shows, and the decoder for ROS 2."""

import math
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from netsim.trace.cdr import wire_types
from netsim.trace.description import COMMON, markdown_topics
from netsim.trace.events import EVENT_TYPES, Event, Frame
from netsim.trace.reader import read_trace
from netsim.trace.writer import TraceWriter

DOCUMENT = Path(__file__).parents[2] / "docs" / "trace-format.md"
Rows = Callable[..., Iterator[tuple[str, int, dict[str, Any]]]]

SAMPLES: dict[str, list[Any]] = {
    "string": ["", "a text, föhn", "x"],
    "uint8": [0, 255, 3],
    "uint32": [0, 2**32 - 1, 7],
    "int32": [-(2**31), 2**31 - 1, 0],
    "int64": [-(2**63), 2**63 - 1, 5],
    "float32": [0.5, -math.inf, 1e-3],
    "float64": [0.1, math.inf, -1e300],
}


def sample(event_type: type[Event], number: int) -> Event:
    """An event of a class; those of other numbers have other values, and arrays of other lengths."""
    values = []
    for place, wire in enumerate(wire_types(event_type).values()):
        some = SAMPLES[wire.removesuffix("[]")]
        one = some[(number + place) % len(some)]
        values.append([*some, one][: (number + place) % 5] if wire.endswith("[]") else one)
    return event_type(*values)


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace with a few events of every kind."""
    path = tmp_path_factory.mktemp("plain") / "trace.mcap"
    with TraceWriter(path, {}) as writer:
        for number in range(6):
            for event_type in EVENT_TYPES:
                writer.write(sample(event_type, number), 1000 * number)
    return path


def documented() -> Rows:
    """`rows` of the document, made by its own code."""
    code = DOCUMENT.read_text(encoding="utf-8").partition("```python\n")[2].partition("```")[0]
    assert "netsim" not in code
    scope: dict[str, Any] = {}
    exec(compile(code, str(DOCUMENT), "exec"), scope)
    rows: Rows = scope["rows"]
    return rows


def plain(event: Event) -> dict[str, Any]:
    """The fields of an event as numbers, texts and lists."""
    found = {field.name: getattr(event, field.name) for field in fields(event)}
    return {name: listed(value) for name, value in found.items()}


def listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else (list(value) if isinstance(value, tuple) else value)


def test_the_documented_reader_gives_our_rows(trace: Path) -> None:
    ours = [(event.topic, time_ns, plain(event)) for time_ns, event in read_trace(trace)]
    assert len(ours) == 6 * len(EVENT_TYPES)
    assert list(documented()(trace)) == ours


def test_the_documented_reader_picks_topics(trace: Path) -> None:
    ours = [plain(event) for _, event in read_trace(trace, {Frame.topic})]
    assert [values for _, _, values in documented()(trace, [Frame.topic])] == ours


def test_the_decoder_of_ros_gives_our_rows(trace: Path) -> None:
    reader = pytest.importorskip("mcap_ros2.reader", reason="needs mcap-ros2-support")
    theirs = []
    for message in reader.read_ros2_messages(str(trace)):
        told = message.ros_msg
        if message.channel.topic == "/log":  # a nested time
            told.sec, told.nanosec = told.timestamp.sec, told.timestamp.nanosec
        theirs.append((message.channel.topic, message.log_time_ns, told))
    ours = [(event.topic, time_ns, plain(event)) for time_ns, event in read_trace(trace)]
    assert [each[:2] for each in theirs] == [each[:2] for each in ours]
    for (topic, _, told), (_, _, values) in zip(theirs, ours, strict=True):
        assert {name: elements(getattr(told, name)) for name in values} == values, topic


def elements(value: Any) -> Any:
    """What a decoder gives for a field, as we do: it has lists, tuples, arrays or bytes for sequences."""
    return list(value) if isinstance(value, list | tuple | bytes | bytearray) or hasattr(value, "__array__") else value


def test_the_document_is_up_to_date() -> None:
    assert DOCUMENT.read_text(encoding="utf-8").endswith(f"\n## Topics\n\n{markdown_topics()}"), (
        "write it anew: python tools/document_trace.py"
    )


def test_every_field_has_a_meaning_and_no_words_are_left_over() -> None:
    empty = [line for line in markdown_topics().splitlines() if line.startswith("| `") and line.endswith("|  |")]
    assert empty == []
    assert set(COMMON) <= {name for event_type in EVENT_TYPES for name in wire_types(event_type)}
