"""Next hops against networkx's shortest paths."""

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from netsim.api import Neighbour
from netsim.sim.net.routes import ShortestPathParameters, ShortestPaths


@given(
    count=st.integers(2, 9),
    ratios=st.lists(st.sampled_from([0.0, 0.3, 0.5, 0.8, 0.9, 1.0]), min_size=72, max_size=72),
    metric=st.sampled_from(["hop", "etx"]),
)
def test_next_hops_lead_along_cheapest_paths(count: int, ratios: list[float], metric: str) -> None:
    prr = {(a, b): ratios[a * 8 + b - (b > a)] for a in range(count) for b in range(count) if a != b}
    neighbours = {
        node: tuple(Neighbour(other, 1.0, prr[node, other]) for other in range(count) if other != node)
        for node in range(count)
    }
    routes = ShortestPaths(neighbours, ShortestPathParameters(metric=metric))
    graph = nx.Graph()
    graph.add_nodes_from(range(count))
    for (a, b), there in prr.items():
        if min(there, prr[b, a]) >= 0.5:
            graph.add_edge(a, b, cost=1.0 if metric == "hop" else 1.0 / (there * prr[b, a]))
    for destination in range(count):
        cost = nx.single_source_dijkstra_path_length(graph, destination, weight="cost")
        for node in range(count):
            hop = routes.next_hop(node, destination)
            if node == destination or node not in cost:
                assert hop is None
            else:
                assert hop is not None
                best = [n for n in graph[node] if abs(cost[n] + graph[node][n]["cost"] - cost[node]) < 1e-9]
                assert hop in best
