"""Equally weighted particles as bytes: each distinct one once, with how often it occurs.

Systematic resampling copies what explains the readings: of a belief just drawn few particles are distinct, often a single
one. Their order means nothing, so they go out in that of their coordinates.
"""

import numpy as np

from netsim.codec import FloatWidth, decode_count, decode_floats, encode_count, encode_floats, size_byte
from netsim.kernels.semiring import FloatArray


def encode_particles(positions_m: FloatArray, width: FloatWidth) -> tuple[bytes, int, bool]:
    """Particles, each once with its count; where that takes more bytes, all of them and no counts.

    Args:
        positions_m: Shape (P, M, 2).
        width: Precision of coordinates; what is equal at that precision is one particle.

    Returns:
        The bytes, how many particles they name, and whether these have counts.
    """
    count, targets, _ = positions_m.shape
    sent_m = decode_floats(encode_floats(positions_m, width), width).reshape(count, 2 * targets)
    distinct_m, copies = np.unique(sent_m + 0.0, axis=0, return_counts=True)  # of -0.0 and 0.0 the latter
    counted = encode_floats(distinct_m, width) + b"".join(map(encode_count, copies.tolist()))
    if len(counted) < size_byte(sent_m.size, width):
        return counted, len(distinct_m), True
    return encode_floats(np.repeat(distinct_m, copies, axis=0), width), count, False


def decode_particles(data: bytes, named: int, has_counts: bool, targets: int, width: FloatWidth) -> FloatArray:
    """The particles that `encode_particles` laid out, in ascending order of their coordinates, shape (P, M, 2).

    Args:
        data: The bytes.
        named: How many particles they name.
        has_counts: Whether these have counts.
        targets: M.
        width: Precision of coordinates.
    """
    end = size_byte(2 * targets * named, width)
    positions_m = decode_floats(data[:end], width).reshape(named, targets, 2)
    if not has_counts:
        return positions_m
    copies = []
    for _ in range(named):
        each, end = decode_count(data, end)
        copies.append(each)
    return np.repeat(positions_m, copies, axis=0)
