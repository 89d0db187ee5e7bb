"""What tree-reweighted max-product proved, and what its phases cost in graph messages."""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any

from netsim.trace.events import AlgorithmRecord, VariablePlacement
from netsim.trace.recorder import Handler


class Optimality:
    """Reads the records of `netsim.algorithms.trmp`; no figures for other algorithms.

    A vertex counts as proved if the last that was heard of it is such a verdict. One of a node that died without, or began
    anew after a crash, does not.
    """

    def __init__(self) -> None:
        self._verdicts: dict[int, Mapping[str, Any]] = {}
        self._begun: set[int] = set()
        self._phases: Counter[str] = Counter()
        self._variables: set[int] = set()
        self._hosts: set[int] = set()

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {AlgorithmRecord: self._on_record, VariablePlacement: self._on_placement}

    def figures(self) -> dict[str, Any]:
        """The metrics."""
        if not self._begun:
            return {}
        vertices = self._variables | self._begun
        proved = sum(verdict["proved"] for verdict in self._verdicts.values())
        return {
            "map_proved": int(proved == len(vertices)),
            "map_proved_share": proved / len(vertices),
            "trmp_iterations": max((verdict["iterations"] for verdict in self._verdicts.values()), default=None),
            "trmp_trees": max((verdict["trees"] for verdict in self._verdicts.values()), default=None),
            "trmp_vertices_unfinished": len(vertices) - len(self._verdicts),
            "trmp_messages_by_phase_per_sensor": {
                phase: count / len(self._hosts) for phase, count in sorted(self._phases.items())
            },
        }

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._variables = set(map(int, event.variable))
        self._hosts = set(map(int, event.host))

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == "trmp_begun":
            for vertex in json.loads(event.fields_json)["vertices"]:
                self._begun.add(vertex)
                self._verdicts.pop(vertex, None)
        elif event.kind == "trmp_verdict":
            verdict = json.loads(event.fields_json)
            self._verdicts[verdict["vertex"]] = verdict
        elif event.kind == "trmp_messages":
            self._phases.update(json.loads(event.fields_json))
