"""All readings of one instant in one belief: centralised Bayesian tracking (Liu, Reich, Zhao 2002, section 2.2)."""

from collections.abc import Iterator, Mapping

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.gating import tail_probability
from netsim.kernels.grid_belief import Grid, GridBelief, condition, pruned, uniform, update_operations
from netsim.kernels.idsq import Filter
from netsim.kernels.semiring import FloatArray


def joint_log_likelihood(
    sensors: Mapping[int, SensorSpec], readings: Mapping[int, float], points_m: FloatArray
) -> FloatArray:
    """Logarithm of the likelihood of several readings, independent given the place (eq 4).

    Args:
        sensors: The sensors, by node.
        readings: Their readings, by node; summed up in the order of the nodes, so that the last bit does not depend on which
            came first.
        points_m: Places, shape (n, 2).

    Returns:
        For each place, shape (n,).
    """
    total = np.zeros(len(points_m))
    for node in sorted(readings):
        total += sensors[node].log_likelihood(readings[node], points_m)
    return total


def fused(
    predicted: GridBelief, sensors: Mapping[int, SensorSpec], readings: Mapping[int, float], least_probability: float
) -> GridBelief:
    """The belief after several readings of one instant (eq 3 with eq 4), without the cells below a probability."""
    after, _ = condition(predicted, joint_log_likelihood(sensors, readings, predicted.centres_m))
    return pruned(after, least_probability)


def updated_by(
    predicted: GridBelief,
    sensors: Mapping[int, SensorSpec],
    readings: Mapping[int, float],
    filtering: Filter,
    *,
    gated: bool = True,
) -> tuple[GridBelief, frozenset[int]]:
    """The belief after several readings of one instant, and whose were used: if `gated`, all but outliers."""
    refuses = gated and filtering.gate > 0.0
    used = {
        node: reading
        for node, reading in readings.items()
        if not refuses or tail_probability(predicted, sensors[node], reading) >= filtering.gate
    }
    return fused(predicted, sensors, used, filtering.least_probability) if used else predicted, frozenset(used)


def fusion_operations(predicted: GridBelief, sensors: Mapping[int, SensorSpec], readings: Mapping[int, float]) -> int:
    """Elementary floating-point operations of `fused`: O(K belief), as in Table 2."""
    return likelihoods_operations(predicted, sensors, readings) + update_operations(len(predicted.cells))


def likelihoods_operations(
    predicted: GridBelief, sensors: Mapping[int, SensorSpec], readings: Mapping[int, float]
) -> int:
    """Of `joint_log_likelihood` alone."""
    cells = len(predicted.cells)
    return sum(sensors[node].likelihood_operations(cells) + cells for node in readings)


def centralised(
    grid: Grid, sensors: Mapping[int, SensorSpec], readings: Iterator[Mapping[int, float]], filtering: Filter
) -> Iterator[GridBelief]:
    """The belief after each instant, from a uniform one on: what a centre finds that is told every reading at once.

    Args:
        grid: Cells of the belief.
        sensors: All sensors, by node.
        readings: At each instant, by node.
        filtering: How the belief is predicted, and which cells are dropped.
    """
    belief = uniform(grid)
    for told in readings:
        belief = fused(filtering.predicted(belief, 1), sensors, told, filtering.least_probability)
        yield belief
