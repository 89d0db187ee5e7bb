"""What both sides of a comparison share: layouts, frames, powers. No import but the standard library's."""

import hashlib
import math

GOLDEN_BER = {5: 7.383e-14, 2: 5.131e-7, -1: 1.14894e-3, -4: 3.91635e-2, -7: 0.175246}
"""Bit error rates at a signal to noise ratio in dB: ns-3's own test of its 802.15.4 error model."""

PER_PSDU_BYTE = 50
PER_BITS = 8 * (PER_PSDU_BYTE + 1)
"""The PSDU and the length octet before it; the preamble decides nothing."""
PER_SNR_DB = [-2.5 + 0.25 * step for step in range(20)]
NOISE_DBM = -95.4

PSDU_BYTE = 50
MAC_OVERHEAD_BYTE = 11
EXPONENT = 3.0
REFERENCE_LOSS_DB = 40.05
NS3_NOISE_DBM = -106.987
NS3_CCA_DBM = -96.58
WARM_UP_S = 1.0
NS3_DURATION_S = 30.0
NS3_RUNS = 10
SENDERS = [1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 20]
LAYOUTS = ["circle", "square"]
RADIUS_M = 10.0


def positions_m(layout: str, senders: int, run: int) -> list[tuple[float, float]]:
    """The receiver at (20, 20), then the senders: all in range of each other.

    `circle`: 10 m from the receiver, so that every signal arrives equally strong; `square`: uniform over 20 m by 20 m
    around it, at least 1 m away, another draw for each run.
    """
    centre = (20.0, 20.0)
    if layout == "circle":
        angles = [2.0 * math.pi * index / senders for index in range(senders)]
        return [centre, *((20.0 + RADIUS_M * math.cos(a), 20.0 + RADIUS_M * math.sin(a)) for a in angles)]
    found: list[tuple[float, float]] = []
    draw = 0
    while len(found) < senders:
        digest = hashlib.blake2b(f"{layout}/{senders}/{run}/{draw}".encode(), digest_size=8).digest()
        x, y = (int.from_bytes(half, "little") / 2**32 for half in (digest[:4], digest[4:]))
        place, draw = (10.0 + 20.0 * x, 10.0 + 20.0 * y), draw + 1
        if math.dist(place, centre) >= 1.0:
            found.append(place)
    return [centre, *found]
