"""The vertices of a data-association problem in whichever graphical model it uses, and decisions from what they claim."""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import linear_sum_assignment

from netsim.kernels.association_model import AssociationInstance, AssociationKnowledge
from netsim.kernels.association_vertices import Measured, hosted_vertices
from netsim.kernels.cluster_vertex import cluster_vertices
from netsim.kernels.injections import IntArray
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.target_choice_vertex import target_choice_vertices
from netsim.kernels.vertex import Vertex

_NEVER = -1e12
"""Stands for the logarithm of 0 in an assignment, which must stay finite."""


def model_vertices(knowledge: AssociationKnowledge, own_m: FloatArray, others_m: Measured) -> list[Vertex]:
    """The vertices that a node hosts, ascending, from its own measurements and its partners'.

    Raises:
        ScenarioError: When they cannot be built (see the builders of each model).
    """
    measured = {**others_m, knowledge.sensor: own_m}
    if knowledge.graph == "target":
        return list(target_choice_vertices(knowledge, measured))
    if knowledge.graph == "sensor":
        return list(cluster_vertices(knowledge, measured))
    sensor, targets = hosted_vertices(knowledge, own_m, others_m)
    return [sensor, *targets]


def graph_vertices(instance: AssociationInstance) -> list[Vertex]:
    """All the vertices of a problem, ascending, built node by node as the nodes themselves would."""
    made: list[Vertex] = []
    for sensor, own_m in enumerate(instance.measurements_m):
        knowledge = instance.knowledge(sensor)
        others_m = {other: instance.measurements_m[other] for other in knowledge.partners}
        made += model_vertices(knowledge, own_m, others_m)
    return sorted(made, key=lambda vertex: vertex.id)


def decide_by_claims(claims: Mapping[int, FloatArray], measurements: int, semiring: Semiring) -> IntArray:
    """A sensor's decision from what the vertices of its targets say of its measurements.

    With `SUM` the consistent assignment with the most probably right measurements in expectation. With `MAX` every target
    gets its best measurement; where two want the same one, the measurements go where the product of the targets'
    max-marginals is largest.

    Args:
        claims: For each target the (max-)marginal of missed and of each measurement, shape (measurements + 1,).
        measurements: How many measurements the sensor has.
        semiring: What the claims are.

    Returns:
        Target number per measurement, -1 for a false alarm, shape (measurements,).
    """
    targets = sorted(target for target, row in claims.items() if len(row) == measurements + 1)
    decision = np.full(measurements, -1, dtype=np.int64)
    if not targets or not measurements:
        return decision
    table = np.array([claims[target] for target in targets])
    if semiring is Semiring.SUM:
        alarm = np.maximum(0.0, 1.0 - table[:, 1:].sum(axis=0))
        gains = np.hstack([table[:, 1:].T, np.repeat(alarm[:, None], measurements, axis=1)])
        rows, columns = linear_sum_assignment(gains, maximize=True)
    else:
        with np.errstate(divide="ignore"):
            scores = np.maximum(np.log(table), _NEVER)
        missed = np.repeat(scores[:, :1], len(targets), axis=1)
        columns, rows = linear_sum_assignment(np.hstack([scores[:, 1:], missed]), maximize=True)
    names = np.append(np.array(targets), np.full(measurements, -1))
    for row, column in zip(rows, columns, strict=True):
        if row < measurements:
            decision[row] = names[column]
    return decision
