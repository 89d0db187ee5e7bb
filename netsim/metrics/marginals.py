"""Exact marginals of a recorded model, the oracle beside a distributed result, and how far that is from it."""

import numpy as np

from netsim.kernels.factor_graph import exact_marginals
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.semiring import FloatArray, Semiring


def exact_marginals_of(instance_json: str, semiring: Semiring) -> list[FloatArray]:
    """Marginals (sum) or normalised max-marginals (max) of every variable, as probabilities.

    Raises:
        ScenarioError: If the model is beyond reach: the message gives its size.
    """
    graph = GraphInstance.from_json(instance_json).graph
    return [np.asarray(np.exp(belief)) for belief in exact_marginals(graph, semiring)]


def divergence_nat(exact: FloatArray, belief: FloatArray) -> float:
    """Kullback-Leibler divergence D(exact || belief) in nats; infinity where the belief rules out what is possible."""
    some = exact > 0
    with np.errstate(divide="ignore"):
        divergence = np.sum(exact[some] * (np.log(exact[some]) - np.log(belief[some])))
        return max(0.0, float(divergence))  # rounding can make it a little negative
