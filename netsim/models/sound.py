"""The sound of a vehicle, and what microphones around it pick up: signals for the beamformer (Liu, Reich, Zhao 2002, eq 7).

A source is given by its spectrum on the bins of a period that is `PERIODS` times as long as what is sampled, so that a delay
by any fraction of a sample is exact (a turn of the phase of every bin), and yet the samples do not repeat themselves.

The sound is chosen, not measured, to be like an engine's: harmonics of the firing rate whose power falls with the square of
their number, and broadband noise whose power is halved at 300 Hz and falls by 12 dB an octave from there.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge
from numpy.typing import NDArray

from netsim.parameters import NonNegative, Positive, Probability, parameters

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
PERIODS = 4
_CORNER_HZ = 300.0
_RATE_SPREAD = 0.05


@parameters
class MicrophoneArray:
    """Four microphones at the corners of a square, as on the paper's nodes (section 5.2.1)."""

    side_m: Positive = 0.3048
    """Side of the square; one foot."""
    sampling_hz: Positive = 5000.0
    """Samples of each microphone in a second."""
    samples: Annotated[int, Ge(3)] = 512
    """Of each microphone in one reading; fewer than three have no frequency to tell delays by."""
    window: Literal["none", "hann"] = "none"
    """Weights of the samples before the DFT. Without them a bearing is off by some .1 degree even without noise, since a
    sound does not repeat itself with the DFT's length; with Hann's by less than .01, at a third more spread in noise."""
    noise_sd: NonNegative = 0.5
    """Standard deviation of every sample's noise, in the unit of the source's amplitude at 1 m. The default is chosen: the
    bearing of a source of amplitude 40 is off by some 2 degrees at 50 m and 6 at 100 m; the paper draws 3 degrees."""
    sound_m_per_s: Positive = 343.0
    """Speed of sound."""
    firing_hz: Positive = 60.0
    """Rate of the engine's strokes; each target's is within 5 % of it."""
    broadband: Probability = 0.5
    """Share of the sound's power that is noise; the rest are harmonics of the firing rate."""


def source_spectrum(microphones: MicrophoneArray, rng: np.random.Generator) -> ComplexArray:
    """A sound of rms 1 on average: one-sided spectrum of `PERIODS` times `samples` real samples, as of `numpy.fft.rfft`."""
    length = PERIODS * microphones.samples
    hz: FloatArray = np.arange(length // 2 + 1, dtype=float) * (microphones.sampling_hz / length)
    firing_hz = microphones.firing_hz * (1.0 + _RATE_SPREAD * (2.0 * rng.random() - 1.0))
    noise = 1.0 / (1.0 + (hz / _CORNER_HZ) ** 4)
    noise[[0, -1]] = 0.0
    power = microphones.broadband * noise / noise.sum()
    phases = np.exp(2j * np.pi * rng.random(len(hz)))
    spectrum = np.sqrt(power * rng.exponential(size=len(hz))) * phases
    return np.asarray((spectrum + _harmonics(hz, firing_hz, 1.0 - microphones.broadband, rng)) * length / np.sqrt(2.0))


def _harmonics(hz: FloatArray, firing_hz: float, power: float, rng: np.random.Generator) -> ComplexArray:
    """Lines at the bins next to the multiples of a rate below the Nyquist frequency, of random phases."""
    lines = np.zeros(len(hz), dtype=complex)
    numbers = np.arange(1, max(2, int(hz[-2] / firing_hz) + 1))
    bins = np.clip(np.rint(numbers * firing_hz / hz[1]).astype(int), 1, len(hz) - 2)
    share = power * numbers**-2.0 / (numbers**-2.0).sum()
    np.add.at(lines, bins, np.sqrt(share) * np.exp(2j * np.pi * rng.random(len(numbers))))
    return lines


def heard(
    spectrum: ComplexArray, microphones: MicrophoneArray, delays_s: Sequence[float], gains: Sequence[float]
) -> FloatArray:
    """What each microphone picks up of a source, without noise.

    Args:
        spectrum: See `source_spectrum`.
        microphones: How they sample.
        delays_s: From the source to each microphone.
        gains: Amplitude at each microphone for a source of rms 1.

    Returns:
        Samples, shape (microphones, `samples`).
    """
    length = PERIODS * microphones.samples
    hz = np.arange(len(spectrum)) * (microphones.sampling_hz / length)
    turned = spectrum * np.exp(-2j * np.pi * np.asarray(delays_s)[:, None] * hz)
    signals = np.fft.irfft(turned, length, axis=1)[:, : microphones.samples]
    return np.asarray(np.asarray(gains)[:, None] * signals)
