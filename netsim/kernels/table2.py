"""What tracking costs by the formulas of Table 2 (Liu, Reich, Zhao 2002): orders of growth, evaluated with factors of one.

Power is proportional to the distance raised to the attenuation exponent, here 2, the least that the paper allows, as for an
amplifier in free space with power control; whatever else a radio draws is neglected, as in the table.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from netsim.kernels.semiring import FloatArray

ATTENUATION: Final = 2.0
AMPLIFIER_J_PER_BIT_M2: Final = 10e-12
"""Of the first-order radio model (Heinzelman, Chandrakasan, Balakrishnan 2002, eps_fs)."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one step, or of several.

    Attributes:
        operations: Cells of the belief visited.
        bit: Bits communicated.
        joules: Energy that the amplifiers put into the air.
    """

    operations: float = 0.0
    bit: float = 0.0
    joules: float = 0.0

    def __add__(self, other: "Cost") -> "Cost":
        """Both."""
        return Cost(self.operations + other.operations, self.bit + other.bit, self.joules + other.joules)


def distributed(cells: int, neighbours: int, belief_bit: float, handoff_m: float) -> Cost:
    """A step of the leader-based tracker.

    Args:
        cells: Size of the belief.
        neighbours: Among how many the leader chose.
        belief_bit: What was handed over.
        handoff_m: Distance from leader to next leader.
    """
    return Cost(float(neighbours * cells), belief_bit, _joules(belief_bit, np.array([handoff_m])))


def centralised(cells: int, told_bit: float, distances_m: FloatArray) -> Cost:
    """A step in which every sensor tells the centre something, with readings that are independent given the place (eq 4).

    Args:
        cells: Size of the belief.
        told_bit: What each sensor tells: in the table as much as a belief.
        distances_m: From each sensor to the centre.
    """
    sensors = len(distances_m)
    return Cost(float(sensors * cells), sensors * told_bit, _joules(told_bit, distances_m))


def _joules(bit: float, distances_m: FloatArray) -> float:
    return AMPLIFIER_J_PER_BIT_M2 * bit * float((distances_m**ATTENUATION).sum())
