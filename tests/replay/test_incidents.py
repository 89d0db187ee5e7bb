"""What befalls the nodes: crashes, faults, ways, clocks and interference, as the replay shows and tells them."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from incidents import (
    CRASH_S,
    CRASHED,
    CUT,
    DEAD,
    DEATH_S,
    JAMMED,
    JAMMED_S,
    JAMMER_M,
    NODES,
    OUTAGE_S,
    REBOOT_S,
    WALKERS,
    place,
    write_incidents,
)
from recordings import MS, Table, log_of, named_nodes, recording, timed

from netsim.replay.motion import Motion, Moves
from netsim.replay.options import ReplayOptions, decide
from netsim.replay.scene import load_scene
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    EnergyBudget,
    Event,
    Frame,
    LinkTable,
    MessageDropped,
    MessageSent,
    NodeClocks,
    NodeLife,
    NodePositions,
    NodeTable,
    RadioState,
    RouteChange,
)
from netsim.trace.writer import TraceWriter

S = 1000 * MS


def at(time_s: float) -> int:
    return round(time_s * S)


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("incidents") / "incidents.mcap"
    write_incidents(path)
    return path


@pytest.fixture(scope="module")
def rows(trace: Path, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return recording(trace, tmp_path_factory.mktemp("rows"))


def written(path: Path, events: Sequence[tuple[int, Event]], names: str = "abc") -> Path:
    """A trace of nodes in a row, 10 m apart, and these events."""
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes(*names), 0)
        for time_ns, event in events:
            writer.write(event, time_ns)
    return path


def frame(source: int, start_ns: int, end_ns: int, destination: int, heard: dict[int, str]) -> tuple[int, Frame]:
    codes, ears = [OUTCOME_CODE[name] for name in heard.values()], [0.0] * len(heard)
    return end_ns, Frame(0, start_ns, end_ns, source, destination, "x", 0, 9, 0, 1, 0.0, list(heard), codes, ears, ears)


def test_the_log_tells_incidents_in_words(rows: Table) -> None:
    lines = [(time_ns / S, level, text) for time_ns, level, text in log_of(rows) if "gave up" not in text]
    assert lines == [
        (0.0, "INFO", f"{NODES} nodes started: Reporting"),
        (0.5, "DEBUG", "n11: route to n00 by n06 (cost 2.1)"),
        (0.5, "DEBUG", "n17: route to n00 by n12 (cost 3.2)"),
        (6.0, "WARN", "fault 0 (outage) begins: both directions"),
        (7.0, "DEBUG", "fault 2 (crash) strikes: back after 8 s"),
        (7.0, "ERROR", "n12 crashed: rule 2"),
        (7.4, "INFO", "n17: route to n00 by n16 (cost 3.6)"),
        (8.0, "WARN", "fault 1 (jammer) begins: at (33, 12) m, 10 dBm"),
        (8.5, "WARN", "n04: no route to n00 any more"),
        (9.0, "ERROR", "n19 died: battery empty"),
        (9.5, "WARN", "n06: energy allowance short, policy warn (0.1001 of 0.1 J spent)"),
        (9.7, "WARN", "n06: energy allowance of track refuses send (0.02 of 0.02 J spent)"),
        (12.0, "INFO", "fault 1 (jammer) ends: at (33, 12) m, 10 dBm"),
        (12.0, "INFO", "n06: energy allowance replenished (0 of 0.1 J spent)"),
        (14.0, "INFO", "fault 0 (outage) ends at n10, n15"),
        (15.0, "INFO", "n12 rebooted: Reporting"),
    ]
    for path, part in rows.items():  # one level an entity: see `netsim.replay.text`
        if path.startswith("/log/"):
            assert {row["TextLog:level"][0].lower() for row in part} == {path.removeprefix("/log/")}


def test_routes_that_change_alike_share_a_line(tmp_path: Path) -> None:
    changes = [RouteChange(0, number, 1, 1.0) for number in (1, 2, 3, 4)] + [RouteChange(0, BROADCAST, BROADCAST, 0.0)]
    lines = log_of(recording(written(tmp_path / "x.mcap", [(MS, change) for change in changes], "abcde"), tmp_path))
    assert {text for *_, text in lines} == {"a: route to 4 nodes by b", "a: no route to a sink any more"}


def test_the_routes_to_the_sink_are_lines_to_next_hops_while_they_hold(tmp_path: Path) -> None:
    none, four = [""] * 4, [0.0] * 4
    table = NodeTable(range(4), list("abcs"), none, ["sensor"] * 3 + ["sink"], [0, 10, 20, 30], four, none, none, four)
    events: list[tuple[int, Event]] = [
        (S, RouteChange(0, 3, 1, 2.0)),
        (S, RouteChange(1, BROADCAST, 3, 1.0)),
        (S, RouteChange(2, 0, 1, 2.0)),  # not towards a sink
        (2 * S, RouteChange(0, 3, 2, 2.0)),
        (3 * S, NodePositions([2], [20.0], [7.0])),
        (4 * S, RouteChange(1, BROADCAST, BROADCAST, 0.0)),
        (5 * S, NodeLife(0, "crashed", "")),
    ]
    with TraceWriter(tmp_path / "x.mcap", {}) as writer:
        writer.write(table, 0)
        for time_ns, event in events:
            writer.write(event, time_ns)
    lines = timed(recording(tmp_path / "x.mcap", tmp_path)["/map/routes"], "LineStrips2D:strips")
    assert {time_ns // S: strips for time_ns, strips in lines.items()} == {
        0: [],
        1: [[[0, 0], [10, 0]], [[10, 0], [30, 0]]],
        2: [[[0, 0], [20, 0]], [[10, 0], [30, 0]]],
        3: [[[0, 0], [20, -7]], [[10, 0], [30, 0]]],
        4: [[[0, 0], [20, -7]]],
        5: [],
    }


def test_tasks_without_a_limit_and_drops_of_no_message_are_told_without_one(tmp_path: Path) -> None:
    events: list[tuple[int, Event]] = [
        (MS, EnergyBudget(0, "ended", "track", 0.25, math.inf, "")),
        (2 * MS, MessageDropped(0, 1, BROADCAST, 1, "beacon", "channel_busy")),
        (3 * MS, MessageDropped(7, 1, 2, 0, "x", "hop_limit")),
    ]
    assert log_of(recording(written(tmp_path / "x.mcap", events), tmp_path)) == [
        (MS, "DEBUG", "a: task track took 0.25 J"),
        (2 * MS, "WARN", "b: gave up beacon to all: channel busy"),
        (3 * MS, "WARN", "a: gave up x #7 from b to c: hop limit"),
    ]


def test_the_log_leaves_out_what_others_gave_up(tmp_path: Path) -> None:
    events: list[tuple[int, Event]] = [
        (0, MessageSent(1, 0, 1, "x", 9, 1, [])),
        (0, MessageSent(3, 1, 2, "y", 9, 1, [])),
        (MS, MessageDropped(1, 0, 1, 0, "x", "no_route")),
        (2 * MS, MessageDropped(2, 1, 2, 1, "x", "queue_full")),
        (3 * MS, MessageDropped(3, 1, 2, 1, "y", "queue_full")),
        (4 * MS, MessageDropped(4, 2, 1, 0, "y", "hop_limit")),
    ]
    trace = written(tmp_path / "x.mcap", events)
    for options, times in [
        ({"nodes": frozenset({0})}, [1, 4]),
        ({"nodes": frozenset({2})}, [2, 3, 4]),
        ({"kinds": frozenset({"y"})}, [3, 4]),
        ({"kinds": frozenset({"y"}), "nodes": frozenset({0})}, [4]),
    ]:
        assert [time_ns // MS for time_ns, *_ in log_of(recording(trace, tmp_path, **options))] == times


def test_the_dead_stay_dark_and_the_crashed_come_back(rows: Table) -> None:
    dead, crashed = (timed(rows[f"/map/{what}"], "Points2D:positions") for what in ("dead", "crashed"))
    x_m, y_m = place(DEAD, DEATH_S)
    assert {time_ns: positions for time_ns, positions in dead.items() if positions} == {
        time_ns: [[x_m, -y_m]] for time_ns in dead if time_ns >= at(DEATH_S)
    }
    assert min(crashed) == at(CRASH_S)
    assert {time_ns for time_ns, positions in crashed.items() if not positions} == {at(REBOOT_S)}
    crosses = timed(rows["/map/crashed/crosses"], "LineStrips2D:strips")
    assert {len(strips) for time_ns, strips in crosses.items() if time_ns < at(REBOOT_S)} == {2}
    lane = timed(rows[f"/radio/n{CRASHED}"], "StateChange:state")
    assert lane[at(CRASH_S)] == ["crashed"]
    assert lane[at(REBOOT_S)] == ["listen"]
    labels = next(row["Points2D:labels"] for row in rows["/map/legend/labels"])
    assert {"dead", "crashed", "fault at work", "jammer", "way of a node"} <= set(labels)
    assert "collided, captured, jammed" in labels


def test_a_crashed_node_that_died_of_it_is_only_dead(tmp_path: Path) -> None:
    lives = [(MS, NodeLife(0, "crashed", "")), (2 * MS, NodeLife(0, "died", "")), (3 * MS, NodeLife(1, "crashed", ""))]
    rows = recording(written(tmp_path / "x.mcap", lives), tmp_path)
    assert {when: len(at) for when, at in timed(rows["/map/dead"], "Points2D:positions").items()} == {2 * MS: 1}
    crashed = {when: len(at) for when, at in timed(rows["/map/crashed"], "Points2D:positions").items()}
    assert crashed == {MS: 1, 2 * MS: 0, 3 * MS: 1}


def test_faults_ring_their_nodes_while_they_last_and_a_jammer_is_seen(rows: Table) -> None:
    rings = timed(rows["/map/faults"], "LineStrips2D:strips")
    count = {time_s: len(rings[max(when for when in rings if when <= at(time_s))]) for time_s in (1, 7, 9, 13, 15)}
    both = len({*JAMMED, *CUT})
    assert count == {1: 0, 7: len(CUT), 9: both, 13: len(CUT), 15: 0}
    jammer = timed(rows["/map/jammers/1"], "Points2D:positions")
    assert jammer == {at(JAMMED_S[0]): [[JAMMER_M[0], -JAMMER_M[1]]], at(JAMMED_S[1]): []}
    assert OUTAGE_S[0] < JAMMED_S[0]


def test_a_late_window_remembers_who_is_down_and_what_is_at_work(trace: Path, tmp_path: Path) -> None:
    late = recording(trace, tmp_path, start_s=10.2, end_s=11.2)
    for path, component, count in (
        ("/map/crashed", "Points2D:positions", 1),
        ("/map/dead", "Points2D:positions", 1),
        ("/map/faults", "LineStrips2D:strips", len({*JAMMED, *CUT})),
        ("/map/jammers/1", "Points2D:positions", 1),
    ):
        shown = timed(late[path], component)
        assert min(shown) == at(10.2)
        assert len(shown[at(10.2)]) == count
    positions = timed(late["/map/nodes"], "Points2D:positions")
    x_m, y_m = place(WALKERS[0], 10.0)
    assert positions[at(10.2)][WALKERS[0]] == pytest.approx([x_m, -y_m])


def test_nodes_names_and_ends_of_arrows_follow_a_move(tmp_path: Path) -> None:
    events: list[tuple[int, Event]] = [
        (0, LinkTable([0, 1, 1, 2], [1, 0, 2, 1], [-60.0] * 4, [1.0] * 4)),
        (S, NodePositions([1], [10.0], [40.0])),
        frame(0, S - MS, S + MS, 1, {1: "received"}),
        frame(0, S + MS, S + 2 * MS, 1, {1: "received"}),
        (3 * S, NodePositions([1, 2], [-50.0, 20.0], [0.0, 5.0])),
        (4 * S, NodeLife(1, "crashed", "")),
        (5 * S, NodePositions([1], [-60.0], [0.0])),
    ]
    path = written(tmp_path / "x.mcap", events)
    rows = recording(path, tmp_path, hold_s=0.15, tick_s=0.05)
    positions = timed(rows["/map/nodes"], "Points2D:positions")
    assert {time_ns: row[1] for time_ns, row in positions.items()} == {
        0: [10.0, 0.0], S: [10.0, -40.0], 3 * S: [-50.0, 0.0], 5 * S: [-60.0, 0.0],
    }  # fmt: skip
    assert positions[3 * S][2] == [20.0, -5.0]
    assert sorted(timed(rows["/map/nodes/rims"], "Points2D:positions")) == sorted(positions)
    names = timed(rows["/map/nodes/labels"], "Points2D:positions")
    assert [names[S][1][0], names[S][0]] == [10.0, names[0][0]]
    # Two frames in the air at once: the first was sent to where node b was before, the second to where it is now.
    heads = np.array(timed(rows["/map/messages/x"], "Arrows2D:vectors")[S + 50 * MS])
    assert heads.shape == (2, 2)
    np.testing.assert_allclose(heads[0] / np.linalg.norm(heads[0]), [1.0, 0.0], atol=1e-6)
    way = np.array([10.0, -40.0])
    np.testing.assert_allclose(heads[1] / np.linalg.norm(heads[1]), way / np.linalg.norm(way), atol=1e-6)
    # What is known of the links is from before the move.
    links = {when: len(strips) for when, strips in timed(rows["/map/links"], "LineStrips2D:strips").items()}
    assert links == {0: 2, S: 0, 3 * S: 0, 4 * S: 0}
    crashed = timed(rows["/map/crashed"], "Points2D:positions")
    assert crashed == {4 * S: [[-50.0, 0.0]], 5 * S: [[-60.0, 0.0]]}
    ways = [row["LineStrips2D:strips"] for row in rows["/map/ways"]]
    assert [len(way) for way in ways[0]] == [4, 2]
    (left, right), (top, _) = load_scene(path).bounds(1)
    assert left < -60
    assert right > 20
    assert top < -40


moves = st.lists(st.tuples(st.integers(0, 50), st.integers(0, 3), st.integers(-9, 9)), max_size=12)


@given(moves, st.lists(st.tuples(st.integers(0, 3), st.integers(-5, 60)), min_size=1, max_size=8))
def test_a_node_is_where_the_last_announcement_put_it(
    announced: list[tuple[int, int, int]], asked: list[tuple[int, int]]
) -> None:
    announced.sort(key=lambda move: move[0])
    time_ns, row, x_m = np.array(announced, np.int64).reshape(-1, 3).T
    start = np.array([[100.0 + number, 0.0] for number in range(4)])
    motion = Motion(start, Moves(time_ns, row, np.column_stack([x_m, x_m]).astype(float)))
    rows, times = np.array(asked, np.int64).T
    expected = [
        next((x for when, other, x in reversed(announced) if other == node and when <= now), 100 + node)
        for node, now in asked
    ]
    assert motion.places(rows, times)[:, 0].tolist() == expected
    first = {node: min(when for when, other, _ in announced if other == node) for node in set(row.tolist())}
    assert dict((node, when) for when, node in motion.first_moves()) == first


def test_many_moves_are_shown_at_few_instants(trace: Path) -> None:
    scene = load_scene(trace)
    pace = decide(ReplayOptions(start_s=3.25), at(20.0))
    instants = scene.motion.instants(pace, 10)
    assert instants[0] == pace.start_ns
    assert (np.diff(instants) >= (pace.end_ns - pace.start_ns) // 10).all()
    assert len(instants) <= 12
    assert len(scene.motion.instants(pace, 10_000)) == 1 + 33  # the start, and each half second up to 19.5 s


def test_interference_is_red_and_other_losses_are_grey_with_their_reason(tmp_path: Path) -> None:
    names = "abcdefgh"
    fates = ("collided", "captured", "jammed", "outage", "corrupted", "lost", "weak")
    events = [frame(0, 200 * MS * n, 200 * MS * n + MS, n + 1, {n + 1: fate}) for n, fate in enumerate(fates)]
    events.append(frame(0, 2 * S, 2 * S + MS, BROADCAST, {1: "jammed", 2: "outage"}))
    rows = recording(written(tmp_path / "x.mcap", events, names), tmp_path, hold_s=0.15, tick_s=0.05)
    red, grey = (timed(rows[f"/map/losses/{layer}"], "Arrows2D:labels") for layer in ("interference", "lost"))
    assert {labels[0] for labels in red.values() if labels} == {"collided", "captured", "jammed"}
    assert {labels[0] for labels in grey.values() if labels} == {"outage", "corrupted", "lost", "weak"}
    told = timed(rows["/map/losses/interference/reasons"], "Points2D:labels")
    assert told[0] == []  # that frames collided is seen
    assert told[200 * MS] == ["captured"]
    assert red[2 * S] == ["jammed"]
    assert 2 * S not in grey  # a broadcast is missed over good links only


def lane(rows: Table, name: str) -> list[tuple[int, str]]:
    """Instant in ms and state; of several states of one instant the last."""
    return sorted(
        (time_ns // MS, state[0]) for time_ns, state in timed(rows[f"/radio/{name}"], "StateChange:state").items()
    )


def test_a_reception_that_was_left_ends_with_what_follows_or_with_the_frame(tmp_path: Path) -> None:
    events = [
        frame(1, 104 * MS, 107 * MS, 0, {0: "received"}),  # takes the listener away from the next
        frame(2, 100 * MS, 110 * MS, 0, {0: "captured"}),
        frame(1, 204 * MS, 215 * MS, 0, {0: "received"}),
        frame(2, 300 * MS, 310 * MS, 0, {0: "captured"}),  # nothing is known to follow: what took it was lost
        frame(2, 400 * MS, 410 * MS, 0, {0: "captured"}),
        (405 * MS, RadioState(0, 1)),
        frame(2, 500 * MS, 510 * MS, 0, {0: "corrupted"}),
    ]
    later = frame(2, 200 * MS, 210 * MS, 0, {0: "captured"})
    rows = recording(written(tmp_path / "x.mcap", sorted([*events, later], key=lambda event: event[0])), tmp_path)
    assert lane(rows, "a") == [
        (0, "listen"),
        (100, "captured"), (104, "receive"), (107, "listen"),
        (200, "captured"), (204, "receive"), (215, "listen"),
        (300, "captured"), (310, "listen"),
        (400, "captured"), (405, "sleep"),
        (500, "corrupted"), (510, "listen"),
    ]  # fmt: skip


def test_clocks_are_plotted_in_the_unit_that_suits(tmp_path: Path) -> None:
    few: list[tuple[int, Event]] = [(n * S, NodeClocks([2, 0], [n * 3e-5, n * -2e-6])) for n in range(3)]
    rows = recording(written(tmp_path / "few.mcap", few), tmp_path)
    assert timed(rows["/plots/clock/c"], "Scalars:scalars") == {n * S: [pytest.approx(30.0 * n)] for n in range(3)}
    assert timed(rows["/plots/clock/a"], "Scalars:scalars")[2 * S] == [pytest.approx(-4.0)]
    many: list[tuple[int, Event]] = [(S, NodeClocks(range(20), np.linspace(-0.5, 0.4, 20) * 1e-2))]
    rows = recording(written(tmp_path / "many.mcap", many, "abcdefghijklmnopqrst"), tmp_path)
    curves = {
        path.rsplit("/", 1)[1]: timed(part, "Scalars:scalars")[S] for path, part in rows.items() if "clock" in path
    }
    assert {name.replace("\\", ""): value for name, value in curves.items()} == {
        "most ahead": [pytest.approx(4.0)], "mean": [pytest.approx(-0.5)], "most behind": [pytest.approx(-5.0)],
    }  # fmt: skip
