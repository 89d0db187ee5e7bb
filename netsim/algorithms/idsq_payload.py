"""The belief as bytes: what a leader hands to the next."""

from dataclasses import dataclass

import numpy as np

from netsim.codec import FloatWidth, Record, decode_floats, encode_floats
from netsim.kernels.grid_belief import Grid, GridBelief

_HEADER = Record("H")  # number of cells


@dataclass(frozen=True, slots=True)
class Laid:
    """A belief laid out.

    Attributes:
        data: The bytes.
        form: Which layout: `grid`.
        divergence_bit: Kullback-Leibler divergence of the belief from what the bytes say.
    """

    data: bytes
    form: str
    divergence_bit: float


@dataclass(frozen=True, slots=True)
class BeliefCoder:
    """Beliefs to bytes and back.

    Attributes:
        grid: Which sender and receiver share.
        width: Precision of probabilities.
    """

    grid: Grid
    width: FloatWidth

    def encode(self, belief: GridBelief) -> Laid:
        """The smallest layout allowed."""
        cells = belief.cells.astype("<u2").tobytes()
        data = _HEADER.pack(len(belief.cells)) + cells + encode_floats(belief.probability, self.width)
        return Laid(data, "grid", _divergence_bit(belief, self.decode(data)))

    def decode(self, data: bytes) -> GridBelief:
        """The belief that bytes say.

        Raises:
            ValueError: For bytes that are no belief.
        """
        (count,) = _HEADER.unpack(data)
        start = _HEADER.size_byte
        cells = np.frombuffer(data[start : start + 2 * count], dtype="<u2").astype(np.int64)
        weights = decode_floats(data[start + 2 * count :], self.width)
        kept = weights > 0.0
        return GridBelief(self.grid, cells[kept], weights[kept] / weights.sum())


def _divergence_bit(belief: GridBelief, other: GridBelief) -> float:
    there = np.zeros(belief.grid.size)
    there[other.cells] = other.probability
    q = there[belief.cells]
    if np.any(q <= 0.0):
        return float("inf")
    return max(0.0, float((belief.probability * np.log2(belief.probability / q)).sum()))
