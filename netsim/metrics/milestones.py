"""When a network stops being one, from the days its nodes last: first death, partition, first loss of accuracy.

Dietrich and Dressler, "On the lifetime of wireless sensor networks", ACM Transactions on Sensor Networks 5 (2009) no 1:
lifetime by the number of living nodes, and by connectivity. The links are those of the start, and a dead node takes its own
away; everything else stays as it was. This is an extrapolation, nothing is simulated.
"""

import heapq
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

Links = Iterable[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Milestones:
    """Days until things go wrong; None for what never happens.

    Attributes:
        first_dead_days: Until the first node is dead.
        partition_days: Until the network falls apart: the first day from which on those of its nodes that live are not all
            connected with each other by links between living nodes, or fewer than two live.
        accuracy_days: Until a needed node is dead or cut off: from every living sink, or, where there is no sink, from
            another needed node.
    """

    first_dead_days: float | None
    partition_days: float | None
    accuracy_days: float | None


def milestones(
    days_by_node: Mapping[int, float], links: Links, needed_nodes: Collection[int], sinks: Collection[int]
) -> Milestones:
    """When a network stops being one.

    The network is what is connected with a sink at the start, where there are several separate ones each for itself;
    without sinks it is the largest component, of equals the one with the lowest id. Nodes outside count for the first
    death only.

    Args:
        days_by_node: How long each node lasts; infinity for one that does not die.
        links: Pairs of nodes that hear each other; the direction does not matter.
        needed_nodes: Nodes without which the answer is not what it was.
        sinks: Where answers are wanted.
    """
    neighbours = _neighbours(days_by_node, links)
    networks = _networks(neighbours, sinks)
    apart = [_partition_days(network, days_by_node, neighbours) for network in networks]
    members = set().union(*networks)
    needed = sorted(members.intersection(needed_nodes))
    centres = sorted(members.intersection(sinks)) or needed[:1]
    lasts = _connected_days(centres, days_by_node, neighbours)
    return Milestones(
        _or_never(min(days_by_node.values(), default=math.inf)),
        _or_never(min(apart, default=math.inf)),
        _or_never(min((lasts[node] for node in needed), default=math.inf)),
    )


def _or_never(days: float) -> float | None:
    return days if days < math.inf else None


def _neighbours(nodes: Iterable[int], links: Links) -> dict[int, set[int]]:
    neighbours: dict[int, set[int]] = {node: set() for node in nodes}
    for one, other in links:
        neighbours[one].add(other)
        neighbours[other].add(one)
    return neighbours


def _networks(neighbours: Mapping[int, set[int]], sinks: Collection[int]) -> list[set[int]]:
    components: list[set[int]] = []
    seen: set[int] = set()
    for node in sorted(neighbours):
        if node not in seen:
            components.append(_component(node, neighbours))
            seen |= components[-1]
    if sinks:
        return [component for component in components if not component.isdisjoint(sinks)]
    return [max(components, key=len)] if components else []  # of equals the first, which has the lowest id


def _component(start: int, neighbours: Mapping[int, set[int]]) -> set[int]:
    found, ahead = {start}, [start]
    while ahead:
        new = neighbours[ahead.pop()] - found
        found |= new
        ahead += new
    return found


def _partition_days(
    network: Collection[int], days_by_node: Mapping[int, float], neighbours: Mapping[int, set[int]]
) -> float:
    """First day from which on the living are not one network of at least two; infinity if never, or if they never were.

    From the end backwards: nodes come to life in descending order of their days, and components only ever merge.
    """
    if len(network) < 2:
        return math.inf
    by_days = sorted(network, key=lambda node: -days_by_node[node])
    forest = _Forest()
    first = math.inf
    for days, group in groupby(by_days, key=days_by_node.__getitem__):
        if days < math.inf and (forest.trees != 1 or forest.size < 2):
            first = days  # those that outlive this day are not one network
        for node in group:
            forest.add(node, neighbours[node])
    return first


def _connected_days(
    centres: Sequence[int], days_by_node: Mapping[int, float], neighbours: Mapping[int, set[int]]
) -> dict[int, float]:
    """How long each node is alive and connected with a living centre: the longest-lived path, as long as its weakest node.

    Dijkstra's algorithm with the minimum in place of the sum (the widest path).
    """
    lasts = dict.fromkeys(days_by_node, -math.inf)
    ahead = [(-days_by_node[centre], centre) for centre in centres]
    heapq.heapify(ahead)
    while ahead:
        minus_days, node = heapq.heappop(ahead)
        if lasts[node] > -math.inf:
            continue
        lasts[node] = -minus_days
        for other in neighbours[node]:
            if lasts[other] == -math.inf:
                heapq.heappush(ahead, (max(minus_days, -days_by_node[other]), other))
    return lasts


class _Forest:
    """Components of a graph that grows node by node (union-find)."""

    def __init__(self) -> None:
        self._parent: dict[int, int] = {}
        self.trees = 0

    @property
    def size(self) -> int:
        return len(self._parent)

    def add(self, node: int, neighbours: Iterable[int]) -> None:
        """Add a node with its links to those that are already there."""
        self._parent[node] = node
        self.trees += 1
        for other in neighbours:
            if other in self._parent:
                one, two = self._root(node), self._root(other)
                self.trees -= one != two
                self._parent[one] = two

    def _root(self, node: int) -> int:
        while (parent := self._parent[node]) != node:
            self._parent[node] = self._parent[parent]
            node = parent
        return node
