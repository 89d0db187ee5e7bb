"""What acoustic energy sensors tell of the places of one or several sources (Liu, Chu, Liu, Reich, Zhao 2004, eq 3).

Readings are the sum of what every source gives, so that near sources must be inferred jointly; with one source the model is
the marginal one, which takes the others' sound for noise. A reading of NaN is no reading and says nothing.
"""

import math
from dataclasses import dataclass

import numpy as np

from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, slots=True)
class EnergyModel:
    """A reading z = sum_i C / d_i^2 + n with normal noise n (eq 3); ranges d_i below a saturation range count as that.

    Attributes:
        amplitude: C of every source, in units of a reading times square metres; above 0.
        noise_sd: Standard deviation of n, in units of a reading; above 0. A tracker may assume more than there is.
        saturation_m: Nearer sources are no louder than at this range; above 0.
    """

    amplitude: float
    noise_sd: float
    saturation_m: float

    def __post_init__(self) -> None:
        """Refuse what has no density.

        Raises:
            ValueError: A parameter is not positive and finite.
        """
        for name in ("amplitude", "noise_sd", "saturation_m"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                message = f"{name} {value}: expected a positive number"
                raise ValueError(message)

    def mean(self, sensors_m: FloatArray, targets_m: FloatArray) -> FloatArray:
        """Expected readings of sensors at (S, 2) for sources at (..., M, 2): shape (..., S)."""
        offsets_m = targets_m[..., None, :, :] - sensors_m[:, None, :]
        squared_m2 = np.maximum((offsets_m**2).sum(axis=-1), self.saturation_m**2)
        return np.asarray((self.amplitude / squared_m2).sum(axis=-1))

    def log_likelihood(self, readings: FloatArray, sensors_m: FloatArray, targets_m: FloatArray) -> FloatArray:
        """Logarithm of the density of readings of one instant, independent given the sources' places.

        Args:
            readings: Shape (S,); NaN where there is none.
            sensors_m: Where the sensors are, shape (S, 2).
            targets_m: Places of all sources, particle by particle, shape (P, M, 2).

        Returns:
            For every particle, shape (P,); zeros without readings.
        """
        known = ~np.isnan(readings)
        error = (readings[known] - self.mean(sensors_m[known], targets_m)) / self.noise_sd
        constant = np.count_nonzero(known) * math.log(self.noise_sd * math.sqrt(2.0 * math.pi))
        return np.asarray(-0.5 * (error**2).sum(axis=-1) - constant)


def sensing_range_m(model: EnergyModel, ratio: float = 3.0) -> float:
    """Furthest range at which a source's contribution is `ratio` times the noise's deviation: R_sense (section 4.3).

    Of the model with the noise that there is, not of a tracker that assumes more.

    Returns:
        Metres; 0 where even a source within the saturation range is too faint.
    """
    range_m = math.sqrt(model.amplitude / (ratio * model.noise_sd))
    return range_m if range_m >= model.saturation_m else 0.0


def amplitude_for(range_m: float, noise_sd: float, ratio: float = 3.0) -> float:
    """The C that gives a sensing range: the inverse of `sensing_range_m`."""
    return ratio * noise_sd * range_m**2


def mean_operations(sensors: int, particles: int, targets: int) -> int:
    """Elementary floating-point operations of `EnergyModel.mean`.

    For each sensor, particle and source two differences, two products, their sum, a comparison, a division, an addition.
    """
    return 8 * sensors * particles * targets


def likelihood_operations(sensors: int, particles: int, targets: int) -> int:
    """Elementary floating-point operations of `EnergyModel.log_likelihood`.

    Besides the means a difference, a division, a square and an addition for each sensor and particle; the constant once.
    """
    return mean_operations(sensors, particles, targets) + (4 * sensors + 2) * particles + FUNCTION_OPERATIONS + 2
