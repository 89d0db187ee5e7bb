"""What a vertex of a graphical model is to message passing, and the arithmetic that its kinds share.

A vertex is a variable, a factor, a sensor's association or a target's. The central loop (`netsim.kernels.central`) and
the distributed algorithm call the same vertex objects, so that their results are equal bit for bit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, reduce, uniform

Incoming = Mapping[int, FloatArray]
"""Last message received from each neighbour; a neighbour that is missing has sent the uniform start message."""


class Vertex(Protocol):
    """One vertex of a graphical model with pairwise exchange of messages."""

    @property
    def id(self) -> int:
        """Number of the vertex, unique in its model."""
        ...

    @property
    def neighbours(self) -> tuple[int, ...]:
        """Vertices it exchanges messages with, ascending."""
        ...

    def incoming_size(self, neighbour: int) -> int:
        """Number of entries of a message from that neighbour."""
        ...

    def outgoing_size(self, neighbour: int) -> int:
        """Number of entries of a message to that neighbour."""
        ...

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """The message to every neighbour, each from what the others sent: log domain, normalised."""
        ...

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """The (max-)marginal of the vertex's own variable: log domain, normalised, one-dimensional."""
        ...

    def multiplicity(self, neighbour: int) -> FloatArray:
        """For each entry of the message to `neighbour`, how many states of that receiver it stands for."""
        ...

    def operations(self) -> int:
        """Rough number of elementary operations (a load, an addition, a comparison) of one call of `outgoing`."""
        ...


Weights = Mapping[int, FloatArray]
"""For each neighbour a log weight on the vertex's own states as that neighbour sees them, of `incoming_size`; missing: 0."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The best state of a vertex.

    Attributes:
        state: The state, in a form that two choices of the same vertex can be compared by.
        margin: Log score of the best state less that of the second best; infinite with one possible state, 0 for a tie.
    """

    state: tuple[int, ...]
    margin: float


class ReweightableVertex(Vertex, Protocol):
    """A vertex whose potentials can be rewritten edge by edge, as tree-reweighted max-product needs.

    Reparameterization only ever adds functions of what one neighbour sees of the state, so a vertex with more states than
    can be listed is rewritten as easily as a small one.
    """

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """The max-product message to one neighbour under other potentials.

        Args:
            neighbour: Who it is for.
            weights: Added to the node potential; that neighbour's own entry counts like the others.
            exponent: Power to which the edge potential towards `neighbour` is raised; a constraint stays as it is.

        Returns:
            Log message over what the neighbour receives (`outgoing_size`), normalised; -inf for what is impossible.
        """
        ...

    def choice(self, weights: Weights) -> Choice:
        """The best state of node potential plus weights, and how clearly it is the best."""
        ...


def margin_below(best: float, runner_up: float) -> float:
    """Margin of the best log score over the second best; infinite where there is no second."""
    return np.inf if runner_up == -np.inf else best - runner_up


def choice_from(scores: FloatArray) -> Choice:
    """The choice among listed states, by their log scores: the first of equals, its margin over the second best.

    Args:
        scores: Log scores of any shape; the state is the index in it.

    Raises:
        ScenarioError: When no state is possible.
    """
    flat = scores.ravel()
    log_normalise(flat)
    best = int(np.argmax(flat))
    runner_up = float(np.delete(flat, best).max(initial=-np.inf))
    state = np.unravel_index(best, scores.shape)
    return Choice(tuple(int(index) for index in state), margin_below(float(flat[best]), runner_up))


def gather(vertex: Vertex, incoming: Incoming) -> list[FloatArray]:
    """The message of every neighbour in ascending order, the uniform one where none has come."""
    return [
        incoming[neighbour] if neighbour in incoming else uniform(vertex.incoming_size(neighbour))
        for neighbour in vertex.neighbours
    ]


def leave_one_out_sums(rows: Sequence[FloatArray], start: FloatArray) -> list[FloatArray]:
    """For each row the sum of `start` and all other rows, without subtracting (-inf minus -inf has no value)."""
    before = [start]
    for row in rows:
        before.append(before[-1] + row)
    after = np.zeros_like(start)
    sums = []
    for prefix, row in zip(reversed(before[:-1]), reversed(rows), strict=True):
        sums.append(prefix + after)
        after = after + row
    return sums[::-1]


def along(message: FloatArray, axis: int, dimensions: int) -> FloatArray:
    """Reshape a vector so that it broadcasts along one axis of a table."""
    shape = [1] * dimensions
    shape[axis] = -1
    return message.reshape(shape)


def table_messages(table: FloatArray, messages: Sequence[FloatArray], semiring: Semiring) -> list[FloatArray]:
    """Messages of a factor: for each axis the reduction over all others of the table times their messages.

    Args:
        table: Log potential, one axis a neighbour.
        messages: Log message along each axis.
        semiring: How the states of the other axes are combined.
    """
    axes = range(table.ndim)
    spread = [along(message, axis, table.ndim) for axis, message in zip(axes, messages, strict=True)]
    sums = leave_one_out_sums([np.broadcast_to(row, table.shape) for row in spread], table)
    return [
        log_normalise(reduce(semiring, total, tuple(other for other in axes if other != axis)))
        for axis, total in zip(axes, sums, strict=True)
    ]


def table_belief(table: FloatArray, messages: Sequence[FloatArray]) -> FloatArray:
    """Log table times the messages along all its axes, flattened (last axis fastest) and normalised."""
    total = table
    for axis, message in enumerate(messages):
        total = total + along(message, axis, table.ndim)
    return log_normalise(total.ravel())
