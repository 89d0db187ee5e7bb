"""Conversions between the units of the scenario file (s, dBm) and those of the simulation (ns, mW).

Below the scenario file time is an integer number of nanoseconds; physics inside a function uses SI floats.
"""

import math

NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000
NS_PER_US = 1_000


def s_to_ns(time_s: float) -> int:
    """Seconds to the nearest whole nanosecond."""
    return round(time_s * NS_PER_S)


def dbm_to_mw(power_dbm: float) -> float:
    """Decibel-milliwatts to milliwatts; -inf dBm is 0 mW."""
    return float(10.0 ** (power_dbm / 10.0))


def mw_to_dbm(power_mw: float) -> float:
    """Milliwatts to decibel-milliwatts; 0 mW is -inf dBm."""
    return 10.0 * math.log10(power_mw) if power_mw > 0.0 else -math.inf


def energy_j(power_mw: float, time_ns: int) -> float:
    """Joules drawn by a constant power over a time."""
    return power_mw * time_ns * 1e-12
