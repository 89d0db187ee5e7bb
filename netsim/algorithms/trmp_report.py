"""What a node records when distributed tree-reweighted max-product is over: states, what was proved, and what it took."""

import json
from collections.abc import Mapping

import numpy as np

from netsim.algorithms.trmp_messages import Go, Next, TreeMessage, Verdict, Vote, Wave
from netsim.algorithms.trmp_vertex import HostedVertex
from netsim.api import NodeHandle
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.listed_vertex import ListedVertex
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.trace.events import AlgorithmRecord, Association, Marginals

PHASES = {Wave: "trees", Next: "trees", Go: "trees", TreeMessage: "inference", Vote: "agreement", Verdict: "agreement"}
"""To which phase a graph message belongs."""


def record_outcome(node: NodeHandle, vertices: Mapping[int, HostedVertex], counts: Mapping[str, int]) -> None:
    """Record decisions, what was proved and what it took.

    Args:
        node: The node.
        vertices: The vertices it hosts.
        counts: How many graph messages they sent, by phase.
    """
    for vertex_id, hosted in sorted(vertices.items()):
        _record_end(node, hosted)
        _record_state(node, vertex_id, hosted)
    for vertex_id, hosted in sorted(vertices.items()):
        parents = [place.parent for place in hosted.builder.places]
        _note(node, "trmp_parents", {"vertex": vertex_id, "parents": parents})
    _note(node, "trmp_messages", {phase: counts.get(phase, 0) for phase in sorted(set(PHASES.values()))})


def _record_end(node: NodeHandle, hosted: HostedVertex) -> None:
    inference, vertex = hosted.inference, hosted.vertex.id
    if inference is None or not hosted.is_finished:
        _note(node, "trmp_unfinished", {"vertex": vertex, "has_trees": inference is not None})
    elif inference.is_root and inference.verdict is not None:
        fields = {
            "root": vertex,
            "vertices": hosted.builder.component_size,
            "trees": len(hosted.builder.places),
            "iterations": inference.iteration,
            "proved": inference.verdict.proved,
        }
        _note(node, "trmp_component", fields)


def _record_state(node: NodeHandle, vertex_id: int, hosted: HostedVertex) -> None:
    vertex, inference = hosted.vertex, hosted.inference
    state = vertex.choice({}).state if inference is None else inference.choice.state
    number = 0 if inference is None else inference.iteration
    if isinstance(vertex, SensorVertex):
        node.record(Association(node.id, list(state), number))
    elif not isinstance(vertex, FactorVertex | ListedVertex):
        weights = {} if inference is None else inference.weights
        marginal = vertex.belief(weights, Semiring.MAX)
        node.record(Marginals(node.id, vertex_id, np.exp(marginal), number, 1))


def _note(node: NodeHandle, kind: str, fields: Mapping[str, object]) -> None:
    node.record(AlgorithmRecord(node.id, kind, json.dumps(fields)))
