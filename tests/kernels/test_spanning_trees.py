"""Covering forests against networkx."""

import networkx as nx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.spanning_trees import components, covering_forests, diameter, edge_probabilities, neighbours_in

EDGES = st.sets(st.tuples(st.integers(0, 9), st.integers(0, 9)).filter(lambda edge: edge[0] < edge[1]), max_size=25)


@given(EDGES)
def test_every_forest_spans_and_together_they_cover(edges):
    graph = nx.Graph(edges)
    forests = covering_forests(edges)
    for forest in forests:
        tree = nx.Graph(forest)
        assert forest <= edges
        assert nx.is_forest(tree)
        assert set(tree) == set(graph)
        assert nx.number_connected_components(tree) == nx.number_connected_components(graph)
    assert set().union(*forests) == edges
    probability = edge_probabilities(forests)
    assert all(0 < value <= 1 for value in probability.values())
    inside = len(graph) - nx.number_connected_components(graph) if edges else 0
    assert sum(probability.values()) == pytest.approx(inside)


@given(EDGES)
def test_components_neighbours_and_diameter(edges):
    graph = nx.Graph(edges)
    graph.add_nodes_from(range(10))
    assert {frozenset(part) for part in components(range(10), edges)} == set(
        map(frozenset, nx.connected_components(graph))
    )
    for forest in covering_forests(edges):
        tree = nx.Graph(forest)
        assert {v: sorted(tree[v]) for v in tree} == {v: list(near) for v, near in neighbours_in(forest).items()}
        parts = (tree.subgraph(part) for part in nx.connected_components(tree))
        assert diameter(forest) == max(nx.diameter(part) for part in parts)


def test_a_tree_needs_itself_alone():
    edges = {(0, 1), (1, 2), (1, 3)}
    assert covering_forests(edges) == (frozenset(edges),)
    assert covering_forests([]) == ()
