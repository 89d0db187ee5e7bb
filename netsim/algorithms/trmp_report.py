"""What a node records of distributed tree-reweighted max-product: states, what was proved, and what it took.

A verdict is recorded when it is known, not when the node is through: a node may die before that.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from netsim.algorithms.trmp_messages import Abandon, Entry, Go, Next, TreeMessage, Verdict, Vote, Wave
from netsim.algorithms.trmp_vertex import HostedVertex
from netsim.api import NodeHandle
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.listed_vertex import ListedVertex
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.trace.events import AlgorithmRecord, Association, GraphMessages, Marginals

PHASES: Mapping[type[Any], str] = {
    Wave: "trees",
    Next: "trees",
    Go: "trees",
    TreeMessage: "inference",
    Vote: "agreement",
    Verdict: "agreement",
    Abandon: "agreement",
}
"""To which phase a graph message belongs."""


class Report:
    """A node's records.

    Args:
        node: The node.
        hosts: Node of each vertex that it hosts or exchanges messages with.
        vertices: The vertices it hosts.
    """

    def __init__(self, node: NodeHandle, hosts: Mapping[int, int], vertices: Mapping[int, HostedVertex]) -> None:
        self._node = node
        self._hosts = hosts
        self._vertices = vertices
        self._counts: Counter[str] = Counter()
        self._told: set[int] = set()

    def begun(self) -> None:
        """The node begins, perhaps anew: of what it proved in an earlier life it knows nothing any more."""
        self._note("trmp_begun", {"vertices": sorted(self._vertices)})

    def verdicts(self) -> None:
        """Record each vertex that has heard its last verdict, once: what it is, and the vertex's state."""
        for number, hosted in sorted(self._vertices.items()):
            inference = hosted.inference
            if number in self._told or inference is None or inference.verdict is None:
                continue
            self._told.add(number)
            fields = {
                "proved": inference.verdict.proved,
                "iterations": inference.iteration,
                "trees": len(hosted.builder.places),
            }
            self._note("trmp_verdict", {"vertex": number, **fields})
            if inference.is_root:
                self._note("trmp_component", {"root": number, "vertices": hosted.builder.component_size, **fields})
            self._state(number, hosted)

    def end(self) -> None:
        """Record the states of vertices without a verdict, the trees, and how many graph messages were sent."""
        for number, hosted in sorted(self._vertices.items()):
            if number not in self._told:
                fields = {"has_trees": hosted.inference is not None, "is_abandoned": hosted.is_abandoned}
                self._note("trmp_unfinished", {"vertex": number, **fields})
                self._state(number, hosted)
        for number, hosted in sorted(self._vertices.items()):
            parents = [place.parent for place in hosted.builder.places]
            self._note("trmp_parents", {"vertex": number, "parents": parents})
        self._note("trmp_messages", {phase: self._counts[phase] for phase in sorted(set(PHASES.values()))})

    def messages(self, entries: Iterable[Entry]) -> None:
        """Record graph messages by iteration, those of inference apart; 0 is the growing of trees."""
        parts: dict[tuple[int, bool], list[Entry]] = {}
        for entry in entries:
            body, phase = entry.body, PHASES.get(type(entry.body))
            if phase is None:
                continue  # what sensors are told
            self._counts[phase] += 1
            number = body.iteration if isinstance(body, TreeMessage | Vote | Verdict) else 0
            parts.setdefault((number, phase == "inference"), []).append(entry)
        for (number, is_inference), together in sorted(parts.items()):
            self._sent(number, together, is_inference=is_inference)

    def _sent(self, number: int, entries: list[Entry], *, is_inference: bool) -> None:
        self._node.record(
            GraphMessages(
                node=self._node.id,
                round=number,
                source=[entry.source for entry in entries],
                destination=[entry.destination for entry in entries],
                remote=[int(self._hosts[entry.destination] != self._node.id) for entry in entries],
                computed=len(entries) if is_inference else 0,
                largest_change=1.0,  # every message is needed
                is_synchronous=0,
                late_ns=0,
            )
        )

    def _state(self, number: int, hosted: HostedVertex) -> None:
        vertex, inference = hosted.vertex, hosted.inference
        iteration = 0 if inference is None else inference.iteration
        if isinstance(vertex, SensorVertex):
            state = vertex.choice({}).state if inference is None else inference.choice.state
            self._node.record(Association(self._node.id, list(state), iteration))
        elif not isinstance(vertex, FactorVertex | ListedVertex):
            weights = {} if inference is None else inference.weights
            marginal = vertex.belief(weights, Semiring.MAX)
            self._node.record(Marginals(self._node.id, number, np.exp(marginal), iteration, 1))

    def _note(self, kind: str, fields: Mapping[str, object]) -> None:
        self._node.record(AlgorithmRecord(self._node.id, kind, json.dumps(fields)))
