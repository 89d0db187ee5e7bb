"""Exact marginals of a recorded model: the oracle beside a distributed result."""

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
