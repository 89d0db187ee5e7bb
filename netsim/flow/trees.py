"""The spanning trees that distributed tree-reweighted max-product grew, from a trace.

Its components iterate at their own pace, so there are no rounds in which to show their messages; but within an iteration
every tree carries messages over all its edges, so the trees are where information flows (Chen, Wainwright, Cetin, Willsky
2006, section 2.3).
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.errors import TraceError
from netsim.flow.rounds import Edge
from netsim.trace.events import AlgorithmRecord, Event, NodeTable, TruthTargets, VariablePlacement
from netsim.trace.reader import read_trace, trace_metadata

PARENTS, COMPONENT = "trmp_parents", "trmp_component"
_TOPICS = {each.topic for each in (NodeTable, TruthTargets, VariablePlacement, AlgorithmRecord)}


@dataclass(frozen=True, slots=True)
class Forest:
    """One tree of each component that has so many.

    Attributes:
        number: From 1.
        parents: Parent of each vertex in it, None of a root.
        new: The edges that no tree before has, from child to parent.
    """

    number: int
    parents: Mapping[int, int | None]
    new: frozenset[Edge]

    @property
    def edges(self) -> frozenset[Edge]:
        """All edges, from child to parent."""
        return frozenset((child, parent) for child, parent in self.parents.items() if parent is not None)

    @property
    def roots(self) -> tuple[int, ...]:
        """Vertices without a parent in it, ascending; those without neighbours in the model too."""
        return tuple(sorted(vertex for vertex, parent in self.parents.items() if parent is None))

    @property
    def height(self) -> int:
        """Edges from a root to the vertex farthest from it."""
        return max((self._depth(vertex) for vertex in self.parents), default=0)

    def _depth(self, vertex: int) -> int:
        depth, parent = 0, self.parents[vertex]
        while parent is not None and depth < len(self.parents):
            depth, parent = depth + 1, self.parents.get(parent)
        return depth


@dataclass(frozen=True)
class SpanningTrees:
    """The trees of a run.

    Attributes:
        title: Name of the scenario and seed.
        nodes: Who takes part.
        model: The graphical model as it was placed.
        truth: True positions of targets at the start, if the trace has them.
        forests: The first tree of all components, their second, and so on.
        components: What each component's root recorded: `root`, `vertices`, `trees`, `iterations`, `proved`.
    """

    title: str
    nodes: NodeTable
    model: VariablePlacement
    truth: TruthTargets | None
    forests: tuple[Forest, ...]
    components: tuple[Mapping[str, Any], ...]


def load_trees(trace: Path) -> SpanningTrees | None:
    """Read the trees of a run; None where the trace tells of none.

    Raises:
        TraceError: If the trace cannot be read, or its trees have vertices that its model lacks.
    """
    first: dict[type, Event] = {}
    parents: dict[int, list[int | None]] = {}
    components: list[Mapping[str, Any]] = []
    for _, event in read_trace(trace, _TOPICS):
        if not isinstance(event, AlgorithmRecord):
            first.setdefault(type(event), event)
        elif event.kind == PARENTS:
            note = json.loads(event.fields_json)
            parents[note["vertex"]] = note["parents"]
        elif event.kind == COMPONENT:
            components.append(json.loads(event.fields_json))
    nodes, model, truth = first.get(NodeTable), first.get(VariablePlacement), first.get(TruthTargets)
    if not any(parents.values()) or not isinstance(nodes, NodeTable) or not isinstance(model, VariablePlacement):
        return None
    unknown = parents.keys() - set(map(int, model.variable))
    if unknown:
        message = (
            f"{trace}: expected trees of the {len(model.variable)} vertices of the model, got vertex {min(unknown)}"
        )
        raise TraceError(message)
    metadata = trace_metadata(trace)
    title = f"{metadata.get('scenario', trace.stem)}, seed {metadata.get('seed', '?')}"
    shown = truth if isinstance(truth, TruthTargets) else None
    return SpanningTrees(title, nodes, model, shown, forests_of(parents), tuple(components))


def forests_of(parents: Mapping[int, list[int | None]]) -> tuple[Forest, ...]:
    """The trees by number.

    Args:
        parents: For each vertex its parent in every tree of its component.
    """
    forests: list[Forest] = []
    covered: set[frozenset[int]] = set()
    for number in range(max(map(len, parents.values()), default=0)):
        here = {vertex: row[number] for vertex, row in sorted(parents.items()) if number < len(row)}
        edges = [(child, parent) for child, parent in here.items() if parent is not None]
        forests.append(Forest(number + 1, here, frozenset(edge for edge in edges if frozenset(edge) not in covered)))
        covered |= _undirected(edges)
    return tuple(forests)


def _undirected(edges: Iterable[Edge]) -> set[frozenset[int]]:
    return {frozenset(edge) for edge in edges}
