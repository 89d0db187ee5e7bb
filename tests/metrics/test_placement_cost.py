"""Hops between hosts, against networkx, and how full hosts are."""

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from netsim.metrics.collect import metrics_of
from netsim.metrics.placement import hops_between
from netsim.trace.events import LinkTable, VariablePlacement


def links(pairs, prr=1.0):
    both = sorted({*pairs, *(pair[::-1] for pair in pairs)})
    return LinkTable(
        source=[a for a, _ in both], destination=[b for _, b in both], gain_db=[0.0] * len(both), prr=[prr] * len(both)
    )


def figures(pairs, hosts, edges):
    placement = VariablePlacement(
        variable=list(range(len(hosts))),
        name=[f"v{i}" for i in range(len(hosts))],
        host=hosts,
        edge_a=[a for a, _ in edges],
        edge_b=[b for _, b in edges],
    )
    return metrics_of([(0, links(pairs)), (0, placement)])


def test_hops_between_hosts():
    found = figures([(0, 1), (1, 2), (2, 3)], [0, 2, 2, 3, 9], [(0, 1), (1, 2), (0, 3), (3, 4)])
    assert found["hosted_variables_max"] == 2
    assert found["placement_edges_over_air"] == 3
    assert found["placement_hops_mean"] == (2 + 0 + 3) / 3
    assert found["placement_edges_stranded"] == 1


def test_no_edges_and_no_variables():
    assert figures([(0, 1)], [0, 1], [])["placement_hops_mean"] is None
    assert "hosted_variables_max" not in metrics_of([(0, links([(0, 1)]))])


PAIRS = st.sets(st.tuples(st.integers(0, 7), st.integers(0, 7)).filter(lambda pair: pair[0] < pair[1]))


@given(PAIRS)
def test_fewest_hops_by_networkx(pairs):
    graph = nx.Graph(list(pairs))
    graph.add_nodes_from(range(8))
    lengths = dict(nx.all_pairs_shortest_path_length(graph))
    wanted = [(a, b) for a in range(8) for b in range(8)]
    assert hops_between(wanted, sorted(pairs)) == {(a, b): lengths[a].get(b) for a, b in wanted}
