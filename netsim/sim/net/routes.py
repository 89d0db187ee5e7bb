"""Which neighbour is next on the way to a node."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, Protocol

import networkx as nx
from annotated_types import Gt, Le

from netsim.api import Neighbour
from netsim.parameters import parameters


@parameters
class OneHopParameters:
    """Every message goes straight to its destination; what is out of reach is lost."""

    type: Literal["one-hop"] = "one-hop"


@parameters
class ShortestPathParameters:
    """Messages are forwarded along shortest paths, computed from the links at the start."""

    type: Literal["shortest-path"] = "shortest-path"
    metric: Literal["hop", "etx"] = "etx"
    """`hop` counts hops; `etx` is the expected number of transmissions, 1 / (PRR there x PRR back), summed (De Couto et
    al. 2003)."""
    minimum_prr: Annotated[float, Gt(0), Le(1)] = 0.5
    """Links whose packet reception ratio is lower, in either direction, are not used."""


class Routes(Protocol):
    """A routing table."""

    def next_hop(self, node: int, destination: int) -> int | None:
        """The neighbour to which `node` hands a packet for `destination`; None if there is no way."""
        ...


class OneHop:
    """See `OneHopParameters`."""

    def next_hop(self, node: int, destination: int) -> int | None:
        """See `Routes.next_hop`."""
        return destination


class ShortestPaths:
    """See `ShortestPathParameters`. Trees towards a destination are computed when first asked for.

    Args:
        neighbours: Links of each node.
        parameters: Metric and threshold.
    """

    def __init__(self, neighbours: Mapping[int, Sequence[Neighbour]], parameters: ShortestPathParameters) -> None:
        self._graph = _links(neighbours, parameters)
        self._towards: dict[int, dict[int, int]] = {}

    def next_hop(self, node: int, destination: int) -> int | None:
        """See `Routes.next_hop`."""
        if destination not in self._towards:
            self._towards[destination] = self._tree(destination)
        return self._towards[destination].get(node)

    def _tree(self, destination: int) -> dict[int, int]:
        """For each node with a way to `destination`, its next hop; among equals the lowest id."""
        cost = nx.single_source_dijkstra_path_length(self._graph, destination, weight="cost")
        tree = {}
        for node in cost:
            if node != destination:
                tree[node] = min(
                    (cost[other] + self._graph[node][other]["cost"], other)
                    for other in self._graph[node]
                    if other in cost
                )[1]
        return tree


def _links(neighbours: Mapping[int, Sequence[Neighbour]], parameters: ShortestPathParameters) -> nx.Graph:
    prr = {(node, link.id): link.prr for node, links in neighbours.items() for link in links}
    graph = nx.Graph()
    graph.add_nodes_from(neighbours)
    for (node, other), there in prr.items():
        back = prr.get((other, node), 0.0)
        if node < other and min(there, back) >= parameters.minimum_prr:
            graph.add_edge(node, other, cost=1.0 if parameters.metric == "hop" else 1.0 / (there * back))
    return graph
