"""What a replay shows of groups: particles by weight, and a leader of two tracks."""

from pathlib import Path

import numpy as np
import pytest
from recordings import Table, named_nodes, recording, timed

from netsim.trace.events import FieldInfo, NodeLife, Particles, Role, TruthTargets
from netsim.trace.writer import TraceWriter

S = 1_000_000_000


def write_groups(path: Path) -> None:
    """Node a leads tracks 0 and 1 at 1 s, gives 1 to b at 2 s, and dies at 3 s; nobody speaks of track 0 from then on."""
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        writer.write(FieldInfo(20.0, 10.0, 0.0, 0.0), 0)
        for track in (0, 1):
            writer.write(Role(0, f"leader {track}", 1), 1 * S)
        writer.write(Particles(0, 1, [0, 1], 3, [0.5, 0.5, 0.0], [1, 2, 3, 4, 5, 6], [9, 8, 7, 6, 5, 4]), 1 * S)
        writer.write(Role(1, "leader 1", 1), 2 * S)
        writer.write(Role(0, "leader 1", 0), 2 * S)
        writer.write(Particles(1, 2, [1], 2, [1.0, 0.0], [7, 8], [3, 2]), 2 * S)
        writer.write(NodeLife(0, "died", "battery"), 3 * S)
        for second in range(4, 12):
            writer.write(Particles(1, second, [1], 2, [1.0, 0.0], [7, 8], [3, 2]), second * S)
        writer.write(TruthTargets([0], [3.0], [6.0]), 12 * S)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Table:
    folder = tmp_path_factory.mktemp("groups")
    write_groups(folder / "groups.mcap")
    return recording(folder / "groups.mcap", folder)


def test_particles_are_each_track_s_own_and_go_after_a_while(rows: Table) -> None:
    own = timed(rows["/map/particles/0"], "Points2D:positions")
    assert list(own) == [1 * S, 6 * S]
    np.testing.assert_allclose(np.array(own[S]), [[1.0, -9.0], [2.0, -8.0], [3.0, -7.0]])
    assert len(own[6 * S]) == 0
    other = timed(rows["/map/particles/1"], "Points2D:positions")
    assert list(other) == [second * S for second in (1, 2, *range(4, 12))]
    np.testing.assert_allclose(np.array(other[S]), [[4.0, -6.0], [5.0, -5.0], [6.0, -4.0]])


def test_heavier_particles_are_larger(rows: Table) -> None:
    both, lone = (timed(rows["/map/particles/1"], "Points2D:radii")[second * S] for second in (1, 2))
    assert both[0] == both[1] < both[2] < 0  # points on screen are below 0
    assert lone[0] == both[0]
    assert lone[1] == both[2]


def test_a_leader_of_two_tracks_is_squared_until_it_leads_neither(rows: Table) -> None:
    strips = timed(rows["/map/leaders"], "LineStrips2D:strips")
    assert {at_ns: len(each) for at_ns, each in strips.items()} == {1 * S: 1, 2 * S: 2, 3 * S: 1}
