"""Whether a reading is an outlier under a belief: how probable readings are that are as unlikely, or more (a p-value).

Under the predictive distribution p(z) = sum_x p(x) p(z|x), the tail probability is uniform in [0, 1], but for what is
lost to numerical integration: a gate at g refuses a share g of the readings that fit the model. The gate is that of
Bar-Shalom, Li, Kirubarajan 2001, section 5.4, for densities that are not normal.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec, bearing_rad
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

_BEARINGS: Final = 360
_STEP_RAD: Final = math.radians(8.0)
"""Readings that spread less than this are judged on a circle of more bearings."""
_CELLS_AT_ONCE: Final = 200


def tail_probability(predicted: GridBelief, sensor: SensorSpec, reading: float) -> float:
    """Of a reading under a belief about the target's position; 1 for NaN, which is no reading.

    Amplitude: twice the smaller of the probabilities of a lower and of a higher one. Bearing, which has neither: the
    probability of bearings of a lower density.
    """
    if math.isnan(reading):
        return 1.0
    offsets_m = predicted.centres_m - np.asarray(sensor.position_m)
    range_m = np.hypot(offsets_m[:, 0], offsets_m[:, 1])
    if isinstance(sensor.model, BearingModel):
        return _bearing_tail(predicted.probability, bearing_rad(offsets_m), range_m, sensor.model, reading)
    lower = float(predicted.probability @ amplitude_cdf(sensor.model, reading, range_m))
    return min(1.0, 2.0 * max(0.0, min(lower, 1.0 - lower)))


def tail_operations(cells: int, sensor: SensorSpec) -> int:
    """Elementary floating-point operations of `tail_probability` for a belief of so many cells."""
    if isinstance(sensor.model, BearingModel):
        entry, bearings = sensor.model.density_operations + FUNCTION_OPERATIONS + 2, _bearings(sensor.model)
        return cells * sensor.place_operations + cells * bearings * entry + 2 * bearings
    return cells * (sensor.place_operations + 4 * FUNCTION_OPERATIONS + 16)


def amplitude_cdf(model: AmplitudeModel, amplitude: ArrayLike, range_m: ArrayLike) -> FloatArray:
    """P(z <= amplitude | r), broadcast: the integral of eq 6.

    With a uniform in [low, high], it is the mean of Phi((z - a / r) / sd) over a; the integral of Phi is
    u Phi(u) + phi(u).
    """
    r = np.maximum(np.asarray(range_m, dtype=float), model.least_range_m)
    z = np.asarray(amplitude, dtype=float)
    upper, lower = (z - model.low / r) / model.sd, (z - model.high / r) / model.sd
    return np.asarray(np.clip((_integral(upper) - _integral(lower)) / (upper - lower), 0.0, 1.0))


def _integral(u: FloatArray) -> FloatArray:
    """Of Phi, from minus infinity."""
    return np.asarray(u * ndtr(u) + np.exp(-0.5 * u * u) / math.sqrt(2.0 * math.pi))


def _bearings(model: BearingModel) -> int:
    """On how many bearings a density is put, so that a least spread has eight of them or so."""
    return _BEARINGS * max(1, math.ceil(_STEP_RAD / model.least_spread_rad))


def _bearing_tail(
    probability: FloatArray, true_rad: FloatArray, range_m: FloatArray, model: BearingModel, reading: float
) -> float:
    count = _bearings(model)
    bearings = reading + 2.0 * np.pi * np.arange(count) / count
    density = np.zeros(count)
    for start in range(0, len(probability), _CELLS_AT_ONCE):
        some = slice(start, start + _CELLS_AT_ONCE)
        logs = model.log_density(bearings[None, :], true_rad[some, None], range_m[some, None])
        density += probability[some] @ np.exp(logs)
    below = density <= density[0] * (1.0 + 1e-9)
    below[0] = False  # the reading itself is a point, not a cell
    return float(density[below].sum() / density.sum())


def detection_threshold(model: AmplitudeModel, false_alarm: float) -> float:
    """The amplitude that noise alone exceeds with a probability: sd times the normal quantile of 1 - false_alarm."""
    return -model.sd * float(ndtri(false_alarm))
