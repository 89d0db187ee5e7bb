"""How much a sensor's next reading is expected to tell of a position: mutual information (Liu, Reich, Zhao 2002, Table 3).

The reading is put on a grid; densities become probabilities of its cells, normalised for every position. `exact` takes every
cell of the belief (the three-dimensional form of Table 3), otherwise a scalar stands for the position as in section 4.3.

Before an amplitude the range stands for it, in bins of 1 m, or of a fortieth of the range where that is less. Eq 19 holds,
and the bins cost less than .01 bit as seen.

Before a direction of arrival the bearing stands for it, in bins of a degree. Here the paper's equality does not hold, since
the spread depends on the range too. A bin takes the geometric mean of its cells' spreads: of normal errors that keeps the
mean entropy of the reading right. On compact beliefs within 60 m the result is off by .005 bit in the root mean square, and
by .06 at most as seen. It lacks what the spread of a reading tells of the range: up to .16 bit about and beyond the far
range, and .3 where a belief has parts both near and far in one direction.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy

from netsim.kernels.acoustics import (
    AmplitudeModel,
    BearingModel,
    SensorSpec,
    bearing_rad,
    log_error_density,
    wrapped_rad,
)
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

RANGE_BIN_M = 1.0
RANGE_BINS_PER_E = 40
"""Where bins grow with the range: in a factor of e."""
_EVEN_FROM_M = RANGE_BIN_M * RANGE_BINS_PER_E
_LEAST_RANGE_M = 0.25
_GROWING_BINS = math.ceil(RANGE_BINS_PER_E * math.log(_EVEN_FROM_M / _LEAST_RANGE_M))
BEARING_BINS = 360
_BEARING_WIDTH = 2.0 * np.pi / BEARING_BINS
_STEPS_PER_SD = 2.0
_RELATIVE_STEP = 0.01


def mutual_information_bit(prior: FloatArray, conditional: FloatArray) -> float:
    """I(X; Z) in bits, at least 0, of p(x), shape (n,), and p(z|x), shape (n, m), whose rows sum to one."""
    return _information_bit(prior, conditional, _row_entropy_nat(conditional))


def _row_entropy_nat(conditional: FloatArray) -> FloatArray:
    return np.asarray(-xlogy(conditional, conditional).sum(axis=1))


def _information_bit(prior: FloatArray, conditional: FloatArray, row_entropy_nat: FloatArray) -> float:
    marginal = prior @ conditional
    entropy_nat = -float(xlogy(marginal, marginal).sum())
    return max(0.0, entropy_nat - float(prior @ row_entropy_nat)) / float(np.log(2.0))


def information_bit(belief: GridBelief, sensor: SensorSpec, *, exact: bool = False) -> float:
    """Expected information of a sensor's reading about the position, in bits (eqs 15 and 16).

    Args:
        belief: Of the position at the time of the reading.
        sensor: The sensor.
        exact: Whether to go through every cell (see the module).
    """
    offsets_m = belief.centres_m - np.asarray(sensor.position_m)
    range_m = np.hypot(offsets_m[:, 0], offsets_m[:, 1])
    if isinstance(sensor.model, BearingModel):
        return _bearing_bit(belief.probability, bearing_rad(offsets_m), range_m, sensor.model, exact=exact)
    if exact:
        return mutual_information_bit(belief.probability, _amplitude_table(sensor.model, range_m))
    bins = _range_bins(range_m)
    table = _tabulated(sensor.model, 1 << int(bins.max()).bit_length())
    used, where = np.unique(bins, return_inverse=True)
    prior = _sums(where, belief.probability)
    return _information_bit(prior, table.conditional[used], table.row_entropy_nat[used])


def information_operations(belief: GridBelief, sensor: SensorSpec, *, exact: bool = False) -> int:
    """Elementary floating-point operations of `information_bit` on a node.

    Every entry of p(z|x) that is computed takes its density (of a bearing, the exponential of the square of its error), the
    share in its row and its part of the row's entropy; every one that is used, a product and a sum; every cell of the
    reading, its part of the entropy. The table of an amplitude sensor's range bins is the same for all beliefs, so that a
    node keeps it.
    """
    model, cells = sensor.model, len(belief.cells)
    rows = cells if exact else len(np.unique(_bins(belief, sensor)))
    columns = BEARING_BINS if isinstance(model, BearingModel) else len(_amplitude_edges(model)) - 1
    computed = 0 if isinstance(model, AmplitudeModel) and not exact else rows * columns
    density = 6 if isinstance(model, BearingModel) else model.density_operations + 1
    entry = density + 2 * FUNCTION_OPERATIONS + 4
    places = cells * (sensor.place_operations + 2)
    return places + computed * entry + 2 * rows * columns + columns * (FUNCTION_OPERATIONS + 2)


def _bins(belief: GridBelief, sensor: SensorSpec) -> NDArray[np.int64]:
    """The range bin, or the bearing bin, of each cell of a belief."""
    offsets_m = belief.centres_m - np.asarray(sensor.position_m)
    if isinstance(sensor.model, BearingModel):
        return _bearing_bins(bearing_rad(offsets_m))
    return _range_bins(np.hypot(offsets_m[:, 0], offsets_m[:, 1]))


def _range_bins(range_m: FloatArray) -> NDArray[np.int64]:
    growing = RANGE_BINS_PER_E * np.log(np.maximum(range_m, _LEAST_RANGE_M) / _LEAST_RANGE_M)
    even = _GROWING_BINS + (range_m - _EVEN_FROM_M) / RANGE_BIN_M
    return np.where(range_m < _EVEN_FROM_M, growing, even).astype(np.int64)


def _range_of_bins_m(bins: int) -> FloatArray:
    """Middles of the first range bins."""
    number = np.arange(bins) + 0.5
    growing = _LEAST_RANGE_M * np.exp(number / RANGE_BINS_PER_E)
    even = _EVEN_FROM_M + (number - _GROWING_BINS) * RANGE_BIN_M
    return np.where(number < _GROWING_BINS, growing, even)


def _bearing_bins(true_rad: FloatArray) -> NDArray[np.int64]:
    bins: NDArray[np.int64] = np.floor(true_rad / _BEARING_WIDTH).astype(np.int64) % BEARING_BINS
    return bins


class _Tabulated:
    """p(z|r) of an amplitude sensor for the first range bins, and the entropy of each row."""

    def __init__(self, model: AmplitudeModel, bins: int) -> None:
        self.conditional = _amplitude_table(model, _range_of_bins_m(bins))
        self.row_entropy_nat = _row_entropy_nat(self.conditional)


@lru_cache(maxsize=16)
def _tabulated(model: AmplitudeModel, bins: int) -> _Tabulated:
    return _Tabulated(model, bins)


@lru_cache(maxsize=16)
def _amplitude_edges(model: AmplitudeModel) -> FloatArray:
    """Edges of the cells of the reading: fine against the noise where it is small, within 1 % where it is large.

    They reach 5 standard deviations below the least and above the greatest reading there can be.
    """
    step, top = model.sd / _STEPS_PER_SD, model.high / model.least_range_m + 5.0 * model.sd
    even = np.arange(-5.0 * model.sd, min(step / _RELATIVE_STEP, top) + step, step)
    ratios = max(0, int(np.ceil(np.log(top / even[-1]) / np.log1p(_RELATIVE_STEP)))) if top > even[-1] else 0
    return np.concatenate([even, even[-1] * (1.0 + _RELATIVE_STEP) ** np.arange(1, ratios + 1)])


def _amplitude_table(model: AmplitudeModel, range_m: FloatArray) -> FloatArray:
    """Probabilities of the reading's cells at each range, shape (n, m)."""
    edges = _amplitude_edges(model)
    middles, widths = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
    return _rows(np.exp(model.log_density(middles[None, :], range_m[:, None])) * widths)


def _rows(weights: FloatArray) -> FloatArray:
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _bearing_bit(
    prior: FloatArray, true_rad: FloatArray, range_m: FloatArray, model: BearingModel, *, exact: bool
) -> float:
    sd_rad = model.spread_rad(range_m)
    if not exact:
        used, where = np.unique(_bearing_bins(true_rad), return_inverse=True)
        mass = _sums(where, prior)
        sd_rad = np.exp(_sums(where, prior * np.log(sd_rad)) / mass)
        prior, true_rad = mass, np.asarray((used + 0.5) * _BEARING_WIDTH, dtype=float)
    readings = (np.arange(BEARING_BINS) + 0.5) * _BEARING_WIDTH
    error_rad = wrapped_rad(readings[None, :] - true_rad[:, None])
    return mutual_information_bit(prior, _rows(np.exp(-0.5 * (error_rad / sd_rad[:, None]) ** 2)))


def _sums(where: NDArray[np.int64], weights: FloatArray) -> FloatArray:
    """Sum of the weights of each place."""
    return np.bincount(where, weights=weights).astype(float)
