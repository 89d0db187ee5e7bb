"""What a replay shows of groups, of sleepers, and of how sure the nodes are."""

from pathlib import Path

import numpy as np
import pytest
from recordings import Table, named_nodes, recording, timed

from netsim.trace.events import (
    RADIO_STATE_CODE,
    Belief,
    Estimate,
    Event,
    FieldInfo,
    Group,
    Log,
    Marginals,
    PairProbabilities,
    RadioState,
)
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
MS = 1_000_000
ASLEEP, LISTEN = RADIO_STATE_CODE["sleep"], RADIO_STATE_CODE["listen"]

STORY: tuple[tuple[int, Event], ...] = (
    (0, FieldInfo(20.0, 10.0, 0.0, 0.0)),
    (0, RadioState(2, ASLEEP)),
    (1 * S, Group(0, 1, [0], [0, 1])),
    (1 * S, Group(2, 1, [1], [1, 2])),
    (2 * S, Group(0, 2, [0, 1], [0, 1, 2])),
    (2 * S, Marginals(0, 5, [0.5, 0.5], 1, 0)),
    (3 * S, Group(0, 3, [0, 1], [])),
    (3 * S, Marginals(1, 6, [1.0, 0.0], 1, 0)),
    (3 * S, PairProbabilities(1, 0, [3, 4], [0.5, 0.5], [0.4, 0.3], [0.6, 0.8], 2)),
    (4 * S, RadioState(2, LISTEN)),
    (4 * S, RadioState(1, ASLEEP)),
    (4 * S + MS, RadioState(1, LISTEN)),
    (4 * S + MS, PairProbabilities(1, 1, [3], [0.5], [0.5], [0.6], 2)),
    (20 * S, Log(20, 0, 2, "end", "a", "", 0)),
)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Table:
    folder = tmp_path_factory.mktemp("groups")
    with TraceWriter(folder / "groups.mcap", {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        for time_ns, event in STORY:
            writer.write(event, time_ns)
    return recording(folder / "groups.mcap", folder, tick_s=0.1)


def test_a_hull_holds_the_members_and_no_other(rows: Table) -> None:
    hulls = timed(rows["/map/groups/0"], "LineStrips2D:strips")
    outline = np.array(hulls[S][0])
    assert outline[0] == pytest.approx(outline[-1])
    assert outline[:, 0].min() < 0.0
    assert 10.0 < outline[:, 0].max() < 20.0
    assert np.array(hulls[2 * S][0])[:, 0].max() > 20.0


def test_a_joint_group_is_one_broader_hull_in_its_first_track_s_colour(rows: Table) -> None:
    first, second = (timed(rows[f"/map/groups/{track}"], "LineStrips2D:strips") for track in (0, 1))
    assert [len(each) for each in second.values()] == [1, 0, 0]
    widths = timed(rows["/map/groups/0"], "LineStrips2D:radii")
    assert widths[2 * S][0] < widths[S][0] < 0.0  # points on screen are below 0
    assert list(first) == [S, 2 * S, 3 * S]
    assert len(first[3 * S]) == 0  # nobody read anything


def test_sleepers_have_rings_and_short_naps_have_none(rows: Table) -> None:
    rings = timed(rows["/map/asleep"], "LineStrips2D:strips")
    assert {at: len(each) for at, each in rings.items()} == {0: 1, 4 * S: 0}
    assert np.mean(np.array(rings[0][0])[:-1], axis=0) == pytest.approx([20.0, 0.0], abs=1e-4)


def test_nobody_sleeps_before_the_window(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "nap.mcap", {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        for time_ns, event in STORY:
            writer.write(event, time_ns)
    rows = recording(tmp_path / "nap.mcap", tmp_path, tick_s=0.1, start_s=3.05)
    rings = timed(rows["/map/asleep"], "LineStrips2D:strips")
    assert {at: len(each) for at, each in rings.items()} == {round(3.05 * S): 1, 4 * S: 0}


def test_entropy_is_of_all_that_have_spoken(rows: Table) -> None:
    mean, most = (timed(rows[f"/plots/entropy/{name}"], "Scalars:scalars") for name in ("mean_entropy", "most"))
    assert [(at, *value) for at, value in mean.items()][:2] == [(2 * S, 1.0), (3 * S, 0.5)]
    assert [value[0] for value in most.values()] == [1.0, 1.0, 1.0]


def test_certified_intervals_are_those_of_all_measurements_told(rows: Table) -> None:
    widest, mean = (timed(rows[f"/plots/width/{name}"], "Scalars:scalars") for name in ("widest", "mean_width"))
    assert [value[0] for value in widest.values()] == pytest.approx([0.5, 0.5, 0.5])
    assert [value[0] for value in mean.values()] == pytest.approx([0.5, 0.3, 0.3])


def told_early(folder: Path, start_s: float) -> Table:
    """A window of a run in which everything is told at 1 s, and nothing later."""
    with TraceWriter(folder / "early.mcap", {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        writer.write(Group(0, 1, [0], [0, 1]), 1 * S)
        writer.write(Belief(0, 0, 1, 0.0, 0.0, 5.0, 4, [1, 6], [0.75, 0.25]), 1 * S)
        writer.write(Marginals(0, 5, [0.5, 0.5], 1, 0), 1 * S)
        writer.write(Log(30, 0, 2, "end", "a", "", 0), 30 * S)
    return recording(folder / "early.mcap", folder, start_s=start_s, end_s=20.0)


@pytest.mark.parametrize("start_s", [3.0, 6.0, 12.0])
def test_a_window_shows_what_still_holds_and_for_no_longer_than_it_does(tmp_path: Path, start_s: float) -> None:
    rows, start_ns = told_early(tmp_path, start_s), round(start_s * S)
    hulls = timed(rows["/map/groups/0"], "LineStrips2D:strips")
    beliefs: dict[int, bool] = {}
    for row in rows["/map/beliefs/0"]:
        if row.get("Image:buffer") is not None:
            beliefs[row["simulated_time"]] = bool(np.any(row["Image:buffer"][0]))
    expected = {start_ns: True, 6 * S: False} if start_s < 6.0 else {start_ns: False}
    assert {at: len(each) > 0 for at, each in hulls.items()} == expected
    assert beliefs == expected


def test_a_curve_begins_with_the_window(tmp_path: Path) -> None:
    mean = timed(told_early(tmp_path, 12.0)["/plots/entropy/mean_entropy"], "Scalars:scalars")
    assert {at: value[0] for at, value in mean.items()} == {12 * S: 1.0, 20 * S: 1.0}


def test_estimates_and_trails_of_before_the_window_are_there_at_its_start(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "t.mcap", {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for second, covariance in ((1, []), (2, [4.0, 0.0, 1.0]), (8, [])):
            writer.write(Estimate(0, 0, float(second), 0.0, covariance), second * S)
        writer.write(Log(20, 0, 2, "end", "a", "", 0), 20 * S)
    rows = recording(tmp_path / "t.mcap", tmp_path, start_s=5.0)
    points = timed(rows["/map/estimates/0"], "Points2D:positions")
    assert {at: place[0][0] for at, place in points.items()} == {5 * S: 2.0, 8 * S: 8.0}
    ellipses = timed(rows["/map/estimates/0/ellipse"], "LineStrips2D:strips")
    assert {at: len(each) for at, each in ellipses.items()} == {5 * S: 1, 8 * S: 0}  # the last one has none
    trails = timed(rows["/map/trails/0"], "LineStrips2D:strips")
    assert {at: len(each[0]) for at, each in trails.items()} == {5 * S: 2, 8 * S: 3}
