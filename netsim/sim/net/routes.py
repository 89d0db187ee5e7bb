"""Which neighbour is next on the way to a node."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Literal, Protocol

import numpy as np
from annotated_types import Gt, Le
from numpy.typing import NDArray

from netsim.api import Neighbour
from netsim.parameters import Positive, parameters
from netsim.sim.net.settings import NetworkSettings


@parameters
class OneHopParameters(NetworkSettings):
    """Every message goes straight to its destination; what is out of reach is lost."""

    type: Literal["one-hop"] = "one-hop"


@parameters
class ShortestPathParameters(NetworkSettings):
    """Messages are forwarded along shortest paths.

    Where neighbours are given, the paths are computed from the links, anew when nodes have moved. Where they are
    discovered, the nodes tell each other their distances (see `netsim.sim.net.distance_vector`), and find new ways when
    nodes die.
    """

    type: Literal["shortest-path"] = "shortest-path"
    metric: Literal["hop", "etx"] = "etx"
    """`hop` counts hops; `etx` is the expected number of transmissions, 1 / (PRR there x PRR back), summed (De Couto et
    al. 2003)."""
    minimum_prr: Annotated[float, Gt(0), Le(1)] = 0.5
    """Links whose packet reception ratio is lower, in either direction, are not used."""
    update_s: Positive = 10.0
    """With discovery: mean time between a node's full tables of distances."""


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
        neighbours: Links of each node; always the same nodes.
        parameters: Metric and threshold.
        version: Another number whenever the links may have changed; by default they do not.
    """

    def __init__(
        self,
        neighbours: Mapping[int, Sequence[Neighbour]],
        parameters: ShortestPathParameters,
        version: Callable[[], int] = lambda: 0,
    ) -> None:
        self._neighbours = neighbours
        self._parameters = parameters
        self._version = version
        self._nodes = sorted(neighbours)
        self._index = {node: index for index, node in enumerate(self._nodes)}
        self._read_links()

    def _read_links(self) -> None:
        self._of_version = self._version()
        links = sorted(_links(self._neighbours, self._parameters))
        self._from = np.array([self._index[node] for node, _, _ in links], np.intp)
        self._to = np.array([self._index[other] for _, other, _ in links], np.intp)
        self._cost = np.array([cost for _, _, cost in links], float)
        self._towards: dict[int, dict[int, int]] = {}

    def next_hop(self, node: int, destination: int) -> int | None:
        """See `Routes.next_hop`."""
        if self._version() != self._of_version:
            self._read_links()
        if destination not in self._towards:
            self._towards[destination] = self._tree(destination)
        return self._towards[destination].get(node)

    def _tree(self, destination: int) -> dict[int, int]:
        """For each node with a way to `destination`, its next hop; among equals the lowest id."""
        if not len(self._cost) or destination not in self._index:
            return {}
        through = self._distances(self._index[destination])[self._to] + self._cost
        first = np.flatnonzero(np.diff(self._from, prepend=-1))  # links are sorted by sender, then by receiver
        best = np.minimum.reduceat(through, first)
        tree = {}
        ends = np.append(first[1:], len(through))
        for begin, end, least in zip(first.tolist(), ends.tolist(), best.tolist(), strict=True):
            node = self._nodes[self._from[begin]]
            if node != destination and least < np.inf:
                tree[node] = self._nodes[self._to[begin + int(np.argmax(through[begin:end] == least))]]
        return tree

    def _distances(self, destination: int) -> NDArray[np.float64]:
        """Cost from every node to one (links cost the same both ways)."""
        from scipy.sparse import csr_array  # imported where needed: it would slow every start
        from scipy.sparse.csgraph import dijkstra

        size = len(self._nodes)
        graph = csr_array((self._cost, (self._from, self._to)), shape=(size, size))
        distances: NDArray[np.float64] = dijkstra(graph, indices=destination)
        return distances


def _links(
    neighbours: Mapping[int, Sequence[Neighbour]], parameters: ShortestPathParameters
) -> Iterator[tuple[int, int, float]]:
    """Links good enough both ways, with their cost."""
    prr = {(node, link.id): link.prr for node, links in neighbours.items() for link in links}
    for (node, other), there in prr.items():
        back = prr.get((other, node), 0.0)
        if min(there, back) >= parameters.minimum_prr:
            yield node, other, 1.0 if parameters.metric == "hop" else 1.0 / (there * back)
