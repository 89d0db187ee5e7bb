"""The association variable of a target that three or more sensors cover (Chen et al. 2006, eq 14)."""

from collections.abc import Mapping

from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.semiring import FloatArray


class TargetVertex(FactorVertex):
    """The association variable of one target: which measurement of each covering sensor is its own.

    Its consistency with the sensors' variables (eq 15) makes it a factor over their choices for this target: a message
    has one entry for "missed" and one for each of the sensor's measurements.

    Args:
        id: Its number in the model.
        target: The target's number.
        table: Log evidence of each joint hypothesis, one axis for each covering sensor, shape (q_1 + 1, ...).
        multiplicities: For each covering sensor, how many of its associations give the target each of its measurements,
            shape (q + 1,). The keys in ascending order are the axes.
    """

    def __init__(self, id: int, target: int, table: FloatArray, multiplicities: Mapping[int, FloatArray]) -> None:
        super().__init__(id, sorted(multiplicities), table)
        self.target = target
        self._multiplicities = dict(multiplicities)

    def multiplicity(self, neighbour: int) -> FloatArray:
        """How many associations of that sensor agree with each entry."""
        return self._multiplicities[neighbour]
