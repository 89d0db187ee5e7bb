"""Reception of IEEE 802.15.4 frames at 2.4 GHz: from signal to interference plus noise (SINR) to the chance of success.

The bit error rate of O-QPSK with its 32-chip spreading is IEEE 802.15.4-2006 E.4.1.8, the curve that ns-3 and OTNS use:
interference counts as white noise, and bit errors are independent, so a frame survives with (1 - BER)^bits.
"""

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])

_ORDERS = np.arange(2.0, 17.0)
_COEFFICIENTS = np.array([(-1) ** k * math.comb(16, k) for k in range(2, 17)]) * (8 / 15 / 16)
_EXPONENTS = 20.0 * (1.0 / _ORDERS - 1.0)


def oqpsk_bit_error_rate(sinr: FloatOrArray) -> FloatOrArray:
    """Chance that one bit is wrong: (8/15)(1/16) sum over k = 2..16 of (-1)^k C(16, k) exp(20 sinr (1/k - 1)).

    The terms fall so fast with k that the alternating sum loses no digits in the tail; where it cancels (below 0 dB) it
    keeps eleven.

    Args:
        sinr: Ratio of signal to interference plus noise, linear, at least 0; a number or an array of any shape.

    Returns:
        Bit error rates in [0, 0.5], of the same shape.
    """
    ratio = np.asarray(sinr, dtype=float)[..., np.newaxis]
    rate: NDArray[np.float64] = np.clip(np.sum(_COEFFICIENTS * np.exp(_EXPONENTS * ratio), axis=-1), 0.0, 0.5)
    return rate if isinstance(sinr, np.ndarray) else float(rate)


def frame_success_probability(sinr: FloatOrArray, bits: int) -> FloatOrArray:
    """Chance that all `bits` bits arrive at a constant SINR: (1 - BER)^bits.

    Args:
        sinr: Ratio of signal to interference plus noise, linear; a number or an array of any shape.
        bits: Number of bits, at least 0.

    Returns:
        Probabilities in [0, 1], of the same shape.
    """
    success: NDArray[np.float64] = np.exp(bits * np.log1p(-np.asarray(oqpsk_bit_error_rate(sinr))))
    return success if isinstance(sinr, np.ndarray) else float(success)


# The table is linear in the ratio, not in dB: ln(1 - BER) then falls by at most e^-10 a unit, so a step of 1/1024 keeps
# linear interpolation within (10/1024)^2 / 8 = 1.2e-5, and a look-up needs no logarithm.
_STEPS_PER_UNIT = 1024.0
_SATURATED = 6.5  # 8.1 dB, where the bit error rate is 2e-28
LOG_BIT_SUCCESS_RELATIVE_ERROR = 1.5e-5
"""Largest relative error of `log_bit_success` against the exact formula (below its saturation)."""

_LAST = int(_SATURATED * _STEPS_PER_UNIT)
_ARRAY: NDArray[np.float64] = np.log1p(-oqpsk_bit_error_rate(np.arange(_LAST + 1) / _STEPS_PER_UNIT))
_TABLE: list[float] = _ARRAY.tolist()


def log_bit_success(sinr_linear: float) -> float:
    """Natural logarithm of the chance that one bit is right, from a table: for the inner loop of the simulator.

    Args:
        sinr_linear: Ratio of signal to interference plus noise, linear, at least 0; infinity is allowed.

    Returns:
        ln(1 - BER): ln 0.5 at 0, exactly 0 from 8.1 dB up, elsewhere within `LOG_BIT_SUCCESS_RELATIVE_ERROR`.
    """
    place = sinr_linear * _STEPS_PER_UNIT
    if place >= _LAST:
        return 0.0
    index = int(place)
    low = _TABLE[index]
    return low + (place - index) * (_TABLE[index + 1] - low)


def log_bit_success_of(sinr: NDArray[np.float64]) -> NDArray[np.float64]:
    """`log_bit_success` of every entry of an array, from the same table."""
    place = np.minimum(sinr * _STEPS_PER_UNIT, _LAST - 1e-9)
    index = place.astype(np.intp)
    low = _ARRAY[index]
    found: NDArray[np.float64] = low + (place - index) * (_ARRAY[index + 1] - low)
    return np.where(sinr * _STEPS_PER_UNIT >= _LAST, 0.0, found)
