"""Exact marginals of data association: the probability of each origin of each measurement, by variable elimination.

The joint of Chen et al. 2006 (eqs 6 and 16) over one variable a sensor and covered target: which of the sensor's
measurements is the target's, 0 for a miss. A target ties its variables by the evidence of the joint hypothesis, a sensor
ties its own by exclusion and by the number of measurements left over. Split like that, tables stay far smaller than over the
whole associations of the sensors.
"""

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.assignment import hypothesis_table
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import false_alarm_log_weights
from netsim.kernels.elimination import Table, elimination_order, largest_table, marginals
from netsim.kernels.factor_graph import STATE_SPACE_LIMIT
from netsim.kernels.semiring import FloatArray, Semiring, log_normalise
from netsim.kernels.vertex import along

Variables = dict[tuple[int, int], int]
"""Number of the variable of each (sensor, covered target)."""


def exact_origins(instance: AssociationInstance, state_space_limit: int = STATE_SPACE_LIMIT) -> list[FloatArray]:
    """For each sensor the probability of each origin of its measurements.

    Args:
        instance: The problem.
        state_space_limit: Largest table that may be built, in entries.

    Returns:
        Shape (measurements, covered targets + 1) each, rows sum to one: the targets ascending, then a false alarm.

    Raises:
        ScenarioError: When a table would exceed the limit, or no association is possible.
    """
    variables: Variables = {}
    for sensor, targets in enumerate(instance.targets_of):
        variables.update({(sensor, target): len(variables) + place for place, target in enumerate(targets)})
    _check(max(_sizes(instance), default=1.0), state_space_limit)
    tables = [*_of_targets(instance, variables), *_of_sensors(instance, variables)]
    order = elimination_order(tables)
    _check(largest_table(tables, order), state_space_limit)
    found = marginals(tables, order, Semiring.SUM)
    return [_origins(instance, sensor, variables, found) for sensor in range(len(instance.sensor_nodes))]


def _check(entries: float, limit: int) -> None:
    if entries > limit:
        text = f"exact association marginals need a table of {entries:.3g} entries, more than the limit of {limit}"
        raise ScenarioError(text)


def _sizes(instance: AssociationInstance) -> list[float]:
    """Entries of each table of the model, before any is built."""
    states = [len(points) + 1.0 for points in instance.measurements_m]
    by_sensor = [size ** len(targets) for size, targets in zip(states, instance.targets_of, strict=True)]
    return by_sensor + [float(np.prod([states[sensor] for sensor in sensors])) for sensors in instance.coverage]


def _of_targets(instance: AssociationInstance, variables: Variables) -> list[Table]:
    return [
        (tuple(variables[sensor, target] for sensor in sensors), hypothesis_table(instance, target))
        for target, sensors in enumerate(instance.coverage)
        if sensors
    ]


def _of_sensors(instance: AssociationInstance, variables: Variables) -> list[Table]:
    tables: list[Table] = []
    for sensor, (targets, points) in enumerate(zip(instance.targets_of, instance.measurements_m, strict=True)):
        table = _exclusion(false_alarm_log_weights(instance.model, len(points)), len(targets), len(points))
        if not np.isfinite(table).any():
            text = f"no association explains the measurements of the sensor of node {instance.sensor_nodes[sensor]}"
            raise ScenarioError(text)
        if targets:
            tables.append((tuple(variables[sensor, target] for target in targets), table))
    return tables


def _exclusion(left_over: FloatArray, targets: int, measurements: int) -> FloatArray:
    """Log weight of what is left over, -inf where a measurement is used twice; one axis a target."""
    used: FloatArray = np.zeros((measurements + 1,) * targets)
    twice = np.zeros(used.shape, bool)
    for measurement in range(1, measurements + 1):
        here = np.zeros(used.shape)
        for axis in range(targets):
            here = here + along((np.arange(measurements + 1) == measurement).astype(float), axis, targets)
        used += np.minimum(here, 1.0)
        twice |= here > 1.0
    return np.where(twice, -np.inf, left_over[measurements - used.astype(np.int64)])


def _origins(
    instance: AssociationInstance, sensor: int, variables: Variables, found: dict[int, FloatArray]
) -> FloatArray:
    targets, count = instance.targets_of[sensor], len(instance.measurements_m[sensor])
    table = np.zeros((count, len(targets) + 1))
    for column, target in enumerate(targets):
        table[:, column] = np.exp(log_normalise(found[variables[sensor, target]]))[1:]
    table[:, -1] = np.maximum(0.0, 1.0 - table.sum(axis=1))
    return table
