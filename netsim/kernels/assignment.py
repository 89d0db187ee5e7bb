"""Exact data association of a whole problem: joint score, and its maximum by integer programme or enumeration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array, csr_array

from netsim.errors import NetsimError, ScenarioError
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import (
    detection_log_weights,
    false_alarm_log_weights,
    hypothesis_evidence,
)
from netsim.kernels.injections import IntArray, check_states, count_injections, injections
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vertex import along

Assignment = Sequence[IntArray]
"""For each sensor the target of each of its measurements, -1 for a false alarm."""


def hypothesis_table(instance: AssociationInstance, target: int) -> FloatArray:
    """Log score of each joint hypothesis about one target: evidence and detections; shape (q_1 + 1, ..., q_k + 1)."""
    points = [instance.measurements_m[sensor] for sensor in instance.coverage[target]]
    places_m = np.array([instance.sensors_m[sensor] for sensor in instance.coverage[target] if instance.sensors_m])
    mean_m, covariance_m2 = instance.means_m[target], instance.covariances_m2[target]
    table = hypothesis_evidence(instance.model, mean_m, covariance_m2, places_m, points)
    missed, detected = detection_log_weights(instance.model, 1)
    for axis, size in enumerate(table.shape):
        table = table + along(np.where(np.arange(size) > 0, detected, missed), axis, table.ndim)
    return table


def joint_score(instance: AssociationInstance, assignment: Assignment) -> float:
    """Log of the joint probability of an assignment and the measurements, up to a constant; -inf when impossible.

    Raises:
        ScenarioError: When the assignment is inconsistent: wrong length, a target twice at one sensor, or one that the
            sensor does not cover.
    """
    _check_consistent(instance, assignment)
    total = 0.0
    for target, sensors in enumerate(instance.coverage):
        index = tuple(_measurement_of(assignment[sensor], target) for sensor in sensors)
        total += float(hypothesis_table(instance, target)[index])
    for decision in assignment:
        total += float(false_alarm_log_weights(instance.model, len(decision))[int(np.sum(decision < 0))])
    return total


def _measurement_of(decision: IntArray, target: int) -> int:
    """1 + the measurement assigned to a target, 0 when it was missed."""
    found = np.flatnonzero(decision == target)
    return int(found[0]) + 1 if len(found) else 0


def _check_consistent(instance: AssociationInstance, assignment: Assignment) -> None:
    for sensor, (decision, points) in enumerate(zip(assignment, instance.measurements_m, strict=True)):
        named = [int(target) for target in decision if target >= 0]
        allowed = set(named) <= set(instance.targets_of[sensor]) and len(set(named)) == len(named)
        if not allowed or len(decision) != len(points):
            text = f"sensor {sensor}: {list(decision)} is no association of its {len(points)} measurements"
            raise ScenarioError(text)


def brute_force(instance: AssociationInstance) -> tuple[IntArray, ...]:
    """The best assignment by trying every one; the first of equals.

    Raises:
        ScenarioError: When there are too many.
    """
    counts = [
        count_injections(len(t), len(y)) for t, y in zip(instance.targets_of, instance.measurements_m, strict=True)
    ]
    check_states(int(np.prod([float(count) for count in counts])), "the joint association of all sensors")
    choices = [list(_decisions(instance, sensor)) for sensor in range(len(counts))]
    return max(product(*choices), key=lambda assignment: joint_score(instance, assignment))


def _decisions(instance: AssociationInstance, sensor: int) -> Iterator[IntArray]:
    """Every association of one sensor."""
    targets, count = instance.targets_of[sensor], len(instance.measurements_m[sensor])
    for state in injections(len(targets), count).states:
        decision = np.full(count, -1, dtype=np.int64)
        for target, chosen in zip(targets, state, strict=True):
            if chosen:
                decision[chosen - 1] = target
        yield decision


@dataclass(frozen=True, slots=True)
class ExactAssignment:
    """The best joint association.

    Attributes:
        assignment: For each sensor the target of each of its measurements, -1 for a false alarm.
        score: Its `joint_score`.
        variables: Binary variables of the integer programme.
    """

    assignment: tuple[IntArray, ...]
    score: float
    variables: int


@dataclass(frozen=True, slots=True)
class _Alarms:
    """False alarms of one sensor: how many there may be, and the log score gained by each beyond the least."""

    least: int
    most: int
    gain: float


@dataclass(frozen=True, slots=True)
class _Columns:
    """Hypotheses kept for one target: `index` shape (n, sensors), `score` shape (n,) in log units to be maximised."""

    target: int
    sensors: tuple[int, ...]
    index: IntArray
    score: FloatArray


def best_assignment(instance: AssociationInstance) -> ExactAssignment:
    """The most probable joint association (Chen et al. 2006, eq 6) by an integer programme solved with HiGHS.

    One binary variable a target and joint hypothesis, one hypothesis a target, each measurement in at most one, and
    bounds on how many of a sensor's measurements are left over as false alarms. Where their number is free, a
    hypothesis that scores less than the same one with a measurement given up is in no optimum and is left out.

    Raises:
        ScenarioError: When no association is possible.
        NetsimError: When the solver gives up without proof.
    """
    alarms = [_alarms(instance, len(points)) for points in instance.measurements_m]
    columns = [_columns(instance, target, alarms) for target, sensors in enumerate(instance.coverage) if sensors]
    assignment = _read(instance, columns, _solve(instance, columns, alarms) if columns else np.zeros(0))
    score = joint_score(instance, assignment)
    if not np.isfinite(score):
        raise ScenarioError(_IMPOSSIBLE)
    return ExactAssignment(assignment, score, sum(len(column.score) for column in columns))


_IMPOSSIBLE = "no association explains the measurements: a sensor has more than targets and false alarms allow"


def _alarms(instance: AssociationInstance, measurements: int) -> _Alarms:
    weights = false_alarm_log_weights(instance.model, measurements)
    possible = np.flatnonzero(np.isfinite(weights))
    if not len(possible):
        raise ScenarioError(_IMPOSSIBLE)
    least, most = int(possible[0]), int(possible[-1])
    return _Alarms(least, most, float(weights[least + 1] - weights[least]) if most > least else 0.0)


def _columns(instance: AssociationInstance, target: int, alarms: Sequence[_Alarms]) -> _Columns:
    sensors = instance.coverage[target]
    score = hypothesis_table(instance, target)
    for axis, sensor in enumerate(sensors):
        used = along(np.minimum(np.arange(score.shape[axis]), 1.0), axis, score.ndim)
        score = score - alarms[sensor].gain * used
    keep = np.isfinite(score)
    for axis, sensor in enumerate(sensors):
        if alarms[sensor].least == 0 and alarms[sensor].most == len(instance.measurements_m[sensor]):
            keep &= score >= np.take(score, [0], axis=axis)
    index = np.argwhere(keep)
    return _Columns(target, sensors, index, score[tuple(index.T)])


def _solve(instance: AssociationInstance, columns: Sequence[_Columns], alarms: Sequence[_Alarms]) -> FloatArray:
    """Values of the binary variables, target after target."""
    counts = np.array([len(points) for points in instance.measurements_m])
    starts = np.append(0, np.cumsum(counts))
    measurements, variables = _uses(columns, starts)
    total = sum(len(column.score) for column in columns)
    uses = _incidence(measurements, variables, (int(starts[-1]), total))
    owners = np.repeat(np.arange(len(counts)), counts)
    constraints = [
        LinearConstraint(_one_each(columns), 1.0, 1.0),
        LinearConstraint(uses, 0.0, 1.0),
        LinearConstraint(
            _incidence(owners[measurements], variables, (len(counts), total)),
            counts - [alarm.most for alarm in alarms],
            counts - [alarm.least for alarm in alarms],
        ),
    ]
    return _optimum(-np.concatenate([column.score for column in columns]), [c for c in constraints if c.A.shape[0]])


def _optimum(cost: FloatArray, constraints: Sequence[LinearConstraint]) -> FloatArray:
    binary = np.ones(len(cost))
    answer = milp(cost, integrality=binary, bounds=Bounds(0, 1), constraints=constraints, options={"mip_rel_gap": 0.0})
    if answer.status == 2:
        raise ScenarioError(_IMPOSSIBLE)
    if answer.x is None or answer.status != 0:
        text = f"the integer programme was not solved: {answer.message}"
        raise NetsimError(text)
    return np.asarray(answer.x)


def _incidence(rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> csr_array:
    return csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=shape))


def _one_each(columns: Sequence[_Columns]) -> csr_array:
    """A row a target, 1 at each of its hypotheses."""
    lengths = [len(column.score) for column in columns]
    return _incidence(
        np.repeat(np.arange(len(columns)), lengths), np.arange(sum(lengths)), (len(columns), sum(lengths))
    )


def _uses(columns: Sequence[_Columns], starts: IntArray) -> tuple[IntArray, IntArray]:
    """Pairs of a measurement, numbered over all sensors, and a variable that uses it."""
    measurements, variables, offset = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)], 0
    for column in columns:
        row, axis = np.nonzero(column.index)
        measurements.append(starts[np.array(column.sensors)[axis]] + column.index[row, axis] - 1)
        variables.append(offset + row)
        offset += len(column.score)
    return np.concatenate(measurements), np.concatenate(variables)


def _read(instance: AssociationInstance, columns: Sequence[_Columns], chosen: FloatArray) -> tuple[IntArray, ...]:
    """The assignment that a solution of the programme stands for."""
    assignment = tuple(np.full(len(points), -1, dtype=np.int64) for points in instance.measurements_m)
    offset = 0
    for column in columns:
        best = column.index[int(np.argmax(chosen[offset : offset + len(column.score)]))]
        offset += len(column.score)
        for sensor, measurement in zip(column.sensors, best, strict=True):
            if measurement:
                assignment[sensor][measurement - 1] = column.target
    return assignment
