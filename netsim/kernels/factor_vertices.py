"""The two kinds of vertices of a factor graph: variables and factors of any arity."""

from collections.abc import Sequence

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, reduce
from netsim.kernels.vertex import (
    Choice,
    Incoming,
    Weights,
    along,
    choice_from,
    gather,
    leave_one_out_sums,
    table_belief,
    table_messages,
)


class VariableVertex:
    """A variable: passes on the product of what its other factors say.

    Args:
        id: Its number in the model.
        states: How many values it can take.
        factors: Vertex ids of the factors it occurs in.
    """

    def __init__(self, id: int, states: int, factors: Sequence[int]) -> None:
        self.id = id
        self.neighbours = tuple(sorted(factors))
        self._states = states

    def incoming_size(self, neighbour: int) -> int:
        """Number of states."""
        return self._states

    def outgoing_size(self, neighbour: int) -> int:
        """Number of states."""
        return self._states

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """To each factor the product of the messages of the others."""
        sums = leave_one_out_sums(gather(self, incoming), np.zeros(self._states))
        return {neighbour: log_normalise(total) for neighbour, total in zip(self.neighbours, sums, strict=True)}

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Product of all messages."""
        return log_normalise(sum(gather(self, incoming), np.zeros(self._states)))

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """See `netsim.kernels.vertex.ReweightableVertex`; the edge is a constraint, so the exponent does not matter."""
        return log_normalise(self._weighed(weights))

    def choice(self, weights: Weights) -> Choice:
        """The best state of the variable."""
        return choice_from(self._weighed(weights))

    def _weighed(self, weights: Weights) -> FloatArray:
        return np.asarray(
            sum((weights[other] for other in self.neighbours if other in weights), np.zeros(self._states))
        )

    def multiplicity(self, neighbour: int) -> FloatArray:
        """Ones: what a factor receives is indexed by the states of the variable."""
        return np.ones(self._states)

    def shares_states(self, neighbour: int) -> bool:
        """Yes: messages both ways are indexed by the states of the variable."""
        return True

    def operations(self) -> int:
        """Four passes over the incoming messages."""
        return 4 * self._states * len(self.neighbours)


class FactorVertex:
    """A factor: for each of its variables the reduction over the others of its table times their messages.

    Args:
        id: Its number in the model.
        scope: Vertex ids of its variables in the order of the table's axes, each once.
        table: Log potential.
    """

    def __init__(self, id: int, scope: Sequence[int], table: FloatArray) -> None:
        self.id = id
        order = np.argsort(scope)
        self.neighbours = tuple(sorted(scope))
        self._table = np.array(np.transpose(table, order), order="C")

    def incoming_size(self, neighbour: int) -> int:
        """States of that variable."""
        return int(self._table.shape[self.neighbours.index(neighbour)])

    def outgoing_size(self, neighbour: int) -> int:
        """States of that variable."""
        return self.incoming_size(neighbour)

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """To each variable what table and other variables say about it."""
        messages = table_messages(self._table, gather(self, incoming), semiring)
        return dict(zip(self.neighbours, messages, strict=True))

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Joint of the factor's variables, flattened with the last of the ascending ids fastest."""
        return table_belief(self._table, gather(self, incoming))

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """See `netsim.kernels.vertex.ReweightableVertex`; the edge is a constraint, so the exponent does not matter."""
        axis = self.neighbours.index(neighbour)
        others = tuple(other for other in range(self._table.ndim) if other != axis)
        return log_normalise(reduce(Semiring.MAX, self._weighed(weights), others))

    def choice(self, weights: Weights) -> Choice:
        """The best joint state of the factor's variables, in ascending order of their ids."""
        return choice_from(self._weighed(weights))

    def _weighed(self, weights: Weights) -> FloatArray:
        total = self._table
        for axis, other in enumerate(self.neighbours):
            if other in weights:
                total = total + along(weights[other], axis, total.ndim)
        return total

    def multiplicity(self, neighbour: int) -> FloatArray:
        """Ones: an entry is a state of the variable."""
        return np.ones(self.outgoing_size(neighbour))

    def shares_states(self, neighbour: int) -> bool:
        """Yes: messages both ways are indexed by the states of the variable."""
        return True

    def operations(self) -> int:
        """About four passes over the table for each variable."""
        return 4 * self._table.size * len(self.neighbours)
