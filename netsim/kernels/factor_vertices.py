"""The two kinds of vertices of a factor graph: variables and factors of any arity."""

from collections.abc import Sequence

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, log_normalise
from netsim.kernels.vertex import Incoming, gather, leave_one_out_sums, table_belief, table_messages


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

    def multiplicity(self, neighbour: int) -> FloatArray:
        """Ones: an entry is a state of the variable."""
        return np.ones(self.outgoing_size(neighbour))

    def shares_states(self, neighbour: int) -> bool:
        """Yes: messages both ways are indexed by the states of the variable."""
        return True

    def operations(self) -> int:
        """About four passes over the table for each variable."""
        return 4 * self._table.size * len(self.neighbours)
