"""Data association by enumeration: small random problems, their joint table, and the full-state pairwise model."""

from itertools import product

import numpy as np
from scipy.stats import multivariate_normal

from netsim.kernels.association_model import AssociationInstance, SensorModel
from netsim.kernels.pairwise_vertex import PairwiseVertex


def model(false_alarms="strict", detection=0.8, alarm=0.15):
    return SensorModel(((3.0, 0.4), (0.4, 2.0)), detection, alarm, false_alarms, 5.0)


def instance(coverage, counts, seed, sensor_model):
    """Random prior means and measurements for a given coverage and number of measurements per sensor."""
    rng = np.random.default_rng(seed)
    targets = len(coverage)
    return AssociationInstance(
        sensor_nodes=tuple(10 + 3 * s for s in range(len(counts))),
        measurements_m=tuple(rng.normal(0.0, 3.0, (count, 2)) for count in counts),
        means_m=rng.normal(0.0, 2.0, (targets, 2)),
        covariances_m2=np.tile(np.array([[2.0, 0.3], [0.3, 1.5]]), (targets, 1, 1)),
        coverage=tuple(coverage),
        hosts=tuple(10 + 3 * sensors[0] if len(sensors) >= 3 else None for sensors in coverage),
        model=sensor_model,
    )


def states_of(targets, count):
    """Associations of one sensor: a measurement (1..count) or 0 for each of its targets."""
    every = product(range(count + 1), repeat=len(targets))
    return [u for u in every if len({a for a in u if a}) == sum(a > 0 for a in u)]


def local_score(problem, used, targets, count):
    """Log of eq (16) without the evidence."""
    m = problem.model
    left = count - used
    weight = m.detection_probability**used * (1 - m.detection_probability) ** (targets - used)
    if m.false_alarms == "strict":
        weight *= {0: 1 - m.false_alarm_probability, 1: m.false_alarm_probability}.get(left, 0.0)
    else:
        weight *= m.false_alarm_probability**left
    weight *= (1.0 / (np.pi * m.detection_radius_m**2)) ** left
    return np.log(weight) if weight > 0 else -np.inf


def evidence(problem, target, points):
    """Log density of several measurements of one target: one big Gaussian."""
    count = len(points)
    if not count:
        return 0.0
    prior, noise = problem.covariances_m2[target], np.array(problem.model.noise_m2)
    covariance = np.kron(np.ones((count, count)), prior) + np.kron(np.eye(count), noise)
    return multivariate_normal(np.tile(problem.means_m[target], count), covariance).logpdf(np.concatenate(points))


def evidence_table(problem, target):
    sensors = problem.coverage[target]
    shape = [len(problem.measurements_m[s]) + 1 for s in sensors]
    table = np.zeros(shape)
    for index in np.ndindex(*shape):
        chosen = [problem.measurements_m[s][a - 1] for s, a in zip(sensors, index, strict=True) if a]
        table[index] = evidence(problem, target, chosen)
    return table


def sensor_states(problem):
    return [
        states_of(targets, len(points))
        for targets, points in zip(problem.targets_of, problem.measurements_m, strict=True)
    ]


def joint(problem):
    """Log score of every joint association, one axis a sensor."""
    states = sensor_states(problem)
    total = np.zeros([len(options) for options in states])
    for s, options in enumerate(states):
        targets, count = problem.targets_of[s], len(problem.measurements_m[s])
        local = np.array([local_score(problem, sum(a > 0 for a in u), len(targets), count) for u in options])
        total = total + local.reshape([-1 if axis == s else 1 for axis in range(len(states))])
    for target, sensors in enumerate(problem.coverage):
        if sensors:
            total = total + _spread(evidence_table(problem, target), problem, target, states)
    return total


def _choices(problem, sensor, target, options):
    column = problem.targets_of[sensor].index(target)
    return np.array([u[column] for u in options])


def _spread(table, problem, target, states):
    sensors = problem.coverage[target]
    picked = table[np.ix_(*(_choices(problem, s, target, states[s]) for s in sensors))]
    shape = [len(options) if s in sensors else 1 for s, options in enumerate(states)]
    return picked.reshape(shape)


def assignment(problem, index):
    """Target per measurement of each sensor for one entry of the joint table."""
    decisions = []
    for s, options in enumerate(sensor_states(problem)):
        decision = np.full(len(problem.measurements_m[s]), -1)
        for target, a in zip(problem.targets_of[s], options[index[s]], strict=True):
            if a:
                decision[a - 1] = target
        decisions.append(decision)
    return decisions


def origin_table(problem, sensor, log_marginal, reduce):
    """Rows: measurements; columns: the sensor's targets and false alarm; from the marginal of the sensor's state."""
    targets, count = problem.targets_of[sensor], len(problem.measurements_m[sensor])
    weight = np.exp(log_marginal - log_marginal.max())
    options = np.array(states_of(targets, count)).reshape(len(weight), len(targets))
    table = np.zeros((count, len(targets) + 1))
    for a in range(count):
        for column in range(len(targets)):
            table[a, column] = reduce(weight[options[:, column] == a + 1], initial=0.0)
        table[a, -1] = reduce(weight[~(options == a + 1).any(axis=1)], initial=0.0)
    return table / table.sum(axis=1, keepdims=True)


def full_state_vertices(problem):
    """The hybrid model as a plain pairwise field over all the states of sensors and target vertices."""
    states, edges = sensor_states(problem), {}
    nodes = {}
    for s, options in enumerate(states):
        targets, count = problem.targets_of[s], len(problem.measurements_m[s])
        nodes[s] = np.array([local_score(problem, sum(a > 0 for a in u), len(targets), count) for u in options])
    for target, sensors in enumerate(problem.coverage):
        table = evidence_table(problem, target)
        picks = [_choices(problem, s, target, states[s]) for s in sensors]
        if len(sensors) == 1:
            nodes[sensors[0]] = nodes[sensors[0]] + table[picks[0]]
        elif len(sensors) == 2:
            psi = edges.setdefault(sensors, np.zeros((len(picks[0]), len(picks[1]))))
            psi += table[np.ix_(*picks)]
        elif len(sensors) >= 3:
            vertex = len(states) + target
            nodes[vertex] = table.ravel()
            for axis, (s, pick) in enumerate(zip(sensors, picks, strict=True)):
                own = np.indices(table.shape)[axis].ravel()
                with np.errstate(divide="ignore"):
                    edges[s, vertex] = np.log((pick[:, None] == own[None, :]).astype(float))
    vertices = []
    for vertex, node in nodes.items():
        incident = {b: psi for (a, b), psi in edges.items() if a == vertex}
        incident |= {a: psi.T for (a, b), psi in edges.items() if b == vertex}
        vertices.append(PairwiseVertex(vertex, node, incident))
    return vertices
