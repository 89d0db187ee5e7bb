"""How a radio turns signal, interference and noise into right and wrong bits: one small class a modulation.

A modulation is part of a radio device. It is asked once for every segment of a frame over which powers are constant, for
all listeners at once.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from netsim.models.reception import log_bit_success_of

Floats = NDArray[np.float64]


class Modulation(Protocol):
    """From powers to the chance that a bit is right."""

    def log_bit_success(self, signal: Floats, interference: Floats, noise: Floats) -> Floats:
        """Natural logarithm of the chance that one bit is right, at constant powers.

        Args:
            signal: Received powers of the wanted signal, above 0; all three arrays are of one shape and in one unit.
            interference: Summed powers of the other signals, at least 0.
            noise: Noise powers, above 0.

        Returns:
            Numbers in [-inf, 0]; 0 where the bit is certainly right, -inf where it is certainly lost.
        """
        ...


@dataclass(frozen=True, slots=True)
class OQpsk:
    """IEEE 802.15.4 O-QPSK at 2.4 GHz: interference counts as white noise (IEEE 802.15.4-2006 E.4.1.8)."""

    def log_bit_success(self, signal: Floats, interference: Floats, noise: Floats) -> Floats:
        """See `Modulation.log_bit_success`."""
        return log_bit_success_of(signal / (interference + noise))


@dataclass(frozen=True, slots=True)
class NcFsk:
    """Non-coherent FSK: BER = 0.5 exp(-sinr/2 * B_N/R); interference counts as white noise.

    Zuniga and Krishnamachari, "Analyzing the transitional region in low power wireless links", SECON 2004.

    Attributes:
        bandwidth_per_bitrate: B_N/R, the receiver's noise bandwidth over the bit rate: 30 kHz / 19.2 kbit/s on the MICA2.
    """

    bandwidth_per_bitrate: float

    def log_bit_success(self, signal: Floats, interference: Floats, noise: Floats) -> Floats:
        """See `Modulation.log_bit_success`."""
        sinr = signal / (interference + noise)
        success: Floats = np.log1p(-0.5 * np.exp(-0.5 * self.bandwidth_per_bitrate * sinr))
        return success


@dataclass(frozen=True, slots=True)
class Cc2420Fit:
    """What TOSSIM fitted to measurements of the CC2420; interference counts as white noise.

    A symbol of four bits is wrong with PSE = 0.5 erfc(0.9794 (SINR_dB - 2.3851) / sqrt 2). The fit was made for frames of
    23 bytes, of which (1 - PSE)^46 arrive: half of them at 4.6 dB, where the standard's O-QPSK curve asks for -1.8 dB.
    """

    def log_bit_success(self, signal: Floats, interference: Floats, noise: Floats) -> Floats:
        """See `Modulation.log_bit_success`."""
        sinr_db = 10.0 * np.log10(signal / (interference + noise))
        success: Floats = log_ndtr(0.9794 * (sinr_db - 2.3851)) / 4.0  # 1 - PSE is a normal distribution function
        return success


@dataclass(frozen=True, slots=True)
class LoraChirps:
    """LoRa: all or nothing. Every bit is right above the sensitivity, unless interference comes too near.

    As in LoRaSim (Bor et al., "Do LoRa low-power wide-area networks scale?", MSWiM 2016): a frame survives interference
    of its own spreading factor if it is `capture_db` above it; here above the sum of all of it.

    Attributes:
        threshold_db: Lowest ratio of signal to noise that is demodulated.
        capture_db: How far above the summed interference the signal must be.
    """

    threshold_db: float
    capture_db: float

    def log_bit_success(self, signal: Floats, interference: Floats, noise: Floats) -> Floats:
        """See `Modulation.log_bit_success`."""
        heard = signal >= noise * 10.0 ** (self.threshold_db / 10.0)
        clear = signal >= interference * 10.0 ** (self.capture_db / 10.0)
        return np.where(heard & clear, 0.0, -math.inf)


O_QPSK = OQpsk()
