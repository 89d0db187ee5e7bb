"""Where the variables of a graphical model live, and how far that is apart on the radio."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from netsim.metrics.reach import Reach
from netsim.trace.events import LinkTable, VariablePlacement
from netsim.trace.recorder import Handler


class PlacementCost:
    """Hops between the hosts of neighbouring variables over the links of the start, and how full the hosts are."""

    def __init__(self) -> None:
        self._reach = Reach()
        self._hosts: dict[int, int] = {}
        self._edges: list[tuple[int, int]] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {LinkTable: self._reach.handlers()[LinkTable], VariablePlacement: self._on_placement}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty without a graphical model."""
        if not self._hosts:
            return {}
        pairs = Counter((self._hosts[one], self._hosts[other]) for one, other in self._edges)
        hops = hops_between(list(pairs), self._reach.links)
        reached = {pair: count for pair, count in pairs.items() if hops[pair] is not None}
        total = sum((hops[pair] or 0) * count for pair, count in reached.items())
        return {
            "hosted_variables_max": max(Counter(self._hosts.values()).values()),
            "placement_edges_over_air": sum(count for (one, other), count in pairs.items() if one != other),
            "placement_hops_mean": total / sum(reached.values()) if reached else None,
            "placement_edges_stranded": len(self._edges) - sum(reached.values()),
        }

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._hosts = dict(zip(map(int, event.variable), map(int, event.host), strict=True))
        self._edges = list(zip(map(int, event.edge_a), map(int, event.edge_b), strict=True))


def hops_between(
    pairs: Sequence[tuple[int, int]], links: Sequence[tuple[int, int]]
) -> dict[tuple[int, int], int | None]:
    """Fewest hops between pairs of nodes over links that go both ways; None where there is no way.

    The time for a pair is that of searching the nodes as near as its farther one: little where hosts are close.
    """
    neighbours: dict[int, set[int]] = {}
    for one, other in links:
        neighbours.setdefault(one, set()).add(other)
        neighbours.setdefault(other, set()).add(one)
    return {pair: _hops(*pair, neighbours) for pair in pairs}


def _hops(start: int, end: int, neighbours: Mapping[int, set[int]]) -> int | None:
    """Breadth first from the start until the end comes up."""
    seen, border, hops = {start}, {start}, 0
    while border:
        if end in border:
            return hops
        border = {near for node in border for near in neighbours.get(node, ())} - seen
        seen |= border
        hops += 1
    return None
