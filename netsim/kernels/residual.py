"""Residual scheduling in one place: always the message next that would change most.

Elidan, McGraw, Koller, "Residual belief propagation: informed scheduling for asynchronous message passing", UAI 2006. The
residual of an edge is the divergence (Chen et al. 2006, eq 19) of the message that would be sent now from the one that was
sent last; at the start all have sent the uniform message. A vector of messages that no residual changes is a fixed point of
the synchronous update, and the other way round: the schedule alters the way there and its length.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from netsim.kernels.communication import divergence, normalise_over_states
from netsim.kernels.semiring import FloatArray, Semiring, uniform
from netsim.kernels.vertex import Vertex

Edge = tuple[int, int]


@dataclass(frozen=True, slots=True)
class ResidualResult:
    """Outcome of message passing by residuals.

    Attributes:
        incoming: For each vertex the last message it received from each neighbour; missing where none was worth sending.
        beliefs: For each vertex its belief, log domain.
        order: The directed edges in the order in which they sent.
        converged: Whether no residual was above the threshold in the end.
    """

    incoming: Mapping[int, Mapping[int, FloatArray]]
    beliefs: Mapping[int, FloatArray]
    order: tuple[Edge, ...]
    converged: bool


class _Residuals:
    """All edges with the message each would send and how far it is from the last one sent."""

    def __init__(self, vertices: Mapping[int, Vertex], semiring: Semiring) -> None:
        self._vertices, self._semiring = vertices, semiring
        self._multiplicity = {(s, t): v.multiplicity(t) for s, v in vertices.items() for t in v.neighbours}
        self._last = {edge: uniform(len(count)) for edge, count in self._multiplicity.items()}
        self._next: dict[Edge, FloatArray] = {}
        self._residual: dict[Edge, float] = {}
        self._queue: list[tuple[float, Edge]] = []
        for vertex in vertices:
            self.recompute(vertex, {})

    def recompute(self, source: int, incoming: Mapping[int, FloatArray]) -> None:
        """Compute what a vertex would send now."""
        vertex = self._vertices[source]
        for destination, message in vertex.outgoing(incoming, self._semiring).items() if vertex.neighbours else ():
            edge = source, destination
            self._next[edge] = message
            self._residual[edge] = self._distance(edge)
            heappush(self._queue, (-self._residual[edge], edge))

    def _distance(self, edge: Edge) -> float:
        count = self._multiplicity[edge]
        new, old = (normalise_over_states(each, np.log(count)) for each in (self._next[edge], self._last[edge]))
        return divergence(new, old, count, "e")

    @property
    def largest(self) -> float:
        """The largest residual of all."""
        return max(self._residual.values(), default=0.0)

    def pop(self, settled: float) -> tuple[Edge, FloatArray] | None:
        """The edge with the largest residual, of equals the first, and its message; None when all are settled."""
        while self._queue:
            negative, edge = heappop(self._queue)
            if -negative != self._residual[edge]:
                continue  # an entry that a later one has replaced
            if -negative <= settled:
                return None
            self._last[edge], self._residual[edge] = self._next[edge], 0.0
            return edge, self._next[edge]
        return None


def run_residual(
    vertices: Iterable[Vertex], semiring: Semiring, messages: int, *, settled: float = 1e-12
) -> ResidualResult:
    """Send one message after another, always the one with the largest residual.

    Args:
        vertices: All vertices of the model.
        semiring: Max-product or sum-product.
        messages: Most messages sent.
        settled: Largest residual that counts as no change, in nats.

    Raises:
        ScenarioError: When the model contradicts itself.
    """
    known = {vertex.id: vertex for vertex in sorted(vertices, key=lambda vertex: vertex.id)}
    incoming: dict[int, dict[int, FloatArray]] = {vertex: {} for vertex in known}
    residuals = _Residuals(known, semiring)
    order: list[Edge] = []
    while len(order) < messages and (best := residuals.pop(settled)) is not None:
        (source, destination), message = best
        incoming[destination][source] = message
        order.append((source, destination))
        residuals.recompute(destination, incoming[destination])
    beliefs = {vertex: each.belief(incoming[vertex], semiring) for vertex, each in known.items()}
    return ResidualResult(incoming, beliefs, tuple(order), residuals.largest <= settled)
