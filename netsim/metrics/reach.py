"""The network as it is at the start: who hears whom, who hosts what, where the nodes are."""

from collections.abc import Mapping
from typing import Any, Final

from netsim.trace.events import LinkTable, NodeTable, VariablePlacement
from netsim.trace.recorder import Handler

USABLE_PRR: Final = 0.5
"""Packet reception ratio from which on a link counts: half of its frames arrive, so it takes two transmissions a hop."""


class Reach:
    """Notes what is said at the start of a run; all ids are node ids.

    Attributes:
        links: Pairs (lower id, higher id) of nodes that hear each other, a reception ratio of `USABLE_PRR` or more in both
            directions, ascending.
        hosts: Nodes that host a variable of the problem's graphical model.
        sinks: Nodes of the role `sink`.
        positions_m: Where each node is at the start.
        names: Name of each node.
    """

    def __init__(self) -> None:
        self.links: tuple[tuple[int, int], ...] = ()
        self.hosts: frozenset[int] = frozenset()
        self.sinks: frozenset[int] = frozenset()
        self.positions_m: dict[int, tuple[float, float]] = {}
        self.names: dict[int, str] = {}

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {NodeTable: self._on_nodes, LinkTable: self._on_links, VariablePlacement: self._on_placement}

    def _on_nodes(self, event: NodeTable, _: int) -> None:
        nodes = [int(node) for node in event.node]
        self.names = dict(zip(nodes, event.name, strict=True))
        self.sinks = frozenset(node for node, role in zip(nodes, event.role, strict=True) if role == "sink")
        places_m = zip(map(float, event.x_m), map(float, event.y_m), strict=True)
        self.positions_m = dict(zip(nodes, places_m, strict=True))

    def _on_links(self, event: LinkTable, _: int) -> None:
        rows = zip(map(int, event.source), map(int, event.destination), map(float, event.prr), strict=True)
        usable = {(source, destination) for source, destination, prr in rows if prr >= USABLE_PRR}
        self.links = tuple(sorted(pair for pair in usable if pair[0] < pair[1] and pair[::-1] in usable))

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self.hosts = frozenset(map(int, event.host))
