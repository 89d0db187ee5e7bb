"""The association variable of a target that three or more sensors cover (Chen et al. 2006, eq 14)."""

from collections.abc import Mapping

from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.vertex import Incoming, gather, table_belief, table_messages


class TargetVertex:
    """The association variable of one target: which measurement of each covering sensor is its own.

    Args:
        id: Its number in the model.
        target: The target's number.
        table: Log evidence of each joint hypothesis, one axis for each covering sensor, shape (q_1 + 1, ...).
        multiplicities: For each covering sensor, how many of its associations give the target each of its measurements,
            shape (q + 1,). The keys in ascending order are the axes.
    """

    def __init__(self, id: int, target: int, table: FloatArray, multiplicities: Mapping[int, FloatArray]) -> None:
        self.id = id
        self.target = target
        self.neighbours = tuple(sorted(multiplicities))
        self._table = table
        self._multiplicities = dict(multiplicities)

    def incoming_size(self, neighbour: int) -> int:
        """The sensor's measurements and "missed"."""
        return int(self._table.shape[self.neighbours.index(neighbour)])

    def outgoing_size(self, neighbour: int) -> int:
        """The sensor's measurements and "missed"."""
        return self.incoming_size(neighbour)

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """To each sensor what evidence and the other sensors say about its measurements of this target."""
        messages = table_messages(self._table, gather(self, incoming), semiring)
        return dict(zip(self.neighbours, messages, strict=True))

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Log (max-)marginal of the joint hypotheses, flattened with the last sensor fastest."""
        return table_belief(self._table, gather(self, incoming))

    def multiplicity(self, neighbour: int) -> FloatArray:
        """How many associations of that sensor agree with each entry."""
        return self._multiplicities[neighbour]

    def operations(self) -> int:
        """About four passes over the table for each sensor."""
        return 4 * self._table.size * len(self.neighbours)
