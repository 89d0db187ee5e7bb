"""A variable of a pairwise Markov random field (Chen et al. 2006, eqs 2-5)."""

from collections.abc import Mapping

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, reduce
from netsim.kernels.vertex import Choice, Incoming, Weights, choice_from, gather, leave_one_out_sums


class PairwiseVertex:
    """A variable with a node potential and one edge potential per neighbour.

    Args:
        id: Its number in the model.
        node: Log node potential, shape (states,).
        edges: Log edge potential per neighbour, shape (states here, states there).
    """

    def __init__(self, id: int, node: FloatArray, edges: Mapping[int, FloatArray]) -> None:
        self.id = id
        self.neighbours = tuple(sorted(edges))
        self._node = node
        self._edges = [edges[neighbour] for neighbour in self.neighbours]

    def incoming_size(self, neighbour: int) -> int:
        """States of this variable, whoever the neighbour."""
        return len(self._node)

    def outgoing_size(self, neighbour: int) -> int:
        """States of the neighbour."""
        return int(self._edges[self.neighbours.index(neighbour)].shape[1])

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """Eq (3) or (5) to every neighbour."""
        sums = leave_one_out_sums(gather(self, incoming), self._node)
        return {
            neighbour: log_normalise(reduce(semiring, edge + total[:, None], 0))
            for neighbour, edge, total in zip(self.neighbours, self._edges, sums, strict=True)
        }

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Eq (4): node potential times all messages."""
        return log_normalise(sum(gather(self, incoming), self._node))

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """See `netsim.kernels.vertex.ReweightableVertex`."""
        edge = self._edges[self.neighbours.index(neighbour)]
        return log_normalise(reduce(Semiring.MAX, exponent * edge + self._weighed(weights)[:, None], 0))

    def choice(self, weights: Weights) -> Choice:
        """The best state of the variable."""
        return choice_from(self._weighed(weights))

    def _weighed(self, weights: Weights) -> FloatArray:
        return np.asarray(sum((weights[other] for other in self.neighbours if other in weights), self._node))

    def multiplicity(self, neighbour: int) -> FloatArray:
        """Ones: an entry is a state of the neighbour."""
        return np.ones(self.outgoing_size(neighbour))

    def operations(self) -> int:
        """Three passes over the incoming messages and two over every edge potential."""
        return 3 * len(self._node) * len(self.neighbours) + 2 * sum(edge.size for edge in self._edges)
