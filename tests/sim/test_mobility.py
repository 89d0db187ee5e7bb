"""Nodes that move: positions in steps, links and neighbours that follow, before everything else of the instant."""

from types import SimpleNamespace

import pytest
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant

from netsim.api import Neighbour
from netsim.errors import ScenarioError
from netsim.models.waypoints import Waypoint, path_through
from netsim.scenario.inputs import Gathering
from netsim.sim.air import Link
from netsim.sim.clock import Clock
from netsim.sim.mobility import Mobility, Mover
from netsim.sim.node import Identity
from netsim.trace.events import AlgorithmRecord, MessageDelivered, NodePositions
from netsim.trace.recorder import Recorder

S = 10**9
MS = 10**6


class FakeAir:
    """Everybody's only link is to node 9, as strong as the node's x; neighbours within 3 m along x."""

    def __init__(self, positions):
        self.positions = dict(positions)
        self.moves = []
        self._update()

    def _update(self):
        self.neighbours = {
            node: tuple(
                Neighbour(other, abs(x - there), 1.0)
                for other, (there, _) in sorted(self.positions.items())
                if other != node and abs(x - there) < 3
            )
            for node, (x, _) in self.positions.items()
        }

    def relocate(self, moved):
        self.moves.append(dict(moved))
        self.positions.update(moved)
        self._update()
        return {node: [Link(9, x, True)] for node, (x, _) in moved.items()}


class Rig:
    def __init__(self, movers, positions, seed=1):
        self.clock = Clock(Shuffled(seed))
        self.air = FakeAir(positions)
        self.events, self.links = [], []
        recorder = Recorder(lambda: self.clock.now_ns, [self])
        self.nodes = {
            node: SimpleNamespace(
                identity=Identity(node, "", "", "sensor", place, self.air.neighbours[node], None, lambda: None)
            )
            for node, place in positions.items()
        }
        replace = lambda source, links: self.links.append((self.clock.now_ns, source, links[0].power_mw))  # noqa: E731
        Mobility(self.clock, recorder, movers, self.nodes, self.air, replace)

    def handlers(self):
        note = lambda event, at_ns: self.events.append((at_ns, list(event.node), list(event.x_m), list(event.y_m)))  # noqa: E731
        return {NodePositions: note}


def mover(start, *points, update_ms=500):
    return Mover(path_through(start, [Waypoint(at_s=t, x_m=x, y_m=y) for t, x, y in points]), update_ms * MS)


def test_positions_links_and_neighbours_change_in_steps_until_the_node_has_arrived():
    rig = Rig({1: mover((0.0, 0.0), (2, 4, 2))}, {1: (0.0, 0.0), 2: (5.0, 0.0)})
    rig.clock.environment.run()  # until nothing more will come
    assert rig.events == [
        (500 * MS, [1], [1.0], [0.5]),
        (1000 * MS, [1], [2.0], [1.0]),
        (1500 * MS, [1], [3.0], [1.5]),
        (2000 * MS, [1], [4.0], [2.0]),
    ]
    assert rig.links == [(at_ns, 1, x_m[0]) for at_ns, _, x_m, _ in rig.events]
    assert rig.nodes[1].identity.position_m == (4.0, 2.0)
    assert rig.nodes[1].identity.neighbours == (Neighbour(2, 1.0, 1.0),)
    assert rig.nodes[2].identity.neighbours == (Neighbour(1, 1.0, 1.0),)


def test_a_last_point_between_two_updates_is_reached_at_the_next():
    rig = Rig({1: mover((0.0, 0.0), (0.7, 7, 0))}, {1: (0.0, 0.0)})
    rig.clock.environment.run(until=10 * S)
    assert [(at_ns, x_m) for at_ns, _, x_m, _ in rig.events] == [(500 * MS, [5.0]), (1000 * MS, [7.0])]


def test_who_rests_is_not_moved():
    rig = Rig({1: mover((0.0, 0.0), (1, 0, 0), (2, 2, 0))}, {1: (0.0, 0.0)})
    rig.clock.environment.run(until=10 * S)
    assert [at_ns for at_ns, *_ in rig.events] == [1500 * MS, 2000 * MS]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_several_steps_meet_in_one_change_before_everything_else_of_the_instant(seed):
    movers = {
        1: mover((0.0, 0.0), (3, 3, 0), update_ms=500),
        2: mover((0.0, 1.0), (3, 3, 1), update_ms=750),
    }
    rig = Rig(movers, {1: (0.0, 0.0), 2: (0.0, 1.0)}, seed)
    seen = []
    for _ in range(20):
        rig.clock.call_after(1500 * MS, lambda _: seen.append(len(rig.air.moves)))
    rig.clock.environment.run(until=10 * S)
    assert [sorted(moved) for moved in rig.air.moves] == [[1], [2], [1], [1, 2], [1], [2], [1], [1, 2]]
    assert set(seen) == {4}


# --- whole runs, over the media -----------------------------------------------------------------------------------------

WALKER = """
  - name: walker
    placement: {type: listed, positions_m: [[30, 30]]}
    mobility: {type: waypoints, update_s: 0.5, points: [{at_s: 10, x_m: 2030, y_m: 30}, {at_s: 20, x_m: 30, y_m: 30}]}
"""


class Walk:
    """Node 9 walks away and comes back, and tells where it is; the others listen."""

    def run(self, node):
        if node.id == 9:
            for turn in range(45):
                yield from node.pause_until(turn * 500 * MS + 100 * MS)
                node.broadcast("here", b"")
                near = [neighbour.id for neighbour in node.neighbours]
                node.record(AlgorithmRecord(9, "at", f"{node.position_m[0]:g} {len(near)}"))
        yield from node.pause_until(23 * S)


def walked(folder, medium, **settings):
    return small(
        folder, more=WALKER, algorithm='{type: "test_mobility:Walk"}', medium=medium, duration_s=23, **settings
    )


@pytest.mark.parametrize("medium", ["{type: ideal, range_m: 60}", "{type: log-distance, exponent: 3.0}"])
def test_a_node_that_walks_out_of_reach_is_not_heard_until_it_is_back(tmp_path, medium):
    events, _ = run(walked(tmp_path, medium))
    heard = sorted(time_ns / S for time_ns, event in events if isinstance(event, MessageDelivered))
    assert [time_s for time_s in heard if time_s < 0.5]
    assert [time_s for time_s in heard if time_s > 20]
    assert not [time_s for time_s in heard if 5 < time_s < 15]
    known = [event.fields_json.split() for _, event in events if isinstance(event, AlgorithmRecord)]
    assert known[0] == ["30", "9"]
    assert known[20] == ["2030", "0"]
    assert known[44] == ["30", "9"]
    positions = [(time_ns, event.x_m[0]) for time_ns, event in events if isinstance(event, NodePositions)]
    assert len(positions) == 40
    assert dict(positions)[5 * S] == 1030.0


def test_motion_does_not_rest_on_the_order_within_an_instant(tmp_path):
    loaded = walked(tmp_path, "{type: log-distance, exponent: 3.0}")
    assert by_instant(run(loaded, Shuffled(5))[0]) == by_instant(run(loaded)[0])


def test_a_file_moves_the_nodes_it_names_and_is_copied_with_the_run(tmp_path):
    (tmp_path / "ways.csv").write_text("node,at_s,x_m,y_m\n2,1,45,16\n", encoding="utf-8")
    loaded = small(tmp_path, more="    mobility: {type: waypoints, file: ways.csv, update_s: 1}")
    events, _ = run(loaded)
    ((at_ns, moved),) = [(time_ns, event) for time_ns, event in events if isinstance(event, NodePositions)]
    assert (at_ns, list(moved.node), list(moved.x_m), list(moved.y_m)) == (S, [2], [45.0], [16.0])
    portable, inputs = Gathering(loaded).gather()
    assert portable.nodes[0].mobility.file == "inputs/ways.csv"
    assert [each.name for each in inputs] == ["inputs/ways.csv"]


@pytest.mark.parametrize(
    ("mobility", "finding"),
    [
        (
            "{type: waypoints, points: [{at_s: 1, x_m: 0, y_m: 0}]}",
            r"nodes\[0\]\.mobility\.points: expected a group of one",
        ),
        ("{type: waypoints, file: none.csv}", r"nodes\[0\]\.mobility\.file"),
        ("{type: waypoints, file: ways.csv}", r"nodes of this group, got also the nodes 17"),
        ("{type: waypoints}", "either points or a file"),
    ],
)
def test_what_cannot_move_is_a_finding(tmp_path, mobility, finding):
    (tmp_path / "ways.csv").write_text("node,at_s,x_m,y_m\n17,1,45,16\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=finding):
        run(small(tmp_path, more=f"    mobility: {mobility}"))
