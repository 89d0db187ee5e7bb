"""From measurements to the vertices of the sensor-target hybrid model (Chen et al. 2006, eqs 8, 9, 14-16).

A node builds its vertices from its own measurements and those of the sensors it shares targets with, nothing else.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from netsim.kernels.association_likelihood import false_alarm_log_density, log_evidence
from netsim.kernels.association_model import AssociationInstance, AssociationKnowledge, CoveredTarget, SensorModel
from netsim.kernels.injections import count_injections, injections, left_over
from netsim.kernels.semiring import FloatArray
from netsim.kernels.sensor_vertex import SensorVertex, SharedEvidence, TargetGroup
from netsim.kernels.target_vertex import TargetVertex
from netsim.kernels.vertex import Vertex

Measured = Mapping[int, FloatArray]
"""Position measurements in metres by sensor, each of shape (q, 2)."""


def log_or_never(probability: float) -> float:
    """Logarithm of a probability; -inf for 0."""
    return float(np.log(probability)) if probability > 0.0 else -np.inf


def false_alarm_log_weights(model: SensorModel, most: int) -> FloatArray:
    """Log potential of 0, 1, ..., `most` false alarms at a sensor, their densities included (eq 16)."""
    count = np.arange(most + 1)
    density = false_alarm_log_density(model.detection_radius_m)
    each = log_or_never(model.false_alarm_probability) + density
    if model.false_alarms == "geometric":
        return np.array([0.0, *(count[1:] * each)])
    weights = np.full(most + 1, -np.inf)
    weights[:2] = [log_or_never(1.0 - model.false_alarm_probability), each][: most + 1]
    return weights


def detection_log_weights(model: SensorModel, targets: int) -> FloatArray:
    """Log potential of 0, 1, ..., `targets` of that many targets being detected (eq 16)."""
    hit, miss = log_or_never(model.detection_probability), log_or_never(1.0 - model.detection_probability)
    return np.array(
        [(hit if n else 0.0) * n + (miss if n < targets else 0.0) * (targets - n) for n in range(targets + 1)]
    )


def sensor_vertex(knowledge: AssociationKnowledge, own_m: FloatArray, others_m: Measured) -> SensorVertex:
    """The association variable of a sensor.

    Args:
        knowledge: What its node knows.
        own_m: Its own measurements, shape (q, 2).
        others_m: Measurements of every sensor in `knowledge.partners`.

    Raises:
        ScenarioError: When the tables would not fit in memory.
    """
    measured = {**others_m, knowledge.sensor: own_m}
    groups = [
        *(_shared_group(knowledge, measured, neighbour, members) for neighbour, members in _edges(knowledge)),
        *(_exclusive_group(knowledge, own_m, covered) for covered in knowledge.targets if len(covered.sensors) == 1),
    ]
    unassigned = false_alarm_log_weights(knowledge.model, len(own_m))[left_over(len(own_m))]
    return SensorVertex(knowledge.sensor, groups, unassigned)


def _edges(knowledge: AssociationKnowledge) -> list[tuple[int, list[CoveredTarget]]]:
    """Neighbouring vertices, ascending, each with the targets shared through it."""
    members: dict[int, list[CoveredTarget]] = {}
    for covered in knowledge.targets:
        if covered.vertex is not None:
            members[covered.vertex] = [covered]
        elif len(covered.sensors) == 2:
            members.setdefault(sum(covered.sensors) - knowledge.sensor, []).append(covered)
    return sorted(members.items())


def _shared_group(
    knowledge: AssociationKnowledge, measured: Measured, neighbour: int, members: Sequence[CoveredTarget]
) -> TargetGroup:
    """The targets behind one edge, to another sensor or to a target's vertex."""
    here = injections(len(members), len(measured[knowledge.sensor]))
    local = detection_log_weights(knowledge.model, len(members))[here.used]
    targets = tuple(covered.target for covered in members)
    if members[0].vertex is not None:
        states = _target_states(knowledge, measured, members[0])
        return TargetGroup(targets, neighbour, here, local, None, np.full(len(here.states), states))
    there = injections(len(members), len(measured[neighbour]))
    points = [measured[knowledge.sensor], measured[neighbour]]
    edge = SharedEvidence(tuple(evidence(knowledge.model, covered, points) for covered in members), there)
    counts = _counts(knowledge.covered[neighbour] - len(members), len(measured[neighbour]))
    return TargetGroup(targets, neighbour, here, local, edge, counts[there.used])


def _exclusive_group(knowledge: AssociationKnowledge, own_m: FloatArray, covered: CoveredTarget) -> TargetGroup:
    here = injections(1, len(own_m))
    local = detection_log_weights(knowledge.model, 1)[here.used] + evidence(knowledge.model, covered, [own_m])
    return TargetGroup((covered.target,), None, here, local, None, np.zeros(0))


def _counts(targets: int, measurements: int) -> FloatArray:
    """How many ways remain for `targets` other targets when 0, 1, ... of a sensor's measurements are used."""
    return np.array([count_injections(targets, measurements - used) for used in range(measurements + 1)], dtype=float)


def _target_states(knowledge: AssociationKnowledge, measured: Measured, covered: CoveredTarget) -> float:
    """How many states of a target's vertex agree with one measurement of this sensor."""
    return float(np.prod([len(measured[sensor]) + 1.0 for sensor in covered.sensors if sensor != knowledge.sensor]))


def evidence(model: SensorModel, covered: CoveredTarget, measurements_m: Sequence[FloatArray]) -> FloatArray:
    """Log evidence of every joint hypothesis about a target, one axis a sensor (see `log_evidence`)."""
    mean_m, covariance_m2 = np.array(covered.mean_m), np.array(covered.covariance_m2)
    return log_evidence(mean_m, covariance_m2, np.array(model.noise_m2), measurements_m)


def target_vertex(knowledge: AssociationKnowledge, target: int, own_m: FloatArray, others_m: Measured) -> TargetVertex:
    """The association variable of a target that three or more sensors cover.

    Args:
        knowledge: What the node that hosts it knows; its sensor covers the target.
        target: The target's number.
        own_m: Measurements of the hosting node's sensor.
        others_m: Measurements of (at least) the other sensors that cover the target.

    Raises:
        ScenarioError: When the table would not fit in memory.
    """
    covered = next(each for each in knowledge.targets if each.target == target and each.vertex is not None)
    measured = {**others_m, knowledge.sensor: own_m}
    table = evidence(knowledge.model, covered, [measured[sensor] for sensor in covered.sensors])
    multiplicities = {}
    for sensor in covered.sensors:
        used = np.minimum(np.arange(len(measured[sensor]) + 1), 1)
        multiplicities[sensor] = _counts(knowledge.covered[sensor] - 1, len(measured[sensor]))[used]
    return TargetVertex(covered.vertex, target, table, multiplicities)  # type: ignore[arg-type]  # filtered above


def hosted_vertices(
    knowledge: AssociationKnowledge, own_m: FloatArray, others_m: Measured
) -> tuple[SensorVertex, list[TargetVertex]]:
    """All the vertices that one node hosts: its sensor's, and those of some targets, ascending."""
    targets = [target_vertex(knowledge, covered.target, own_m, others_m) for covered in knowledge.hosted]
    return sensor_vertex(knowledge, own_m, others_m), targets


def instance_vertices(instance: AssociationInstance) -> list[Vertex]:
    """All the vertices of a problem's hybrid model, ascending, built node by node as the nodes themselves would."""
    instance = instance.as_hybrid()
    made: list[Vertex] = []
    for sensor, own_m in enumerate(instance.measurements_m):
        knowledge = instance.knowledge(sensor)
        others_m = {other: instance.measurements_m[other] for other in knowledge.partners}
        associated, targets = hosted_vertices(knowledge, own_m, others_m)
        made += [associated, *targets]
    return sorted(made, key=lambda vertex: vertex.id)
