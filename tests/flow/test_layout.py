"""Places of vertices: each where it belongs, none on another."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist

from netsim.errors import TraceError
from netsim.flow.layout import lay_out, short_name
from netsim.trace.events import NodeTable, TruthTargets, VariablePlacement


def node_table(places: list[tuple[float, float]]) -> NodeTable:
    xs, ys = zip(*places, strict=True)
    count, none = len(places), [""] * len(places)
    return NodeTable(range(count), none, none, none, xs, ys, none, none, [1.0] * count)


CORNERS = [(0.0, 0.0), (10.0, 0.0), (0.0, 10.0), (10.0, 10.0)]


def test_vertices_stand_where_they_belong() -> None:
    """Sensors at their nodes, a target at its true place, a subregion between its sensors."""
    names = [*(f"sensor {node}" for node in range(4)), "target 7", "subregion 0"]
    model = VariablePlacement(range(6), names, [0, 1, 2, 3, 0, 1], [0, 1, 2, 3], [4, 4, 5, 5])
    layout = lay_out(model, node_table(CORNERS), TruthTargets([3, 7], [1.0, 6.0], [1.0, 5.0]))
    np.testing.assert_allclose(layout.place_m, [*CORNERS, (6, 5), (5, 10)])
    assert layout.label == ("s0", "s1", "s2", "s3", "t7", "r0")
    assert layout.is_square.tolist() == [False] * 4 + [True] * 2
    assert layout.edges.tolist() == [[0, 4], [1, 4], [2, 5], [3, 5]]


def test_variables_of_one_node_are_spread_around_it() -> None:
    model = VariablePlacement(range(8), [f"variable {i}" for i in range(8)], [0] * 5 + [1, 2, 3], [], [])
    layout = lay_out(model, node_table(CORNERS), None)
    assert pdist(layout.place_m).min() >= 0.95 * layout.gap_m
    np.testing.assert_allclose(layout.place_m[5:], CORNERS[1:])
    assert np.linalg.norm(layout.place_m[:5], axis=1).max() < 2.5 * layout.gap_m


def test_arrows_go_from_rim_to_rim_beside_each_other() -> None:
    model = VariablePlacement([4, 9], ["sensor 0", "sensor 1"], [0, 1], [4], [9])
    tails, ways = lay_out(model, node_table(CORNERS[:2]), None).arrows([(4, 9), (9, 4), (4, 9)], 1.0)
    np.testing.assert_allclose(tails, [[0.55, -0.14], [9.45, 0.14]])
    np.testing.assert_allclose(ways, [[8.9, 0.0], [-8.9, 0.0]])


def test_a_lonely_vertex_has_a_place() -> None:
    layout = lay_out(VariablePlacement([3], ["x"], [0], [], []), node_table(CORNERS[:1]), None)
    assert layout.place_m.tolist() == [[0.0, 0.0]]
    assert layout.gap_m == 1.0


coordinates = st.integers(0, 4).map(float)


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=6, unique=True),
    st.lists(st.integers(0, 5), min_size=0, max_size=10),
)
def test_no_vertex_hides_another(places: list[tuple[float, float]], hosts: list[int]) -> None:
    """Whatever is hosted where, also many squares on one node: sensors stay, and any two keep most of the gap."""
    count = len(places)
    names = [f"sensor {node}" for node in range(count)] + [f"factor {number}" for number in range(len(hosts))]
    model = VariablePlacement(range(len(names)), names, [*range(count), *(host % count for host in hosts)], [], [])
    layout = lay_out(model, node_table(places), None)
    spread = min(math.dist(a, b) for i, a in enumerate(places) for b in places[:i])
    if spread >= layout.gap_m:
        np.testing.assert_allclose(layout.place_m[:count], places)
    assert pdist(layout.place_m).min() >= 0.8 * layout.gap_m


def test_names() -> None:
    assert [short_name(name) for name in ("sensor 12", "subregion 3", "x4", "head left")] == [
        "s12",
        "r3",
        "x4",
        "head left",
    ]


def test_a_model_that_does_not_fit_its_nodes_is_refused() -> None:
    with pytest.raises(TraceError, match="on node 8, which the table of nodes lacks"):
        lay_out(VariablePlacement([0], ["sensor 0"], [8], [], []), node_table(CORNERS), None)
    with pytest.raises(TraceError, match="edge to vertex 5"):
        lay_out(VariablePlacement([0], ["sensor 0"], [1], [0], [5]), node_table(CORNERS), None)
