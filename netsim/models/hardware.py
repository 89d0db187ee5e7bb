"""How nodes of one make differ: each one's transmitter and receiver lie some dB off what the data sheet says.

Model: output power and noise floor of a node are jointly normal (Zuniga and Krishnamachari, ACM TOSN 3(2), 2007). The
output power makes links asymmetric: the two directions of a pair differ by the difference of their senders.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from netsim.rng import Streams

Floats = NDArray[np.float64]
Covariance = tuple[tuple[float, float], tuple[float, float]]


class HardwareOffsets(NamedTuple):
    """How far each node lies off the nominal.

    Attributes:
        noise_db: (N,) of its noise floor.
        power_db: (N,) of its output power.
    """

    noise_db: Floats
    power_db: Floats


def is_covariance(covariance: Covariance) -> bool:
    """Whether a matrix is symmetric, with variances of at least 0 that allow its covariance."""
    (noise, both), (again, power) = covariance
    return both == again and noise >= 0.0 and power >= 0.0 and both * both <= noise * power * (1.0 + 1e-12)


def hardware_offsets(node_ids: Sequence[int], covariance: Covariance | None, streams: Streams) -> HardwareOffsets:
    """Draw every node's offsets, each from its own stream `node/<id>/hardware`.

    Args:
        node_ids: The nodes.
        covariance: Of (noise floor, output power), in dB^2; see `is_covariance`. None: no node is off.
        streams: The run's random streams.
    """
    if covariance is None:
        return HardwareOffsets(np.zeros(len(node_ids)), np.zeros(len(node_ids)))
    normal = np.array([streams.generator(f"node/{node}/hardware").standard_normal(2) for node in node_ids])
    (noise, both), (_, power) = covariance
    noise_sd = math.sqrt(noise)
    slope = both / noise_sd if noise_sd else 0.0
    rest = math.sqrt(max(0.0, power - slope**2))
    first, second = normal.reshape(-1, 2).T
    return HardwareOffsets(noise_sd * first, slope * first + rest * second)
