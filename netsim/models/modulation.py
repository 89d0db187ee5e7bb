"""How a radio turns signal, interference and noise into right and wrong bits: one small class a modulation.

A modulation is part of a radio device. It is asked once for every segment of a frame over which powers are constant, for
all listeners at once.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

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


O_QPSK = OQpsk()
