"""What acoustic sensors tell of a source's position: amplitude, direction of arrival (Liu, Reich, Zhao 2002, section 3).

Bearings are in radians, from north (the y axis) clockwise, as in the paper's Fig. 4. Both densities are normalised over the
measurement for every position, so that they can be compared between positions.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_ndtr

from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, slots=True)
class AmplitudeModel:
    """An rms amplitude z = a / r + w, with the source's amplitude a uniform and w normal (eqs 5 and 6).

    Attributes:
        low: Least amplitude of the source at 1 m.
        high: Greatest; above `low`.
        sd: Standard deviation of the noise w that the tracker assumes.
        least_range_m: Ranges below this count as this.
    """

    low: float = 0.0
    high: float = 80.0
    sd: float = 0.1
    least_range_m: float = 0.5

    @property
    def density_operations(self) -> int:
        """Elementary floating-point operations of one value of `log_density`."""
        return 5 * FUNCTION_OPERATIONS + 14

    def log_density(self, amplitude: ArrayLike, range_m: ArrayLike) -> FloatArray:
        """Logarithm of p(z|r) (eq 6), broadcast over both."""
        r = np.maximum(np.asarray(range_m, dtype=float), self.least_range_m)
        z = np.asarray(amplitude, dtype=float)
        upper, lower = (self.high / r - z) / self.sd, (self.low / r - z) / self.sd
        return np.asarray(np.log(r / (self.high - self.low)) + _log_interval(lower, upper))


def _log_interval(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """log(Phi(upper) - Phi(lower)) for upper above lower, accurate in both tails.

    Minus infinity where the two are so far out that they are the same number.
    """
    flip = lower > 0.0
    a, b = np.where(flip, -upper, lower), np.where(flip, -lower, upper)
    log_b, log_a = log_ndtr(b), log_ndtr(a)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(log_b + np.log(-np.expm1(log_a - log_b)))


@dataclass(frozen=True, slots=True)
class BearingModel:
    """A bearing with a normal error whose spread depends on the range (eq 11, Fig. 6).

    Attributes:
        sd_rad: Standard deviation between the near and the far range.
        near_m: Below this range it grows linearly as the range shrinks.
        far_m: Above this range it grows linearly.
        sd_at_zero_rad: At range 0.
        growth_rad_per_m: Beyond `far_m`.
    """

    sd_rad: float = math.radians(10.0)
    near_m: float = 20.0
    far_m: float = 100.0
    sd_at_zero_rad: float = math.radians(45.0)
    growth_rad_per_m: float = math.radians(0.5)

    @property
    def density_operations(self) -> int:
        """Elementary floating-point operations of one value of `log_density`."""
        return 5 * FUNCTION_OPERATIONS + 22

    @property
    def least_spread_rad(self) -> float:
        """The smallest standard deviation at any range."""
        return min(self.sd_rad, self.sd_at_zero_rad)

    def spread_rad(self, range_m: ArrayLike) -> FloatArray:
        """Standard deviation at a range (Fig. 6)."""
        r = np.asarray(range_m, dtype=float)
        near = self.sd_at_zero_rad + (self.sd_rad - self.sd_at_zero_rad) * r / self.near_m
        far = self.sd_rad + self.growth_rad_per_m * (r - self.far_m)
        return np.where(r < self.near_m, near, np.where(r > self.far_m, far, self.sd_rad))

    def log_density(self, bearing_rad: ArrayLike, true_bearing_rad: ArrayLike, range_m: ArrayLike) -> FloatArray:
        """Logarithm of p(z|theta, r), broadcast: normal in the wrapped difference, cut off at half a turn (eq 11)."""
        sd = self.spread_rad(range_m)
        error = wrapped_rad(np.asarray(bearing_rad, dtype=float) - np.asarray(true_bearing_rad, dtype=float))
        log_inside = _log_interval(-np.pi / sd, np.pi / sd)
        return np.asarray(-0.5 * (error / sd) ** 2 - np.log(sd * math.sqrt(2.0 * math.pi)) - log_inside)


def wrapped_rad(angle_rad: ArrayLike) -> FloatArray:
    """Angles brought into [-pi, pi)."""
    return np.asarray((np.asarray(angle_rad, dtype=float) + np.pi) % (2.0 * np.pi) - np.pi)


def bearing_rad(offsets_m: FloatArray) -> FloatArray:
    """Bearing of offsets of shape (..., 2), from north clockwise."""
    return np.asarray(np.arctan2(offsets_m[..., 0], offsets_m[..., 1]))


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """What a node knows of a sensor, its own or a neighbour's: where it is and how it measures.

    Attributes:
        position_m: Where.
        model: Its measurement model.
    """

    position_m: tuple[float, float]
    model: AmplitudeModel | BearingModel

    @property
    def measures_bearing(self) -> bool:
        """Whether it is a direction-of-arrival sensor."""
        return isinstance(self.model, BearingModel)

    def log_likelihood(self, reading: float, points_m: FloatArray) -> FloatArray:
        """Of a reading, for a source at each of some points of shape (n, 2): shape (n,).

        NaN is no reading (see `netsim.kernels.beamformer.reading_of`), which says nothing: 0 everywhere.
        """
        if math.isnan(reading):
            return np.zeros(len(points_m))
        offsets_m = points_m - np.asarray(self.position_m)
        range_m = np.hypot(offsets_m[:, 0], offsets_m[:, 1])
        if isinstance(self.model, BearingModel):
            return self.model.log_density(reading, bearing_rad(offsets_m), range_m)
        return self.model.log_density(reading, range_m)

    def likelihood_operations(self, points: int) -> int:
        """Elementary floating-point operations of `log_likelihood` for so many points."""
        return points * (self.place_operations + self.model.density_operations)

    @property
    def place_operations(self) -> int:
        """Elementary floating-point operations of a point's range, and bearing where that counts."""
        return 5 + FUNCTION_OPERATIONS * (2 if self.measures_bearing else 1)
