"""What tree-reweighted max-product proved, and what its phases cost in graph messages."""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any

from netsim.trace.events import AlgorithmRecord, VariablePlacement
from netsim.trace.recorder import Handler


class Optimality:
    """Reads the records of `netsim.algorithms.trmp`; no figures for other algorithms."""

    def __init__(self) -> None:
        self._components: list[Mapping[str, Any]] = []
        self._unfinished = 0
        self._phases: Counter[str] = Counter()
        self._hosts: set[int] = set()

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {AlgorithmRecord: self._on_record, VariablePlacement: self._on_placement}

    def figures(self) -> dict[str, Any]:
        """The metrics."""
        if not self._phases and not self._components:
            return {}
        proved = [part for part in self._components if part["proved"]]
        vertices = sum(part["vertices"] for part in self._components) + self._unfinished
        return {
            "map_proved": int(len(proved) == len(self._components) and not self._unfinished),
            "map_proved_share": sum(part["vertices"] for part in proved) / vertices if vertices else None,
            "trmp_iterations": max((part["iterations"] for part in self._components), default=None),
            "trmp_trees": max((part["trees"] for part in self._components), default=None),
            "trmp_vertices_unfinished": self._unfinished,
            "trmp_messages_by_phase_per_sensor": {
                phase: count / len(self._hosts) for phase, count in sorted(self._phases.items())
            },
        }

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._hosts = set(map(int, event.host))

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == "trmp_component":
            self._components.append(json.loads(event.fields_json))
        elif event.kind == "trmp_unfinished":
            self._unfinished += 1
        elif event.kind == "trmp_messages":
            self._phases.update(json.loads(event.fields_json))
