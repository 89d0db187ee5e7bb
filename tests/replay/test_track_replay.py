"""What a replay shows of a belief that wanders: cells, leaders, choices, trails, kinds of sensors."""

import json
from pathlib import Path

import numpy as np
import pytest
from recordings import Table, log_of, named_nodes, recording, timed

from netsim.replay import style
from netsim.trace.events import Belief, Estimate, FieldInfo, Handoff, NodeLife, Problem, Role, TruthTargets
from netsim.trace.writer import TraceWriter

S = 1_000_000_000


def write_track(path: Path) -> None:
    """Sensors a, b, c in a row 10 m apart; a leads from 1 s, hands over to b at 2 s, who dies at 3 s; the end is at 9 s."""
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        writer.write(FieldInfo(20.0, 10.0, 0.0, 0.0), 0)
        kinds = enumerate(["amplitude", "bearing", "amplitude"])
        content = {"sensors": [{"node": node, "measures": kind} for node, kind in kinds]}
        writer.write(Problem("tracking", json.dumps(content)), 0)
        writer.write(TruthTargets([0], [3.0], [2.0]), 0)
        writer.write(Belief(0, 0, 0, 0.0, 0.0, 5.0, 4, list(range(8)), [0.125] * 8), 1 * S)
        writer.write(Role(0, "leader", 1), 1 * S)
        writer.write(Estimate(0, 0, 3.0, 7.0, [9.0, 0.0, 16.0]), 1 * S)
        writer.write(TruthTargets([0], [3.0], [6.0]), 2 * S)
        writer.write(Estimate(0, 0, 6.0, 2.0, []), 2 * S)
        writer.write(Belief(0, 0, 1, 0.0, 0.0, 5.0, 4, [1, 6], [0.75, 0.25]), 2 * S)
        writer.write(Handoff(0, 0, 1, 1, [2, 1], [0.1, 0.5], "grid", 20, 0.0), 2 * S)
        writer.write(Role(1, "leader", 1), 2 * S)
        writer.write(Role(0, "leader", 0), 2 * S)
        writer.write(NodeLife(1, "died", "battery"), 3 * S)
        writer.write(TruthTargets([0], [3.0], [6.0]), 9 * S)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Table:
    folder = tmp_path_factory.mktemp("track")
    write_track(folder / "track.mcap")
    return recording(folder / "track.mcap", folder)


def pictures(rows: Table) -> dict[int, np.ndarray]:
    """The pictures of the belief, the first row in the north."""
    buffers = timed(rows["/map/beliefs/0"], "Image:buffer")
    return {at_ns: np.array(buffer[0], np.uint8).reshape(2, 4, 4) for at_ns, buffer in buffers.items()}


def test_cells_have_the_colour_of_their_probability_and_fade_in_the_end(rows: Table) -> None:
    told = pictures(rows)
    assert list(told) == [1 * S, 2 * S, 7 * S]
    assert (told[S] == style.belief_colours(np.array([style.UNIFORM_BELIEF]))[0]).all()
    top, third = style.belief_colours(np.array([1.0, 1 / 3]))
    assert told[2 * S][1, 1].tolist() == top.tolist()  # cell 1 is in the lower row
    assert told[2 * S][0, 2].tolist() == third.tolist()
    assert int((told[2 * S][..., 3] > 0).sum()) == 2
    assert not told[7 * S].any()


def test_the_picture_lies_where_the_grid_is(rows: Table) -> None:
    (place,) = (row for row in rows["/map/beliefs/0"] if row.get("Transform3D:scale") is not None)
    assert place["Transform3D:scale"] == [[5.0, 5.0, 1.0]]
    assert place["Transform3D:translation"] == [[0.0, -10.0, 0.0]]  # its upper left corner; north is up


def middles(rows: Table, entity: str) -> dict[int, list[list[float]]]:
    """Middles of the squares at each instant."""
    strips = timed(rows[entity], "LineStrips2D:strips")
    return {at_ns: [np.mean(strip[:-1], axis=0).tolist() for strip in each] for at_ns, each in strips.items()}


def test_leaders_are_squared_until_they_die(rows: Table) -> None:
    assert middles(rows, "/map/leaders") == {S: [[0.0, 0.0]], 2 * S: [pytest.approx([10.0, 0.0])], 3 * S: []}


def test_the_choice_is_shown_for_a_while(rows: Table) -> None:
    squares = middles(rows, "/map/neighbours")
    assert squares == {2 * S: [pytest.approx([20.0, 0.0]), pytest.approx([10.0, 0.0])], 7 * S: []}
    arrows = timed(rows["/map/handoffs"], "Arrows2D:vectors")
    assert len(arrows[2 * S]) == 1
    assert arrows[2 * S][0][0] > 0.0
    assert arrows[7 * S] == []


def test_trails_and_distances(rows: Table) -> None:
    strips = timed(rows["/map/trails/0"], "LineStrips2D:strips")
    assert strips[2 * S] == [[[3.0, -7.0], [6.0, -2.0]]]
    assert timed(rows["/plots/track/error_0"], "Scalars:scalars") == {S: [pytest.approx(3.0)], 2 * S: [5.0]}
    assert timed(rows["/plots/track/spread_0"], "Scalars:scalars") == {S: [5.0]}


def test_sensors_have_the_rim_of_their_kind(rows: Table) -> None:
    (bearing,) = rows["/map/bearing_sensors"]
    assert bearing["Points2D:positions"] == [[10.0, 0.0]]
    assert [len(row["Points2D:positions"]) for row in rows["/map/amplitude_sensors"]] == [2]


def test_the_log_tells_the_hand_off(rows: Table) -> None:
    assert (2 * S, "INFO", "a: hands track 0 to b, chosen among 2 (20 byte)") in log_of(rows)


def test_a_late_window_remembers_who_leads(tmp_path: Path) -> None:
    write_track(tmp_path / "track.mcap")
    late = recording(tmp_path / "track.mcap", tmp_path, start_s=2.5, end_s=2.9)
    assert middles(late, "/map/leaders") == {2_500_000_000: [pytest.approx([10.0, 0.0])]}
    assert list(pictures(late)) == [2_500_000_000]
    assert list(timed(late["/map/handoffs"], "Arrows2D:vectors")) == [2_500_000_000]


def test_threads_of_a_track_are_shown_beside_each_other(tmp_path: Path) -> None:
    path = tmp_path / "threads.mcap"
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        writer.write(FieldInfo(20.0, 10.0, 0.0, 0.0), 0)
        writer.write(TruthTargets([0], [3.0], [2.0]), 0)
        for step in (1, 2):
            for thread in (0, 1):
                writer.write(Estimate(thread, 0, 3.0 + thread + step, 2.0, [], thread), step * S)
                writer.write(Belief(thread, 0, step, 0.0, 0.0, 5.0, 4, [thread], [1.0], thread), step * S)
                writer.write(Handoff(thread, 0, step, 2, [2], [0.5], "grid", 20, 0.0, thread), step * S)
        writer.write(TruthTargets([0], [3.0], [2.0]), 3 * S)
    rows = recording(path, tmp_path)
    for name, off_m in (("0", 0.0), ("0_thread_2", 1.0)):
        assert list(timed(rows[f"/map/beliefs/{name}"], "Image:buffer")) == [S, 2 * S]
        errors = timed(rows[f"/plots/track/error_{name}"], "Scalars:scalars")
        assert errors == {S: [pytest.approx(1.0 + off_m)], 2 * S: [pytest.approx(2.0 + off_m)]}
        assert len(timed(rows[f"/map/estimates/{name}"], "Points2D:positions")) == 2
    told = [text for _, _, text in log_of(rows)]
    assert "b: hands track 0 thread 2 to c, chosen among 1 (20 byte)" in told
