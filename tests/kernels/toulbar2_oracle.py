"""Exact data association by toulbar2, from the definition of the problem and none of our kernels.

One variable for each sensor and target it covers: 0 for missed, a for measurement a - 1. A cost function for each target
over its sensors' variables: minus the log evidence, by the chain rule of a Kalman filter (ours is in information form),
and minus the log of the detections. Measurements are used once: pairs of variables of a sensor differ unless 0. False
alarms are counted: a chain of counters adds up how many measurements are used, and the last one bears the cost.
"""

import os
import sys
from contextlib import contextmanager
from itertools import combinations

import numpy as np
from pytoulbar2 import CFN

from netsim.kernels.association_model import AssociationInstance

DECIMALS = 6
"""toulbar2 counts in integers: costs are rounded to so many decimals, each table apart."""


def log_evidence(instance, target):
    """Log density of every choice of measurements: each predicted from those before it, one axis a covering sensor."""
    noise = np.array(instance.model.noise_m2)
    mean, covariance, total = instance.means_m[target], instance.covariances_m2[target], np.zeros(())
    for sensor in instance.coverage[target]:
        points = instance.measurements_m[sensor]
        innovation = points - mean[..., None, :]
        predicted = covariance + noise
        gain = covariance @ np.linalg.inv(predicted)
        quadratic = np.einsum("...i,...ij,...j->...", innovation, np.linalg.inv(predicted)[..., None, :, :], innovation)
        log_density = -0.5 * (quadratic + np.linalg.slogdet(2.0 * np.pi * predicted)[1][..., None])
        shift = np.einsum("...ij,...nj->...ni", gain, innovation)
        mean = np.concatenate([mean[..., None, :], mean[..., None, :] + shift], axis=-2)
        updated = np.broadcast_to(((np.eye(2) - gain) @ covariance)[..., None, :, :], (*shift.shape, 2))
        covariance = np.concatenate([covariance[..., None, :, :], updated], axis=-3)
        total = np.concatenate([total[..., None], total[..., None] + log_density], axis=-1)
    return total


def log_detections(instance, shape):
    """Log probability of which sensors detect a target, for a table of that shape."""
    chance = instance.model.detection_probability
    with np.errstate(divide="ignore"):
        missed, detected = np.log(1.0 - chance), np.log(chance)
    return sum((np.where(index > 0, detected, missed) for index in np.indices(shape, sparse=True)), np.zeros(shape))


def log_false_alarms(instance, count):
    """Log weight of 0, 1, ..., count false alarms with their places in the disc."""
    model, number = instance.model, np.arange(count + 1)
    chance = model.false_alarm_probability
    if model.false_alarms == "strict":
        weight = np.where(number == 0, 1.0 - chance, np.where(number == 1, chance, 0.0))
    else:
        weight = float(chance) ** number
    with np.errstate(divide="ignore"):
        return np.log(weight) - number * np.log(np.pi * model.detection_radius_m**2)


class Network:
    """A cost function network with names for its variables, and what its tables are worth exactly."""

    def __init__(self):
        self.names, self.sizes, self.tables, self.hard = [], {}, [], []

    def variable(self, name, size):
        self.names.append(name)
        self.sizes[name] = size

    def cost(self, scope, score):
        """Add a table of log scores; an axis of one entry stands for a measurement that nobody has."""
        self.tables.append((scope, np.asarray(score)))

    def forbid(self, scope, allowed):
        self.hard.append((scope, np.asarray(allowed)))

    def solve(self):
        """Value of every variable in the best state; None when there is no possible one."""
        if any(not np.isfinite(table).any() for _, table in self.tables):
            return None
        shifted = [(scope, np.max(table) - table) for scope, table in self.tables]
        top = 1.0 + sum(float(cost[np.isfinite(cost)].max()) for _, cost in shifted)
        network = CFN(top, resolution=DECIMALS)
        for name in self.names:
            network.AddVariable(name, range(self.sizes[name]))
        for scope, cost in shifted:
            if scope:
                network.AddFunction(scope, np.where(np.isfinite(cost), cost, top).ravel().tolist())
        for scope, allowed in self.hard:
            network.AddFunction(scope, np.where(allowed, 0.0, top).ravel().tolist())
        with silent():
            found = network.Solve()
        return None if found is None else dict(zip(self.names, found[0], strict=True))

    def score(self, values):
        """Log score of a state, not rounded."""
        return sum(float(table[tuple(values[name] for name in scope)]) for scope, table in self.tables)


def network_of(instance: AssociationInstance) -> Network:
    """The problem as a cost function network."""
    network = Network()
    counts = [len(points) for points in instance.measurements_m]
    for sensor, targets in enumerate(instance.targets_of):
        for target in targets if counts[sensor] else ():
            network.variable(f"u{sensor}_{target}", counts[sensor] + 1)
    for target, sensors in enumerate(instance.coverage):
        table = log_evidence(instance, target)
        table = table + log_detections(instance, table.shape)
        scope = [f"u{sensor}_{target}" for sensor in sensors if counts[sensor]]
        network.cost(scope, table.reshape([counts[sensor] + 1 for sensor in sensors if counts[sensor]]))
    for sensor, targets in enumerate(instance.targets_of):
        _sensor(network, instance, sensor, [f"u{sensor}_{target}" for target in targets])
    return network


def _sensor(network, instance, sensor, names):
    """Each measurement once, and the cost of those left over."""
    count = len(instance.measurements_m[sensor])
    weight = log_false_alarms(instance, count)[::-1]  # by the number used
    if not count or not names:
        network.cost([], weight[0])
        return
    choices = np.arange(count + 1)
    for pair in combinations(names, 2):
        network.forbid(list(pair), (choices[:, None] != choices) | (choices == 0))
    most = min(count, len(names))
    before = None
    for name in names:
        after = f"n{name}"
        network.variable(after, most + 1)
        used = np.arange(most + 1)
        step = (choices > 0).astype(int)
        if before is None:
            network.forbid([name, after], used == step[:, None])
        else:
            network.forbid([before, name, after], used == used[:, None, None] + step[None, :, None])
        before = after
    network.cost([before], weight[: most + 1])


def best_score(instance: AssociationInstance) -> float:
    """Log score of the most probable joint association, up to the same constant as `joint_score`.

    It is that of the state toulbar2 proves optimal for costs rounded to `DECIMALS`, and so at most one unit of the last
    decimal for each of the instance's targets and sensors below the true maximum. -inf when no association is possible.
    """
    network = network_of(instance)
    values = network.solve() if network.names else {}
    return -np.inf if values is None else network.score(values)


def slack(instance: AssociationInstance) -> float:
    """How far rounding may take `best_score` below the maximum."""
    return 10.0**-DECIMALS * (len(instance.coverage) + len(instance.measurements_m)) + 1e-9


@contextmanager
def silent():
    """toulbar2 writes to the process's standard output, past Python."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
