"""Exact marginals of the numbers of targets, where these can be computed: the oracle beside sum-product's.

A sensor's detections are summed out first (they depend on the numbers of targets alone), the numbers by elimination.
"""

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.counting_model import count_log_prior, detection_log_edge
from netsim.kernels.factor_graph import Factor, FactorGraph, exact_marginals
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.target_distribution import DistributionInstance

LARGEST_TABLE = 2_000_000
"""Entries of the largest table for one sensor: numbers of targets in all its subregions, times their total."""


def exact_counts(instance: DistributionInstance) -> list[FloatArray]:
    """The marginal of each subregion's number of targets: log domain, normalised.

    Raises:
        ScenarioError: Where a sensor covers too much or the elimination would need too large a table; the message gives
            its size.
    """
    first = len(instance.sensor_nodes)
    factors = [
        Factor((number,), np.exp(count_log_prior(instance.model, subregion)))
        for number, subregion in enumerate(instance.subregions)
    ]
    for sensor, covered in enumerate(instance.subregions_of):
        if covered:
            scope = tuple(subregion.vertex - first for subregion in covered)
            factors.append(Factor(scope, _likelihood(instance, sensor)))
    cardinalities = tuple(len(subregion.counts) for subregion in instance.subregions)
    return exact_marginals(FactorGraph(cardinalities, tuple(factors)), Semiring.SUM)


def _likelihood(instance: DistributionInstance, sensor: int) -> FloatArray:
    """Likelihood of a sensor's reading by the numbers of targets in its subregions, in their order, up to a factor."""
    edges = [np.exp(detection_log_edge(instance.model, covered)) for covered in instance.subregions_of[sensor]]
    totals = 1 + sum(len(edge) - 1 for edge in edges)
    entries = totals * int(np.prod([edge.shape[1] for edge in edges], dtype=float))
    if entries > LARGEST_TABLE:
        text = f"the exact likelihood of sensor {sensor} needs a table of {entries:,} entries, over {LARGEST_TABLE:,}"
        raise ScenarioError(text)
    chances = np.ones(1)
    for edge in edges:
        chances = _with_another(chances, edge)
    log_reading = -((instance.readings[sensor] - np.arange(totals)) ** 2) / (2.0 * instance.model.noise_variance)
    return np.asarray(np.tensordot(np.exp(log_reading - log_reading.max()), chances, axes=1))


def _with_another(chances: FloatArray, edge: FloatArray) -> FloatArray:
    """Chances of a total (first axis) by numbers of targets (the other axes), with those of one more subregion."""
    size = len(chances)
    wider = np.zeros((size + len(edge) - 1, *chances.shape[1:], edge.shape[1]))
    for detections, row in enumerate(edge):
        wider[detections : detections + size] += chances[..., None] * row
    return wider
