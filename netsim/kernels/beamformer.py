"""Direction of arrival from a few microphones: the maximum-likelihood beamformer (Liu, Reich, Zhao 2002, eqs 7 to 10).

The signal of an unknown wideband source comes as a plane wave, so that microphone m hears it by t_m later than the middle of
the array does (eq 7), and the DFT of the samples is D(l) S_0(l) + W(l) with D_m(l) = exp(-j 2 pi f_l t_m) (eq 8). All
entries of D have modulus 1, so its pseudo-inverse is D^H / M (eq 10), and least squares (eq 9) means the bearing of the
greatest beam power sum_l |D(l)^H G(l)|^2. Of real samples the bins above L / 2 are negative frequencies and repeat those
below, so the sum runs over 0 < l < L / 2; bin 0 says nothing of delays, and bin L / 2 is no single frequency.

The method is that of Chen, Hudson, Yao 2001. Bearings are in radians, from north clockwise (Fig. 4).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from netsim.kernels.acoustics import wrapped_rad
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

ComplexArray = NDArray[np.complex128]

FOOT_M = 0.3048
COARSE_STEPS = 120
"""Bearings that are tried first, all round: every 3 degrees, well within the main lobe of a one-foot array at 2.5 kHz."""
_FINE_STEPS = 9
_ROUNDS = 4
"""Each narrows the search to a quarter: from 3 degrees to a hundredth, from where a parabola finds the peak."""


def square_m(side_m: float = FOOT_M) -> tuple[tuple[float, float], ...]:
    """Four microphones at the corners of a square around the middle of the array (Fig. 4)."""
    half_m = side_m / 2.0
    return (half_m, half_m), (half_m, -half_m), (-half_m, -half_m), (-half_m, half_m)


@dataclass(frozen=True, slots=True)
class ArrayProcessing:
    """How a node makes a bearing out of the samples of its microphones.

    Attributes:
        microphones_m: Where they are, relative to the middle of the array, M of them.
        samples: Samples of each in one reading: the length L of the DFT.
        sampling_hz: Sampling rate.
        sound_m_per_s: Speed of sound.
        window: Weights of the samples before the DFT, to which eq 8 is exact only for a signal that repeats itself with
            period L; `hann` makes the error of others negligible, and that of noise a third larger.
    """

    microphones_m: tuple[tuple[float, float], ...] = square_m()
    samples: int = 512
    sampling_hz: float = 5000.0
    sound_m_per_s: float = 343.0
    window: Literal["none", "hann"] = "none"

    def delays_s(self, bearing_rad: ArrayLike) -> FloatArray:
        """How much later than the middle each microphone hears plane waves from bearings of shape (...): (..., M)."""
        bearing = np.asarray(bearing_rad, dtype=float)[..., None]
        places_m = np.asarray(self.microphones_m)
        towards_m = places_m[:, 0] * np.sin(bearing) + places_m[:, 1] * np.cos(bearing)
        return np.asarray(-towards_m / self.sound_m_per_s)

    def frequencies_hz(self) -> FloatArray:
        """Of the bins that count: 0 < l < L / 2."""
        return np.asarray(np.arange(1, (self.samples + 1) // 2) * (self.sampling_hz / self.samples))


def reading_of(values: FloatArray, processing: ArrayProcessing | None) -> float:
    """The reading that a node makes out of what its sensor gave.

    Args:
        values: An amplitude or a bearing, shape (1,), or the samples of M microphones, shape (M, L).
        processing: How samples are made into a bearing; needed for them alone.

    Returns:
        The value itself, or the bearing that the beamformer finds; NaN where there is no value, as of a dead sensor.

    Raises:
        ValueError: For samples without `processing`, or of another shape than it says.
    """
    if len(values) == 0:
        return math.nan
    if values.ndim == 1:
        return float(values[0])
    if processing is None:
        text = f"samples of shape {values.shape} need an ArrayProcessing to become a bearing"
        raise ValueError(text)
    return bearing_of(values, processing)


def reading_operations(values: FloatArray, processing: ArrayProcessing | None) -> int:
    """Elementary floating-point operations of `reading_of`: none for what is a reading already."""
    if values.ndim == 1 or len(values) == 0 or processing is None:
        return 0
    return beamforming_operations(processing)


def bearing_of(samples: FloatArray, processing: ArrayProcessing) -> float:
    """The bearing of maximum likelihood (eqs 9 and 10), in [-pi, pi): a coarse search all round, then ever finer ones.

    Args:
        samples: Of each microphone, shape (M, L).
        processing: The array.

    Raises:
        ValueError: For samples of another shape.
    """
    expected = (len(processing.microphones_m), processing.samples)
    if samples.shape != expected:
        text = f"expected samples of shape {expected}, got {samples.shape}"
        raise ValueError(text)
    weighted = samples if processing.window == "none" else samples * _hann(processing.samples)
    spectra = np.fft.rfft(weighted, axis=1)[:, 1 : len(processing.frequencies_hz()) + 1]
    step = 2.0 * math.pi / COARSE_STEPS
    power = np.abs(np.einsum("tml,ml->tl", _coarse_steering(processing), spectra)) ** 2
    best = int(power.sum(axis=1).argmax()) * step
    offsets = np.linspace(-1.0, 1.0, _FINE_STEPS)
    for _ in range(_ROUNDS):
        power = beam_power(spectra, best + step * offsets, processing)
        best, step = best + step * float(offsets[power.argmax()]), step * float(offsets[1] - offsets[0])
    return float(
        wrapped_rad(best + step * _vertex(beam_power(spectra, best + step * np.array([-1, 0, 1]), processing)))
    )


def beam_power(spectra: ComplexArray, bearing_rad: FloatArray, processing: ArrayProcessing) -> FloatArray:
    """Sum over the bins of |D^H G|^2, which falls as the squares of eq 9 rise.

    Args:
        spectra: DFT of each microphone's samples at `processing.frequencies_hz()`, shape (M, bins).
        bearing_rad: Bearings, shape (n,).
        processing: The array.

    Returns:
        Power in each direction, shape (n,).
    """
    beams = np.einsum("tml,ml->tl", _steering(bearing_rad, processing), spectra)
    return np.asarray((np.abs(beams) ** 2).sum(axis=1))


def _steering(bearing_rad: FloatArray, processing: ArrayProcessing) -> ComplexArray:
    """Complex conjugate of D of eq 8, shape (n, M, bins)."""
    phase = 2.0 * np.pi * processing.delays_s(bearing_rad)[..., None] * processing.frequencies_hz()
    return np.asarray(np.exp(1j * phase))


def _hann(length: int) -> FloatArray:
    """Hann's window of a period of so many samples."""
    return np.asarray(np.sin(np.pi * np.arange(length) / length) ** 2)


@lru_cache(maxsize=4)
def _coarse_steering(processing: ArrayProcessing) -> ComplexArray:
    return _steering(np.arange(COARSE_STEPS, dtype=float) * (2.0 * np.pi / COARSE_STEPS), processing)


def _vertex(power: FloatArray) -> float:
    """Where the parabola through the powers at -1, 0 and 1 is highest; 0 where it has no peak between them."""
    below, here, above = power.tolist()
    bend = below - 2.0 * here + above
    return 0.0 if bend >= 0.0 else min(1.0, max(-1.0, 0.5 * (below - above) / bend))


def beamforming_operations(processing: ArrayProcessing) -> int:
    """Elementary floating-point operations of `bearing_of` on a node that keeps the coarse steering as a table.

    A real FFT takes 2.5 L log2 L of them; a bearing and bin takes a complex product and sum for each microphone and the
    square of the modulus, in the fine search besides a sine and a cosine for each microphone.
    """
    microphones, bins = len(processing.microphones_m), len(processing.frequencies_hz())
    transforms = math.ceil(2.5 * microphones * processing.samples * math.log2(processing.samples))
    beam, steering = 8 * microphones + 4, microphones * (2 * FUNCTION_OPERATIONS + 1)
    fine = _ROUNDS * _FINE_STEPS + 3
    weights = 0 if processing.window == "none" else microphones * processing.samples
    return weights + transforms + bins * (COARSE_STEPS * beam + fine * (beam + steering))


def bearing_bound_rad(spectrum: ComplexArray, noise_sd: float, processing: ArrayProcessing) -> float:
    """Cramer-Rao bound: the least standard deviation of an unbiased bearing of a source whose spectrum is not known.

    With white noise of variance s^2 in every sample the Fisher information of eq 8 is 2 / (L s^2) times the sum over bins
    and microphones of |S_0|^2 (2 pi f)^2 (dt_m / dtheta)^2, the delays' derivatives taken around their mean (Stoica and
    Nehorai 1989, theorem 4.1, summed over the bins). On a square it is alike in all directions, which is what is given here.

    Args:
        spectrum: DFT of the source's samples at `processing.frequencies_hz()`.
        noise_sd: Standard deviation s.
        processing: An array whose microphones lie as widely along any direction as along another, such as a square.
    """
    places_m = np.asarray(processing.microphones_m) - np.mean(processing.microphones_m, axis=0)
    spread_s2 = float((places_m**2).sum()) / 2.0 / processing.sound_m_per_s**2
    angular = 2.0 * np.pi * processing.frequencies_hz()
    weight = float((np.abs(spectrum) ** 2 * angular**2).sum())
    return math.sqrt(processing.samples * noise_sd**2 / (2.0 * weight * spread_s2))
