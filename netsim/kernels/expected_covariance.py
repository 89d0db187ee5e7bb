"""How wide a belief is expected to be after a sensor's next reading: the rule that minimises the error, not the entropy.

The reading is put on the same grid as for mutual information (`netsim.kernels.information`), so that both rules judge the
same readings.
"""

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.information import reading_table, table_operations, table_shape
from netsim.kernels.semiring import FloatArray


def expected_variance_m2(belief: GridBelief, sensor: SensorSpec, *, exact: bool = False) -> float:
    """E[tr Cov(x|z)] over the sensor's next reading z: the mean squared error to come of the estimate of eq 2.

    With y = x - E[x] it is E|y|^2 - sum over z of |E[y 1{z}]|^2 / p(z) (the law of total variance), between 0 and the
    belief's own variance. On the grid of the reading it is exact for the table p(z|x): of every cell of the belief, or of
    the scalar that stands for it (Liu, Reich, Zhao 2002, section 4.3). Chu, Haussecker, Zhao 2002 name the covariance as a
    measure of utility for beliefs of one mode.

    Args:
        belief: Of the position at the time of the reading, before it.
        sensor: The sensor.
        exact: See `netsim.kernels.information`.
    """
    table = reading_table(belief, sensor, exact=exact)
    return posterior_variance_m2(belief, table.row, table.conditional)


def posterior_variance_m2(belief: GridBelief, row: np.ndarray, conditional: FloatArray) -> float:
    """The expected trace for any table of readings.

    Args:
        belief: Before the reading.
        row: The row that stands for each cell, shape (cells,).
        conditional: Probabilities of the readings, shape (rows, m); rows sum to one.
    """
    offsets_m = belief.centres_m - belief.mean_m
    moments = (belief.probability, *(belief.probability * axis for axis in offsets_m.T))
    by_row = np.stack([np.bincount(row, weights=moment, minlength=len(conditional)) for moment in moments])
    marginal, x_m, y_m = by_row @ conditional
    told = marginal > 0.0
    explained_m2 = float(((x_m[told] ** 2 + y_m[told] ** 2) / marginal[told]).sum())
    return min(max(belief.variance_m2 - explained_m2, 0.0), belief.variance_m2)


def variance_operations(belief: GridBelief, sensor: SensorSpec, *, exact: bool = False) -> int:
    """Elementary floating-point operations of `expected_variance_m2` on a node.

    Those of the table; three products and sums for every entry that is used, three moments for every cell of the belief,
    and two squares, a division and two sums for every cell of the reading.
    """
    rows, columns = table_shape(belief, sensor, exact=exact)
    return table_operations(belief, sensor, exact=exact) + 6 * rows * columns + 7 * len(belief.cells) + 6 * columns
