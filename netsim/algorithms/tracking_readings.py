"""A node's own reading, and readings on the air: two bytes of the step, then the number."""

import math

import numpy as np

from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.codec import FloatWidth, Record, decode_floats, encode_floats
from netsim.kernels.beamformer import reading_of, reading_operations
from netsim.kernels.tracking_model import TrackingKnowledge

STEPS = 1 << 16
_STEP = Record("H")


def own_reading(node: NodeHandle, knowledge: TrackingKnowledge) -> Op[float | None]:
    """Read the node's sensor, and pay for making a reading of what it gives.

    Returns:
        The reading, NaN where the sensor gave none; None where the node's energy allowance does not suffice.
    """
    try:
        observation = yield from node.sense()
        yield from node.compute(reading_operations(observation.values, knowledge.processing))
    except NoEnergyError:
        return None
    return reading_of(observation.values, knowledge.processing)


def encode_reading(step: int, reading: float, width: FloatWidth) -> bytes:
    """A reading of a step; the step is told modulo 65,536."""
    return _STEP.pack(step % STEPS) + encode_floats([reading], width)


def decode_reading(data: bytes, width: FloatWidth) -> tuple[int, float]:
    """Step, modulo 65,536, and reading.

    Raises:
        struct.error: If it is too short for a step.
        ValueError: If no single finite number follows.
    """
    (step,) = _STEP.unpack(data)
    with np.errstate(invalid="ignore"):  # signalling NaN, refused below
        (reading,) = decode_floats(data[_STEP.size_byte :], width).tolist()
    if not math.isfinite(reading):
        message = f"a reading that is no number: {reading}"
        raise ValueError(message)
    return int(step), float(reading)
