"""From what a node knows and reads to the vertices of the sensor-subregion hybrid model (Chen et al. 2006, eqs 17, 18).

The number z of a sensor's detections in a subregion with x targets is the sum of a binomial number of detected targets
and a Poisson number of false ones; the reading is Gaussian around the sum of all z.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import gammaln, pdtrc, xlogy

from netsim.kernels.counting_vertex import CountingVertex
from netsim.kernels.pairwise_vertex import PairwiseVertex
from netsim.kernels.semiring import FloatArray, log_normalise
from netsim.kernels.target_distribution import (
    CountingModel,
    DistributionInstance,
    DistributionKnowledge,
    Subregion,
)
from netsim.kernels.vertex import Vertex


def count_log_prior(model: CountingModel, subregion: Subregion) -> FloatArray:
    """Log prior of each possible number of targets: Poisson, cut to what is held possible; shape (counts,)."""
    mean = model.target_density_per_m2 * subregion.area_m2
    return log_normalise(_poisson_log(np.array(subregion.counts), mean))


def detection_log_edge(model: CountingModel, subregion: Subregion) -> FloatArray:
    """Log edge potential ln p(z | x), eq (18), shape (detections, counts).

    Detections run from 0 to the largest possible number of targets and as many false ones as leave a tail of at most
    `false_alarm_tail`; the false ones are scaled to sum to one over that range.
    """
    mean = model.false_alarm_density_per_m2 * subregion.area_m2
    return _log_edge(subregion.counts, model.detection_probability, mean, model.false_alarm_tail)


@lru_cache(maxsize=4096)
def _log_edge(counts: tuple[int, ...], detection_probability: float, false_mean: float, tail: float) -> FloatArray:
    most_false = 0
    while pdtrc(most_false, false_mean) > tail:
        most_false += 1
    false = np.exp(log_normalise(_poisson_log(np.arange(most_false + 1), false_mean)))
    columns = [np.convolve(_binomial(counts[-1], count, detection_probability), false) for count in counts]
    with np.errstate(divide="ignore"):
        edge = np.log(np.array(columns).T)
    edge.setflags(write=False)  # it is shared
    return np.asarray(edge)


def _poisson_log(counts: np.ndarray[Any, Any], mean: float) -> FloatArray:
    return np.asarray(xlogy(counts, mean) - mean - gammaln(counts + 1.0))


def _binomial(most: int, trials: int, probability: float) -> FloatArray:
    """Probabilities of 0, 1, ..., `most` successes in `trials`, which may be fewer."""
    hits = np.arange(most + 1)
    misses = np.maximum(trials - hits, 0)
    choices = gammaln(trials + 1.0) - gammaln(hits + 1.0) - gammaln(misses + 1.0)
    weights = np.exp(choices) * probability**hits * (1.0 - probability) ** misses
    return np.where(hits <= trials, weights, 0.0)


def subregion_vertex(model: CountingModel, subregion: Subregion) -> PairwiseVertex:
    """The number of targets in a subregion: node potential p(x), an edge to each sensor that covers it."""
    edge = detection_log_edge(model, subregion).T
    return PairwiseVertex(subregion.vertex, count_log_prior(model, subregion), dict.fromkeys(subregion.sensors, edge))


def sensor_vertex(knowledge: DistributionKnowledge, reading: float | None) -> CountingVertex:
    """The detections of a node's sensor.

    Args:
        knowledge: What the node knows.
        reading: What its sensor reads; None when it could not be read, which tells nothing.
    """
    model = knowledge.model
    edges = {subregion.vertex: detection_log_edge(model, subregion) for subregion in knowledge.subregions}
    totals = np.arange(1 + sum(len(edge) - 1 for edge in edges.values()))
    told = np.zeros(len(totals))
    if reading is not None:
        told -= (reading - totals) ** 2 / (2.0 * model.noise_variance)
    return CountingVertex(knowledge.sensor, edges, told)


def hosted_vertices(knowledge: DistributionKnowledge, reading: float | None) -> tuple[Vertex, ...]:
    """All the vertices that one node hosts: its sensor's, and those of some subregions, ascending."""
    subregions = (subregion_vertex(knowledge.model, subregion) for subregion in knowledge.hosted)
    return (sensor_vertex(knowledge, reading), *subregions)


def instance_vertices(instance: DistributionInstance) -> list[Vertex]:
    """All the vertices of a problem, ascending, built node by node as the nodes themselves would."""
    made = [
        vertex
        for sensor, reading in enumerate(instance.readings.tolist())
        for vertex in hosted_vertices(instance.knowledge(sensor), reading)
    ]
    return sorted(made, key=lambda vertex: vertex.id)
