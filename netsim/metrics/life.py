"""What became of the nodes' algorithms, and when it was over."""

from collections.abc import Mapping
from typing import Any

from netsim.trace.events import EnergyLedger, NodeLife, NodeTable
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S


class Life:
    """Counts nodes by what ended their algorithm; one whose battery ran empty after that counts by the first.

    Of a node that crashed and came up again, its last life counts.
    """

    def __init__(self) -> None:
        self._nodes = 0
        self._ended: dict[int, str] = {}  # how each node's algorithm ended: the first that is said of it
        self._end_ns = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {NodeTable: self._on_nodes, NodeLife: self._on_life, EnergyLedger: self._on_end}

    def figures(self) -> dict[str, Any]:
        """The metrics; units in the keys."""
        ends = list(self._ended.values())
        return {
            "simulated_s": self._end_ns / NS_PER_S,
            "nodes": self._nodes,
            "nodes_finished": ends.count("finished"),
            "nodes_failed": ends.count("failed"),
            "nodes_died": ends.count("died"),
            "nodes_crashed": ends.count("crashed"),
        }

    def _on_nodes(self, event: NodeTable, _: int) -> None:
        self._nodes = len(event.node)

    def _on_life(self, event: NodeLife, _: int) -> None:
        if event.event == "rebooted":
            self._ended.pop(event.node, None)
        elif event.event != "started":
            self._ended.setdefault(event.node, event.event)

    def _on_end(self, _: EnergyLedger, now_ns: int) -> None:
        self._end_ns = now_ns
