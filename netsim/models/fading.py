"""Block fading: a power gain that is drawn anew for every frame and listener, and constant over the frame.

Each record is both the scenario's parameters and the distribution. Gains have mean 1, so that link budgets stay what path
loss and shadowing say. Frames fade independently: nothing here models how long a fade lasts.
"""

import math
from typing import Annotated, Literal, Protocol

import numpy as np
from annotated_types import Ge, Le
from numpy.typing import NDArray

from netsim.parameters import NonNegative, parameters

Floats = NDArray[np.float64]


class Fading(Protocol):
    """A distribution of power gains of mean 1."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """Draw (size,) linear power gains, one a listener; the first ones do not depend on `size`."""
        ...


@parameters
class RayleighFading:
    """Many paths and none that dominates: the power gain is exponential (Rappaport, Wireless Communications, 5.6.1)."""

    type: Literal["rayleigh"] = "rayleigh"
    """Selects this distribution."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """See `Fading.gains`."""
        return generator.standard_exponential(size)

    def quantile(self, share: Floats) -> Floats:
        """Gain below which a share of all gains in [0, 1) lies."""
        return -np.log1p(-share)


@parameters
class RicianFading:
    """One steady path and many scattered ones (Rappaport, Wireless Communications, 5.6.2)."""

    type: Literal["rician"] = "rician"
    """Selects this distribution."""
    k_db: Annotated[float, Ge(-20), Le(30)] = 6.0
    """Power of the steady path over that of all scattered ones together."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """See `Fading.gains`."""
        k = 10.0 ** (self.k_db / 10.0)
        normals = generator.standard_normal((size, 2))
        in_phase = math.sqrt(2.0 * k) + normals[:, 0]
        gains: Floats = (in_phase**2 + normals[:, 1] ** 2) / (2.0 * (k + 1.0))
        return gains

    def quantile(self, share: Floats) -> Floats:
        """Gain below which a share of all gains in [0, 1) lies: a noncentral chi-square of two degrees of freedom."""
        from scipy.special import chndtrix  # imported where needed: it would slow every start

        k = 10.0 ** (self.k_db / 10.0)
        found: Floats = np.asarray(chndtrix(share, 2.0, 2.0 * k)) / (2.0 * (k + 1.0))
        return found


@parameters
class NakagamiFading:
    """The power gain is gamma distributed: m = 1 is Rayleigh, larger is milder (Nakagami 1960)."""

    type: Literal["nakagami"] = "nakagami"
    """Selects this distribution."""
    m: Annotated[float, Ge(0.5)] = 3.0
    """Shape: one over the variance of the power gain."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """See `Fading.gains`."""
        return generator.gamma(self.m, 1.0 / self.m, size)

    def quantile(self, share: Floats) -> Floats:
        """Gain below which a share of all gains in [0, 1) lies."""
        from scipy.special import gammaincinv  # imported where needed: it would slow every start

        found: Floats = np.asarray(gammaincinv(self.m, share)) / self.m
        return found


@parameters
class LogNormalFading:
    """The gain is normal in dB, about -sd^2 ln(10)/20 dB so that the mean power is 1."""

    type: Literal["log-normal"] = "log-normal"
    """Selects this distribution."""
    sd_db: NonNegative = 2.0
    """Standard deviation of the gain."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """See `Fading.gains`."""
        return self._gain(generator.standard_normal(size))

    def quantile(self, share: Floats) -> Floats:
        """Gain below which a share of all gains in [0, 1) lies."""
        from scipy.special import ndtri  # imported where needed: it would slow every start

        return self._gain(np.asarray(ndtri(share)))

    def _gain(self, normal: Floats) -> Floats:
        sd = self.sd_db * math.log(10.0) / 10.0
        gain: Floats = np.exp(sd * normal - 0.5 * sd**2)
        return gain


FadingParameters = RayleighFading | RicianFading | NakagamiFading | LogNormalFading

PEAK_SHARE = 0.999


def peak_db(fading: FadingParameters | None) -> float:
    """Gain that one frame in a thousand exceeds, in dB: how much louder than its mean a signal may come; 0 for none."""
    if fading is None:
        return 0.0
    return max(0.0, 10.0 * math.log10(float(fading.quantile(np.array([PEAK_SHARE]))[0])))
