"""A sensor's vertex in the sensor-subregion hybrid model (Chen et al. 2006, section 4.2, eqs 17 and 18).

Its state is how many detections it has in each subregion it covers. What it reads depends on their total alone, so that
its messages are a forward and a backward pass over partial totals: no listing of the n^k states.
"""

from collections.abc import Mapping

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, reduce
from netsim.kernels.vertex import Incoming, gather


class CountingVertex:
    """The detections of one sensor, subregion by subregion.

    A message from a subregion is over the sensor's detections there, one to a subregion over its number of targets.

    Args:
        id: Its number in the model.
        edges: For each subregion's vertex the log edge potential ln p(z | x), shape (detections, targets).
        log_reading: Log likelihood of the reading for a total of 0, 1, ... detections, up to the largest possible total.
    """

    def __init__(self, id: int, edges: Mapping[int, FloatArray], log_reading: FloatArray) -> None:
        self.id = id
        self.neighbours = tuple(sorted(edges))
        self._edges = [edges[neighbour] for neighbour in self.neighbours]
        self._log_reading = log_reading

    def incoming_size(self, neighbour: int) -> int:
        """How many numbers of detections in that subregion are possible."""
        return int(self._edges[self.neighbours.index(neighbour)].shape[0])

    def outgoing_size(self, neighbour: int) -> int:
        """How many numbers of targets in that subregion are possible."""
        return int(self._edges[self.neighbours.index(neighbour)].shape[1])

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """Eq (3) or (5) to every subregion: what the others leave of the reading, carried over the edge."""
        messages = gather(self, incoming)
        ahead = _likelihoods_ahead(messages, self._log_reading, semiring)
        behind = np.zeros(1)
        made = {}
        for neighbour, edge, message, likelihood in zip(self.neighbours, self._edges, messages, ahead, strict=True):
            detections = _correlate(behind, likelihood, len(message), semiring)
            made[neighbour] = log_normalise(reduce(semiring, edge + detections[:, None], 0))
            behind = convolve(behind, message, semiring)
        return made

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """The (max-)marginal of the total number of detections."""
        total = np.zeros(1)
        for message in gather(self, incoming):
            total = convolve(total, message, semiring)
        return log_normalise(total + self._log_reading)

    def multiplicity(self, neighbour: int) -> FloatArray:
        """Ones: an entry is a number of targets, which is the subregion's state."""
        return np.ones(self.outgoing_size(neighbour))

    def operations(self) -> int:
        """Three passes of detections times totals and two over the edge potential, for each subregion."""
        return sum(3 * len(self._log_reading) * edge.shape[0] + 2 * edge.size for edge in self._edges)


def convolve(first: FloatArray, second: FloatArray, semiring: Semiring) -> FloatArray:
    """Log weights of the total of two independent counts: log of the convolution, or the max-convolution.

    Args:
        first: Log weights of 0, 1, ... of the one, shape (m,).
        second: Those of the other, shape (n,); quick where this is the shorter one.
        semiring: How pairs with the same total are combined.

    Returns:
        Shape (m + n - 1,).
    """
    shifted = np.full((len(second), len(first) + len(second) - 1), -np.inf)
    for count, weight in enumerate(second):
        shifted[count, count : count + len(first)] = first + weight
    return reduce(semiring, shifted, 0)


def _correlate(first: FloatArray, likelihood: FloatArray, size: int, semiring: Semiring) -> FloatArray:
    """For each count c below `size` the combination over t of first[t] + likelihood[t + c]; shape (size,)."""
    windows = np.lib.stride_tricks.sliding_window_view(likelihood, len(first))[:size]
    return reduce(semiring, windows + first, 1)


def _likelihoods_ahead(messages: list[FloatArray], log_reading: FloatArray, semiring: Semiring) -> list[FloatArray]:
    """For each subregion the log likelihood of a total over it and those before it, those after it combined away."""
    ahead = [log_reading]
    for message in reversed(messages[1:]):
        size = len(ahead[-1]) - len(message) + 1
        windows = np.lib.stride_tricks.sliding_window_view(ahead[-1], len(message))[:size]
        ahead.append(reduce(semiring, windows + message, 1))
    return ahead[::-1][: len(messages)]
