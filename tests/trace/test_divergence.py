"""Where two traces part, with planted differences."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.trace.divergence import Difference, Divergence, Recorded, differences, first_divergence
from netsim.trace.events import Estimate, Event, NodeLife, NodePositions, RadioState
from netsim.trace.reader import TruncatedTraceWarning
from netsim.trace.writer import TraceWriter

Rows = tuple[tuple[int, Event], ...]
ROWS: Rows = tuple((10 * number, RadioState(number % 3, number % 4)) for number in range(8))


def write(path: Path, rows: Rows) -> Path:
    with TraceWriter(path, {"seed": "1"}) as writer:
        for time_ns, event in rows:
            writer.write(event, time_ns)
    return path


def parting(folder: Path, other: Rows, rows: Rows = ROWS, context: int = 3) -> Divergence | None:
    return first_divergence(write(folder / "a.mcap", rows), write(folder / "b.mcap", other), context)


def test_the_same_events_do_not_part(tmp_path: Path) -> None:
    assert parting(tmp_path, ROWS) is None
    assert parting(tmp_path, (), ()) is None


@settings(max_examples=12)
@given(st.integers(0, 7), st.sampled_from(["time", "field", "kind", "gone"]), st.integers(0, 9))
def test_a_planted_difference_is_found(
    tmp_path_factory: pytest.TempPathFactory, at: int, change: str, context: int
) -> None:
    time_ns, event = ROWS[at]
    assert isinstance(event, RadioState)
    planted: dict[str, Rows] = {
        "time": ((time_ns + 1, event),),
        "field": ((time_ns, replace(event, node=9)),),
        "kind": ((time_ns, NodeLife(1, "died", "")),),
        "gone": (),
    }
    other = (*ROWS[:at], *planted[change], *ROWS[at + 1 :])
    found = parting(tmp_path_factory.mktemp("traces"), other, context=context)
    assert found is not None
    assert found.common == at
    assert found.before == tuple(Recorded(*row) for row in ROWS[max(0, at - context) : at])
    assert found.first == Recorded(*ROWS[at])
    assert found.second == (Recorded(*other[at]) if at < len(other) else None)
    if change == "field":
        assert found.differences == [Difference("node", event.node, 9)]


def test_one_trace_may_be_the_beginning_of_the_other(tmp_path: Path) -> None:
    found = parting(tmp_path, ROWS[:5])
    assert found is not None
    assert (found.common, found.first, found.second) == (5, Recorded(*ROWS[5]), None)
    assert found.differences == []


def test_of_a_trace_cut_short_the_rest_is_missing(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.mcap", ROWS)
    cut = tmp_path / "cut.mcap"
    data = whole.read_bytes()
    cut.write_bytes(data[: data.index(b"zstd") + 20])  # within the only chunk
    with pytest.warns(TruncatedTraceWarning):
        found = first_divergence(whole, cut)
    assert found is not None
    assert (found.common, found.first, found.second) == (0, Recorded(*ROWS[0]), None)


def test_arrays_part_at_an_element() -> None:
    first, second = (
        NodePositions([1, 2], [0.0, 1.0], [0.0, math.nan]),
        NodePositions([1, 2], [0.0, 1.5], [0.0, math.nan]),
    )
    assert differences(first, second) == [Difference("x_m[1]", 1.0, 1.5)]
    shorter = NodePositions([1], [0.0], [0.0])
    assert [each.name for each in differences(first, shorter)] == ["node", "x_m", "y_m"]
    assert differences(first, Estimate(1, 2, 0.0, 0.0, [])) == []
