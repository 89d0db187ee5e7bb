"""Evidence of ranges and bearings against adaptive quadrature, and association with false alarms of unequal density."""

from dataclasses import replace

import association_oracle as oracle
import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.stats import multivariate_normal, norm

from netsim.errors import ScenarioError
from netsim.kernels.assignment import best_assignment, brute_force, joint_score
from netsim.kernels.association_graph import graph_vertices
from netsim.kernels.association_marginals import exact_origins
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.central import run_synchronous
from netsim.kernels.polar_evidence import polar_false_alarm_log_density, polar_log_evidence
from netsim.kernels.semiring import Semiring

RADIUS_M, RANGE_SD_M, BEARING_SD_RAD = 5.0, 0.8, 0.2
SENSORS_M = ((4.0, 3.0), (-3.0, 2.0), (0.0, -4.0))
COVERAGE = [(0, 1, 2), (0, 1), (1, 2)]
KINDS = ["range", "bearing", "range_bearing"]


def polar(truth_m, sensor_m, kind):
    """What a perfect sensor would measure of some places."""
    offset = np.reshape(truth_m, (-1, 2)) - sensor_m
    both = np.column_stack([np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])])
    return both[:, {"range": [0], "bearing": [1], "range_bearing": [0, 1]}[kind]]


def likelihood(place_m, sensor_m, value, kind):
    """Density of one measurement of a target at a place, a bearing's over three turns."""
    offset = np.subtract(place_m, sensor_m)
    density = 1.0
    if kind != "bearing":
        density *= norm.pdf(value[0], np.hypot(*offset), RANGE_SD_M)
    if kind != "range":
        turns = value[-1] - np.arctan2(offset[1], offset[0]) + 2 * np.pi * np.array([-1, 0, 1])
        density *= norm.pdf(turns, 0.0, BEARING_SD_RAD).sum()
    return density


def integral(mean_m, covariance_m2, seen, kind):
    """Over the prior, by adaptive quadrature; `seen` are (sensor, measurement) pairs."""
    prior = multivariate_normal(mean_m, covariance_m2)
    reach = 7.0 * np.sqrt(np.diag(covariance_m2))

    def joint(y, x):
        return prior.pdf((x, y)) * np.prod([likelihood((x, y), SENSORS_M[s], value, kind) for s, value in seen])

    low, high = mean_m - reach, mean_m + reach
    return dblquad(joint, low[0], high[0], low[1], high[1], epsabs=1e-9, epsrel=1e-7)[0]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_evidence_equals_adaptive_quadrature(kind):
    mean_m, covariance_m2 = np.array([1.0, 0.5]), np.array([[0.3, 0.05], [0.05, 0.2]])
    values = [polar([[1.3, 0.2], [0.4, 0.9]], sensor_m, kind) for sensor_m in SENSORS_M[:2]]
    found = polar_log_evidence(mean_m, covariance_m2, np.array(SENSORS_M[:2]), values, kind, RANGE_SD_M, BEARING_SD_RAD)
    for index in [(0, 0), (1, 0), (0, 2), (2, 1)]:
        seen = [(s, values[s][a - 1]) for s, a in enumerate(index) if a]
        assert np.exp(found[index]) == pytest.approx(integral(mean_m, covariance_m2, seen, kind), rel=2e-6)


@pytest.mark.parametrize(("kind", "accuracy"), [("range", 1e-4), ("bearing", 5e-4), ("range_bearing", 5e-4)])
@pytest.mark.parametrize("mean_m", [(1.0, 0.5), (-2.5, 1.5)])
def test_evidence_where_sensors_stand_within_the_prior(kind, accuracy, mean_m):
    covariance_m2 = np.array([[5.0, 0.8], [0.8, 4.0]])
    values = [polar([[2.0, 0.0], [-1.0, 1.5]], sensor_m, kind) for sensor_m in SENSORS_M[:2]]
    found = polar_log_evidence(
        np.array(mean_m), covariance_m2, np.array(SENSORS_M[:2]), values, kind, RANGE_SD_M, BEARING_SD_RAD
    )
    fine = fine_grid(np.array(mean_m), covariance_m2, values, kind)
    assert np.exp(found) == pytest.approx(fine, abs=accuracy * fine.max())


def fine_grid(mean_m, covariance_m2, values, kind):
    axis_m = np.linspace(-16.0, 16.0, 1001)
    places_m = mean_m + np.stack(np.meshgrid(axis_m, axis_m, indexing="ij"), axis=-1).reshape(-1, 2)
    weight = multivariate_normal(mean_m, covariance_m2).pdf(places_m) * (axis_m[1] - axis_m[0]) ** 2
    tables = []
    for sensor_m, measured in zip(SENSORS_M, values, strict=False):
        offset = places_m - sensor_m
        rows = [np.ones(len(places_m))]
        for value in measured:
            row = np.ones(len(places_m))
            if kind != "bearing":
                row = row * norm.pdf(value[0], np.hypot(*offset.T), RANGE_SD_M)
            if kind != "range":
                turn = np.angle(np.exp(1j * (value[-1] - np.arctan2(offset[:, 1], offset[:, 0]))))
                row = row * norm.pdf(turn, 0.0, BEARING_SD_RAD)
            rows.append(row)
        tables.append(np.array(rows))
    return np.einsum("n,an,bn->ab", weight, *tables)


@pytest.mark.parametrize("kind", ["bearing", "range_bearing"])
def test_evidence_has_no_length_of_its_own(kind):
    """With all lengths scaled alike each range's density scales against them, and nothing else changes."""
    sensors_m, covariance_m2 = np.array(SENSORS_M[:2]), np.array([[5.0, 0.8], [0.8, 4.0]])
    mean_m = np.array([3.5, 2.0])  # next to a sensor

    def table(scale):
        values = [scale * polar([[2.0, 0.0], [-1.0, 1.5]], sensor_m, "range") for sensor_m in sensors_m]
        angles = [polar([[2.0, 0.0], [-1.0, 1.5]], sensor_m, "bearing") for sensor_m in sensors_m]
        both = [np.hstack(pair) for pair in zip(values, angles, strict=True)]
        prior = scale * mean_m, scale**2 * covariance_m2, scale * sensors_m
        measured = angles if kind == "bearing" else both
        found = polar_log_evidence(*prior, measured, kind, scale * RANGE_SD_M, BEARING_SD_RAD)
        used = np.add.outer([0, 1, 1], [0, 1, 1]) if kind == "range_bearing" else np.zeros((3, 3))
        return found + used * np.log(scale)

    for scale in (0.01, 0.1, 10.0):
        np.testing.assert_allclose(table(scale), table(1.0), rtol=1e-9, atol=1e-9)


def test_what_is_remembered_is_not_what_is_given():
    """A caller may change its table without changing the next one's."""
    prior = np.ones(2), np.eye(2), np.zeros((1, 2))
    first = polar_log_evidence(*prior, [np.array([[0.3]])], "bearing", 1.0, 0.2)
    first += 1.0
    assert polar_log_evidence(*prior, [np.array([[0.3]])], "bearing", 1.0, 0.2)[0] == 0.0


def test_bearings_wrap():
    prior = np.array([-4.0, 0.0]), 0.5 * np.eye(2), np.zeros((1, 2))
    sides = [np.array([[np.pi - 0.05]]), np.array([[-np.pi + 0.05]]), np.array([[-np.pi - 0.05]])]
    above, below, again = (polar_log_evidence(*prior, [side], "bearing", 1.0, 0.2)[1] for side in sides)
    assert above == pytest.approx(below, rel=1e-9)
    assert above == pytest.approx(again, rel=1e-9)
    assert above > np.log(1.0 / (2.0 * np.pi))


def test_false_alarm_densities_sum_to_one():
    radius = np.linspace(0.0, RADIUS_M, 20001)[1:, None]
    density = np.exp(polar_false_alarm_log_density(radius, "range", RADIUS_M))
    assert density.sum() * RADIUS_M / 20000 == pytest.approx(1.0, abs=1e-4)
    assert polar_false_alarm_log_density(np.zeros((1, 1)), "bearing", RADIUS_M)[0] == pytest.approx(-np.log(2 * np.pi))


@pytest.mark.parametrize("sd_rad", [0.1, 0.5, 2.0])
def test_a_bearing_is_distributed_over_one_turn(sd_rad):
    """Far away the evidence of a bearing is the wrapped normal: it integrates to one over the circle."""
    angles = np.linspace(-np.pi, np.pi, 721)[:-1, None]
    prior = np.array([100.0, 0.0]), 1e-8 * np.eye(2), np.zeros((1, 2))
    density = np.exp(polar_log_evidence(*prior, [angles], "bearing", 1.0, sd_rad)[1:])
    assert density.mean() * 2.0 * np.pi == pytest.approx(1.0, abs=1e-9)
    turns = angles[:, 0] + 2.0 * np.pi * np.arange(-4, 5)[:, None]
    expected = norm.pdf(turns, 0.0, sd_rad).sum(axis=0)
    np.testing.assert_allclose(density, expected, rtol=1e-6, atol=1e-13 * expected.max())


def test_noise_too_narrow_for_the_grid_says_so():
    with pytest.raises(ScenarioError, match="noise is too small against the prior"):
        polar_log_evidence(np.ones(2), 5.0 * np.eye(2), np.zeros((1, 2)), [np.ones((1, 1))], "range", 1e-3, 0.1)


def problem_of(kind, seed, false_alarms, graph="hybrid"):
    rng = np.random.default_rng(seed)
    model = replace(oracle.model(false_alarms), measures=kind, range_sd_m=RANGE_SD_M, bearing_sd_rad=BEARING_SD_RAD)
    counts = [2, 1, 2]
    places = [rng.normal(0.0, 2.0, (count, 2)) for count in counts]
    base = oracle.instance(COVERAGE, counts, seed, model)
    values = tuple(polar(points, sensor_m, kind) for points, sensor_m in zip(places, SENSORS_M, strict=True))
    nodes = base.sensor_nodes
    hosts = base.hosts if graph == "hybrid" else tuple(nodes[sensors[0]] for sensors in COVERAGE)
    return replace(base, measurements_m=values, sensors_m=SENSORS_M, graph=graph, hosts=hosts)


def direct_score(problem, assignment):
    """Log joint probability with every false alarm at its own density, evidence by a fine grid of its own."""
    model, kind = problem.model, problem.model.measures
    total = 0.0
    for target, sensors in enumerate(problem.coverage):
        chosen = [(s, int(np.flatnonzero(assignment[s] == target)[0])) for s in sensors if target in assignment[s]]
        hit = len(chosen)
        total += hit * np.log(model.detection_probability)
        total += (len(sensors) - hit) * np.log(1.0 - model.detection_probability)
        total += evidence_of(problem, target, tuple(chosen))
    for decision, values in zip(assignment, problem.measurements_m, strict=True):
        false = np.flatnonzero(decision < 0)
        strict = [np.log(1 - model.false_alarm_probability), np.log(model.false_alarm_probability), -np.inf]
        count = len(false)
        total += strict[min(count, 2)] if model.false_alarms == "strict" else count * strict[1]
        for value in values[false]:
            total += np.log(2 * value[0] / RADIUS_M**2) if kind != "bearing" else 0.0
            total += -np.log(2 * np.pi) if kind != "range" else 0.0
    return total


def evidence_of(problem, target, chosen):
    grid_m = np.linspace(-14.0, 14.0, 281)
    places = problem.means_m[target] + np.stack(np.meshgrid(grid_m, grid_m), axis=-1).reshape(-1, 2)
    density = multivariate_normal(problem.means_m[target], problem.covariances_m2[target]).pdf(places)
    kind = problem.model.measures
    for sensor, index in chosen:
        value, offset = problem.measurements_m[sensor][index], places - SENSORS_M[sensor]
        if kind != "bearing":
            density = density * norm.pdf(value[0], np.hypot(*offset.T), RANGE_SD_M)
        if kind != "range":
            turn = np.angle(np.exp(1j * (value[-1] - np.arctan2(offset[:, 1], offset[:, 0]))))
            density = density * norm.pdf(turn, 0.0, BEARING_SD_RAD)
    return np.log(density.sum() * 0.1**2)


@pytest.mark.parametrize("false_alarms", ["strict", "geometric"])
@pytest.mark.parametrize("kind", KINDS)
def test_scores_are_the_joint_probability_up_to_a_constant(kind, false_alarms):
    problem = problem_of(kind, 1, false_alarms)
    every = [
        [np.array(first), np.array(second), np.array(third)]
        for first in ([0, 1], [-1, 0])
        for second in ([1], [-1])
        for third in ([2, 0], [0, -1])
    ]
    shift = [joint_score(problem, each) - direct_score(problem, each) for each in every]
    assert np.ptp(shift) < 2e-3  # bearings near a sensor


@pytest.mark.parametrize("kind", KINDS)
def test_exact_methods_and_models_agree(kind):
    problem = problem_of(kind, 2, "geometric")
    best = best_assignment(problem)
    assert best.score == pytest.approx(joint_score(problem, brute_force(problem)), abs=1e-9)
    read = AssociationInstance.from_json(problem.to_json())
    assert best_assignment(read).score == best.score
    lonely = replace(problem_of(kind, 2, "geometric"), coverage=((0, 1, 2), (), ()), hosts=(10, None, None))
    vertices = graph_vertices(lonely)
    result = run_synchronous(vertices, Semiring.SUM, 8)
    for sensor, exact in enumerate(exact_origins(lonely)):
        found = vertices[sensor].assignment_probabilities(result.incoming[sensor], Semiring.SUM)
        assert found == pytest.approx(exact, abs=1e-9)
