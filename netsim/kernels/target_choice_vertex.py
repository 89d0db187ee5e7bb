"""The target-oriented model of data association (Chen et al. 2006, section 3.2.2, eqs 11-13).

One variable for every covered target: which measurement of each covering sensor is its own. The number of false alarms would
tie all targets of a sensor together; the model is pairwise only where every false alarm weighs the same factor. Then a
measurement that a target takes gains the inverse of it, and two targets that share a sensor must not take the same one.
"""

from collections.abc import Sequence

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_model import AssociationKnowledge, CoveredTarget, SensorModel
from netsim.kernels.association_vertices import (
    Measured,
    detection_log_weights,
    evidence,
    false_alarm_log_weights,
)
from netsim.kernels.injections import IntArray, check_states
from netsim.kernels.listed_vertex import ClassEdge, Classes, ListedVertex
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vertex import along


def check_pairwise(model: SensorModel) -> None:
    """Refuse what the target-oriented model cannot express.

    Raises:
        ScenarioError: When false alarms do not each weigh a positive factor.
    """
    if model.false_alarms != "geometric":
        text = (
            "model: target is pairwise only with false_alarms: geometric, got false_alarms: strict (at most one false alarm "
            "ties all targets of a sensor): set false_alarms: geometric, or model: hybrid"
        )
        raise ScenarioError(text)
    if model.false_alarm_probability == 0.0:
        text = "model: target needs a false_alarm_probability above 0, got 0: set it, or model: hybrid"
        raise ScenarioError(text)


def target_choice_vertices(knowledge: AssociationKnowledge, measured: Measured) -> list[ListedVertex]:
    """The vertices of the targets that a node hosts, ascending.

    Args:
        knowledge: What the node knows.
        measured: Measurements of its own sensor and of all that cover one of those targets.

    Raises:
        ScenarioError: When the model cannot be built: strict false alarms, or too many states.
    """
    check_pairwise(knowledge.model)
    every = sorted((*knowledge.targets, *knowledge.wider), key=lambda covered: covered.target)
    return [_vertex(knowledge.model, covered, every, measured) for covered in knowledge.hosted]


def _vertex(
    model: SensorModel, covered: CoveredTarget, every: Sequence[CoveredTarget], measured: Measured
) -> ListedVertex:
    table = evidence(model, covered, [measured[sensor] for sensor in covered.sensors])
    missed, detected = detection_log_weights(model, 1)
    false_alarm = float(false_alarm_log_weights(model, 1)[1])
    for axis, size in enumerate(table.shape):
        table = table + along(np.where(np.arange(size) > 0, detected - false_alarm, missed), axis, table.ndim)
    states = np.indices(table.shape).reshape(table.ndim, -1).T
    edges = {
        other.vertex: _edge(covered, shared, states, measured)
        for other in every
        if other is not covered and (shared := sorted(set(covered.sensors) & set(other.sensors)))
    }
    scope = tuple((sensor, covered.target) for sensor in covered.sensors)
    return ListedVertex(covered.vertex, scope, states, table.ravel(), edges, table.shape)  # type: ignore[arg-type]  # all have one


def _edge(covered: CoveredTarget, shared: Sequence[int], states: IntArray, measured: Measured) -> ClassEdge:
    """No measurement of a shared sensor for both (eq 13)."""
    grid = tuple(len(measured[sensor]) + 1 for sensor in shared)
    entries = int(np.prod(grid))
    check_states(entries * max(grid), f"the choices of sensors shared by target {covered.target} and another")
    classes = Classes(grid, np.arange(entries))
    columns = [covered.sensors.index(sensor) for sensor in shared]
    tables = tuple(_exclusive(size) for size in grid)
    return ClassEdge(classes, classes, tables, True, classes.of(states[:, columns]), np.ones(entries))


def _exclusive(size: int) -> FloatArray:
    table = np.zeros((size, size))
    taken = np.arange(1, size)
    table[taken, taken] = -np.inf
    return table
