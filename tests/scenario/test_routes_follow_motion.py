"""Given routes follow nodes that move, as given neighbours do."""

import pytest

from netsim.scenario.make_network import _GivenNear
from netsim.sim.net.routes import ShortestPathParameters, ShortestPaths
from tests.scenario.air_rig import air_of, scenario

LISTED = "{type: listed, positions_m: [[0, 0], [200, 200]]}"


@pytest.fixture
def air(tmp_path):
    return air_of(scenario(tmp_path, "{type: ideal, range_m: 25}", LISTED))


def test_shortest_paths_follow_a_walker(air):
    routes = ShortestPaths(air.neighbours, ShortestPathParameters(), lambda: air.version)
    assert routes.next_hop(0, 1) is None
    air.relocate({1: (10.0, 0.0)})
    assert routes.next_hop(0, 1) == 1
    air.relocate({1: (200.0, 200.0)})
    assert routes.next_hop(0, 1) is None


def test_routing_by_position_follows_a_walker(air):
    near = _GivenNear(air, 0, 0.5)
    assert near() == {}
    air.relocate({1: (10.0, 0.0)})
    assert near() == {1: (10.0, 0.0)}
    air.relocate({1: (12.0, 0.0)})
    assert near() == {1: (12.0, 0.0)}
