"""The posterior of the numbers of targets by listing every state of every variable: slow, and written anew."""

from itertools import product
from math import exp, factorial, log

import numpy as np

from netsim.kernels.target_distribution import CountingModel, DistributionInstance, Subregion

MODEL = CountingModel(0.02, 0.8, 0.004, 1.0, 1e-3)


def instance(sets, readings, counts=None, areas=None, model=MODEL):
    """A problem with the given covering sets; node ids are ten times the sensor numbers."""
    sensors = len(readings)
    subregions = tuple(
        Subregion(
            vertex=sensors + j,
            host=10 * covering[0],
            sensors=tuple(covering),
            area_m2=60.0 if areas is None else areas[j],
            centre_m=(0.0, 0.0),
            counts=(0, 1, 2) if counts is None else tuple(counts[j]),
        )
        for j, covering in enumerate(sets)
    )
    nodes = tuple(10 * sensor for sensor in range(sensors))
    return DistributionInstance(nodes, np.array(readings, dtype=float), subregions, model)


def poisson(mean, count):
    """Its probability of a count."""
    return exp(-mean) * mean**count / factorial(count)


def false_counts(mean, tail):
    """Probabilities of 0, 1, ... false detections up to a tail of at most `tail`, scaled to one."""
    found = []
    while 1.0 - sum(found) > tail:
        found.append(poisson(mean, len(found)))
    return [p / sum(found) for p in found]


def detections(z, x, p_d, false):
    """p(z | x): z - f of x targets detected, f false ones."""
    choose = lambda n, k: factorial(n) // factorial(k) // factorial(n - k)  # noqa: E731
    return sum(
        p * choose(x, z - f) * p_d ** (z - f) * (1 - p_d) ** (x - z + f) for f, p in enumerate(false) if 0 <= z - f <= x
    )


def joint(problem):
    """Weight of every joint (x, z): pairs of (x by subregion, weight), all z listed."""
    model = problem.model
    edges = [(s, j) for j, region in enumerate(problem.subregions) for s in region.sensors]
    false = [
        false_counts(model.false_alarm_density_per_m2 * r.area_m2, model.false_alarm_tail) for r in problem.subregions
    ]
    most = [r.counts[-1] + len(f) - 1 for r, f in zip(problem.subregions, false, strict=True)]
    for x in product(*(region.counts for region in problem.subregions)):
        prior = np.prod(
            [poisson(model.target_density_per_m2 * r.area_m2, n) for r, n in zip(problem.subregions, x, strict=True)]
        )
        for z in product(*(range(most[j] + 1) for _, j in edges)):
            weight = prior
            totals = dict.fromkeys(range(len(problem.sensor_nodes)), 0)
            for (s, j), n in zip(edges, z, strict=True):
                weight *= detections(n, x[j], model.detection_probability, false[j])
                totals[s] += n
            for s, total in totals.items():
                weight *= exp(-((problem.readings[s] - total) ** 2) / 2 / model.noise_variance)
            yield x, weight


def exact(problem, combine=sum):
    """Log (max-)marginal of every subregion, scaled to sum to one."""
    weights = [{n: [] for n in region.counts} for region in problem.subregions]
    for x, weight in joint(problem):
        for j, n in enumerate(x):
            weights[j][n].append(weight)
    tables = [[combine(rows) for rows in by_count.values()] for by_count in weights]
    return [np.array([log(p / sum(row)) for p in row]) for row in tables]
