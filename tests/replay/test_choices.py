"""What a user may ask a replay to show: known nodes, kinds and times, sound paces, pictures; and the legend's rows."""

from pathlib import Path

import pytest
from recordings import MS
from synthetic import write_synthetic

from netsim import replay
from netsim.errors import ScenarioError, TraceError
from netsim.replay import ReplayOptions
from netsim.replay.legend import Mark, rows_of
from netsim.replay.options import decide, nice


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("grid") / "grid.mcap"
    write_synthetic(path, duration_s=20.0)
    return path


def test_nodes_are_known_by_id_and_name(grid: Path) -> None:
    assert replay.node_ids(grid, ["7", "n07", " n12"]) == {7, 12}
    with pytest.raises(ScenarioError, match=r"nodes: expected some of n00, n01, .*25 in all.*; got n99, 31"):
        replay.node_ids(grid, ["n99", "7", "31"])


def test_what_a_trace_has_not_is_named(grid: Path, tmp_path: Path) -> None:
    kinds = r"message kinds: expected some of (belief, observations|observations, belief); got gossip"
    cases = [
        (ReplayOptions(kinds=frozenset({"belief", "gossip"})), kinds),
        (ReplayOptions(nodes=frozenset({6, 99})), r"nodes: expected some of 0 \(n00\), .*; got 99"),
        (ReplayOptions(start_s=21.0), "start: expected a time up to 20 s"),
        (ReplayOptions(start_s=3.0, end_s=3.0), "end: expected a time after the start"),
    ]
    for options, complaint in cases:
        with pytest.raises(ScenarioError, match=complaint):
            replay.check_window(grid, options)
        with pytest.raises(ScenarioError, match=complaint):
            replay.save(grid, tmp_path / "none.rrd", options)
    replay.check_window(grid, ReplayOptions(kinds=frozenset({"belief"}), nodes=frozenset({6}), start_s=19.0))


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("name", ["speed", "hold_s", "tick_s"])
def test_paces_are_positive_and_finite(name: str, value: float) -> None:
    with pytest.raises(ScenarioError, match=f"{name.removesuffix('_s')}: expected a finite number > 0"):
        ReplayOptions(**{name: value})


def test_a_picture_is_a_png_and_a_recording_a_recording(grid: Path, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"x.jpg: expected the name of a picture that ends in .png"):
        replay.screenshot(grid, tmp_path / "x.jpg", 1.0)
    with pytest.raises(ScenarioError, match="expected an instant"):
        replay.screenshot(grid, tmp_path / "x.png", float("nan"))
    false = tmp_path / "false.rrd"
    false.write_bytes(grid.read_bytes())
    with pytest.raises(TraceError, match="not a Rerun recording"):
        replay.screenshot(false, tmp_path / "x.png", 1.0)
    with pytest.raises(TraceError, match="cannot read the recording"):
        replay.screenshot(tmp_path / "nowhere.rrd", tmp_path / "x.png", 1.0)


def test_an_instant_is_within_the_trace(grid: Path) -> None:
    for at_s in (20.5, -1.0, float("nan")):
        with pytest.raises(ScenarioError, match="--at: expected an instant from 0 to 20 s, where the trace ends, got"):
            replay.check_instant(grid, at_s)
    replay.check_instant(grid, 20.0)


@pytest.mark.parametrize("words", [1, 7, 40])
def test_the_legend_is_whole_and_in_even_rows(words: int) -> None:
    entries = [Mark(f"entry {number}") for number in range(words)]
    rows = rows_of(entries)
    assert [entry for row in rows for entry in row] == entries
    sizes = [len(row) for row in rows]
    assert max(sizes) - min(sizes) <= 1 + words // 10
    assert max(sum(len(entry.label) + 4 for entry in row) for row in rows) <= 84 + 16


@pytest.mark.parametrize(("value", "expected"), [(1.0, 1.0), (0.9, 0.5), (19.9, 10.0), (20, 20.0), (0.049, 0.02)])
def test_nice_steps(value: float, expected: float) -> None:
    assert nice(value) == pytest.approx(expected)


def test_pace_fits_the_length() -> None:
    assert decide(ReplayOptions(), 30 * 10**9).speed == 0.5
    assert decide(ReplayOptions(), 10**9).speed == 0.05
    assert decide(ReplayOptions(), 9000 * 10**9).speed == 2.0
    assert decide(ReplayOptions(speed=7.0), 10**9).speed == 7.0
    pace = decide(ReplayOptions(start_s=2, end_s=4, speed=1.0), 10**10)
    assert (pace.start_ns, pace.end_ns, pace.hold_ns, pace.tick_ns) == (2 * 10**9, 4 * 10**9, 150 * MS, 50 * MS)
    slow = decide(ReplayOptions(speed=0.1, end_s=1), 10**10)
    assert (slow.hold_ns, slow.tick_ns) == (75 * MS, 10 * MS)
