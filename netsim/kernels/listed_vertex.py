"""A vertex of data association whose joint states are listed: a target's choices, or the associations of several sensors.

A message depends only on the part of the states that its receiver has in common with the sender: *classes* of states that a
neighbour cannot tell apart. Edge potentials are products over a few coordinates of a class, and act on a message coordinate
by coordinate, so that no table over pairs of classes is needed.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from netsim.kernels.injections import IntArray
from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, reduce
from netsim.kernels.vertex import Choice, Incoming, Weights, choice_from, gather, leave_one_out_sums

Pair = tuple[int, int]
"""A sensor and a target it covers; the value of its variable is 0 for missed, a for the sensor's measurement a - 1."""


@dataclass(frozen=True, eq=False)
class Classes:
    """The values that some coordinates can take together.

    Attributes:
        grid: How many values each coordinate has.
        cells: Place of each possible tuple of values in the flattened grid, ascending: the order of message entries.
    """

    grid: tuple[int, ...]
    cells: IntArray

    def of(self, values: IntArray) -> IntArray:
        """The class of each row of values, shape (n,)."""
        flat = np.ravel_multi_index(tuple(values.T), self.grid) if self.grid else np.zeros(len(values), np.int64)
        return np.asarray(np.searchsorted(self.cells, flat))


@dataclass(frozen=True, eq=False)
class ClassEdge:
    """The edge to one neighbour.

    Attributes:
        here: Classes of this vertex's states as the neighbour tells them apart.
        there: Classes of the neighbour's states.
        tables: For each coordinate its log potential, shape (values here, values there).
        is_constraint: Whether the potential is 0 or -inf only: a power leaves it as it is.
        state_class: Class of each state of this vertex.
        multiplicity: For each class there, how many states of the neighbour it stands for, up to a common factor, which
            no normalised message depends on.
    """

    here: Classes
    there: Classes
    tables: tuple[FloatArray, ...]
    is_constraint: bool
    state_class: IntArray
    multiplicity: FloatArray

    def carry(self, classes: FloatArray, semiring: Semiring, exponent: float = 1.0) -> FloatArray:
        """From log weights of the classes here to those of the classes there, the potential to a power."""
        grid = np.full(int(np.prod(self.here.grid)), -np.inf)
        grid[self.here.cells] = classes
        table = grid.reshape(self.here.grid)
        for coordinate in self.tables:
            powered = coordinate if self.is_constraint or exponent == 1.0 else exponent * coordinate
            spread = powered.reshape(len(powered), *(1,) * (table.ndim - 1), -1)
            table = reduce(semiring, table[..., None] + spread, 0)
        return table.reshape(-1)[self.there.cells]

    def operations(self) -> int:
        """Two operations for each pair of a value here and one there, in each step."""
        here, there = self.here.grid, self.there.grid
        steps = range(len(here))
        return int(
            2 * sum(np.prod(here[step:], dtype=float) * np.prod(there[: step + 1], dtype=float) for step in steps)
        )


class ListedVertex:
    """See the module.

    Args:
        id: Its number in the model.
        scope: The (sensor, target) pairs that the vertex decides.
        states: The value of each pair in each state, shape (n, pairs).
        node: Log node potential of each state, shape (n,).
        edges: Edges by neighbour.
        sizes: For each pair, the number of the sensor's measurements + 1.
    """

    def __init__(
        self,
        id: int,
        scope: tuple[Pair, ...],
        states: IntArray,
        node: FloatArray,
        edges: Mapping[int, ClassEdge],
        sizes: tuple[int, ...],
    ) -> None:
        self.id = id
        self.neighbours = tuple(sorted(edges))
        self.scope = scope
        self.states = states
        self.node = node
        self._edges = [edges[neighbour] for neighbour in self.neighbours]
        self._groups = [_Grouping(edge.state_class, len(edge.here.cells)) for edge in self._edges]
        self._sizes = sizes

    def _place(self, neighbour: int) -> int:
        return self.neighbours.index(neighbour)

    def incoming_size(self, neighbour: int) -> int:
        """Classes of this vertex's states."""
        return len(self._edges[self._place(neighbour)].here.cells)

    def outgoing_size(self, neighbour: int) -> int:
        """Classes of the neighbour's states."""
        return len(self._edges[self._place(neighbour)].there.cells)

    def multiplicity(self, neighbour: int) -> FloatArray:
        """How many states of the neighbour each entry stands for, up to a common factor."""
        return self._edges[self._place(neighbour)].multiplicity

    def classes(self, neighbour: int) -> IntArray:
        """The class of each state, as a neighbour tells them apart: the index into messages from it, shape (n,)."""
        return self._edges[self._place(neighbour)].state_class

    def towards(self, neighbour: int, weights: FloatArray) -> FloatArray:
        """Log weights of this vertex's classes carried over the edge potential to the neighbour's, not normalised."""
        return self._edges[self._place(neighbour)].carry(weights, Semiring.MAX)

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """Eq (3) or (5) of Chen et al. 2006 to every neighbour."""
        rows = [row[edge.state_class] for row, edge in zip(gather(self, incoming), self._edges, strict=True)]
        sums = leave_one_out_sums(rows, self.node)
        return {
            neighbour: self._carried(place, total, semiring)
            for place, (neighbour, total) in enumerate(zip(self.neighbours, sums, strict=True))
        }

    def _carried(self, place: int, total: FloatArray, semiring: Semiring, exponent: float = 1.0) -> FloatArray:
        classes = self._groups[place].combine(total, semiring)
        return log_normalise(self._edges[place].carry(classes, semiring, exponent))

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Eq (4): the (max-)marginal of every state."""
        rows = [row[edge.state_class] for row, edge in zip(gather(self, incoming), self._edges, strict=True)]
        return log_normalise(sum(rows, self.node))

    def claims(self, incoming: Incoming, semiring: Semiring) -> dict[Pair, FloatArray]:
        """For each pair the (max-)marginal of its value, as probabilities that sum to one; shape (measurements + 1,)."""
        belief = self.belief(incoming, semiring)
        found = {}
        for pair, values, size in zip(self.scope, self.states.T, self._sizes, strict=True):
            rows = [reduce(semiring, np.append(belief[values == value], -np.inf)) for value in range(size)]
            found[pair] = np.exp(log_normalise(np.array(rows, dtype=float)))
        return found

    def claims_of_state(self, state: int) -> dict[Pair, FloatArray]:
        """What one state says of each pair, in the form of `claims`: all weight on the value that the pair has in it."""
        return {
            pair: np.eye(size)[value]
            for pair, value, size in zip(self.scope, self.states[state], self._sizes, strict=True)
        }

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """See `netsim.kernels.vertex.ReweightableVertex`."""
        return self._carried(self._place(neighbour), self._weighed(weights), Semiring.MAX, exponent)

    def choice(self, weights: Weights) -> Choice:
        """The best state, as its number in the list."""
        return choice_from(self._weighed(weights))

    def _weighed(self, weights: Weights) -> FloatArray:
        total = self.node
        for other, edge in zip(self.neighbours, self._edges, strict=True):
            if other in weights:
                total = total + weights[other][edge.state_class]
        return total

    def operations(self) -> int:
        """Four passes over the states for each neighbour, and the edge potentials."""
        return 4 * len(self.node) * len(self.neighbours) + sum(edge.operations() for edge in self._edges)


class _Grouping:
    """Combines the log weights of states by class; a class without a state gets -inf."""

    def __init__(self, state_class: IntArray, classes: int) -> None:
        self._order = np.argsort(state_class, kind="stable")
        self._present, self._starts = np.unique(state_class[self._order], return_index=True)
        self._classes = classes

    def combine(self, weights: FloatArray, semiring: Semiring) -> FloatArray:
        ordered = weights[self._order]
        found = np.full(self._classes, -np.inf)
        peak = np.maximum.reduceat(ordered, self._starts)
        if semiring is Semiring.SUM:
            lengths = np.diff(np.append(self._starts, len(ordered)))
            safe = np.where(np.isfinite(peak), peak, 0.0)
            summed = np.add.reduceat(np.exp(ordered - np.repeat(safe, lengths)), self._starts)
            with np.errstate(divide="ignore"):
                peak = safe + np.log(summed)
        found[self._present] = peak
        return found
