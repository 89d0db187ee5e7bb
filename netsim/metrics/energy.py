"""Energy: joules in total, by device state, by message kind and by node, from the ledger."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

from netsim.trace.events import EnergyHarvest, EnergyLedger, NodeLife, NodeTable
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

STANDING = {
    "radio": frozenset({"listen", "sleep", "idle", "off", "dead"}),
    "cpu": frozenset({"sleep", "off", "dead"}),
    "sensor": frozenset({"off", "dead"}),
}
"""States of a device, by device, that go on by themselves while nothing is sent, received, computed or sensed."""


class Energy:
    """Sums up the ledger that the simulation writes at its end, and notes who died when."""

    def __init__(self) -> None:
        self._ledger: EnergyLedger | None = None
        self._names: dict[int, str] = {}
        self._on_batteries: set[int] = set()
        self._deaths: dict[int, int] = {}
        self._harvested_j = self._spilled_j = 0.0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            EnergyLedger: self._on_ledger,
            EnergyHarvest: self._on_harvest,
            NodeTable: self._on_nodes,
            NodeLife: self._on_life,
        }

    @property
    def ledger(self) -> EnergyLedger | None:
        """The ledger, once the run has ended."""
        return self._ledger

    def figures(self) -> dict[str, Any]:
        """The metrics; units in the keys."""
        rows = _rows(self._ledger)
        by_node = _sums((row[0], row[4]) for row in rows)
        most = max(by_node, key=lambda node: (by_node[node], -node), default=None)
        active = [row for row in rows if row[2] not in STANDING.get(row[1], ())]
        return {
            "energy_j": math.fsum(row[4] for row in rows),
            "energy_from_batteries_j": math.fsum(row[4] for row in rows if row[0] in self._on_batteries),
            "energy_beyond_listening_j": math.fsum(row[4] for row in active),
            "energy_beyond_listening_most_j": max(_sums((row[0], row[4]) for row in active).values(), default=None),
            "energy_by_device_j": _sums((row[1], row[4]) for row in rows),
            "energy_by_state_j": _sums((f"{device}.{state}", joules) for _, device, state, _, joules in rows),
            "energy_by_kind_j": _sums((kind or "(none)", joules) for _, _, _, kind, joules in rows),
            "energy_by_node_j": {self._names.get(node, str(node)): joules for node, joules in by_node.items()},
            "energy_most_node": None if most is None else self._names.get(most, str(most)),
            "energy_most_j": None if most is None else by_node[most],
            "energy_harvested_j": self._harvested_j,
            "energy_spilled_j": self._spilled_j,
            "deaths": len(self._deaths),
            "death_by_node_s": {
                self._names.get(node, str(node)): at_ns / NS_PER_S for node, at_ns in sorted(self._deaths.items())
            },
            "first_death_s": min(self._deaths.values()) / NS_PER_S if self._deaths else None,
        }

    def _on_ledger(self, event: EnergyLedger, _: int) -> None:
        self._ledger = event

    def _on_harvest(self, event: EnergyHarvest, _: int) -> None:
        self._harvested_j = math.fsum(map(float, event.offered_j))
        self._spilled_j = math.fsum(map(float, event.spilled_j))

    def _on_nodes(self, event: NodeTable, _: int) -> None:
        self._names = dict(zip(map(int, event.node), event.name, strict=True))
        full_j = zip(map(int, event.node), map(float, event.battery_j), strict=True)
        self._on_batteries = {node for node, joules in full_j if math.isfinite(joules)}

    def _on_life(self, event: NodeLife, now_ns: int) -> None:
        if event.event == "died":
            self._deaths[event.node] = now_ns


def _rows(ledger: EnergyLedger | None) -> list[tuple[int, str, str, str, float]]:
    if ledger is None:
        return []
    nodes, joules = map(int, ledger.node), map(float, ledger.energy_j)
    return list(zip(nodes, ledger.device, ledger.state, ledger.kind, joules, strict=True))


def _sums(pairs: Iterable[tuple[Any, float]]) -> dict[Any, float]:
    parts: defaultdict[Any, list[float]] = defaultdict(list)
    for key, joules in pairs:
        parts[key].append(joules)
    return {key: math.fsum(values) for key, values in sorted(parts.items())}
