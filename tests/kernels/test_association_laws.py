"""Laws of data association by message passing (Chen et al. 2006), on problems drawn as a run draws them.

What holds and where it is tested:

* Exactness of max- and sum-product on trees: here on drawn problems; on chosen trees in `test_association_kernels`.
* The integer programme finds the MAP: against toulbar2 here, against enumeration here and in `test_assignment`.
* Tolerance 0 makes max-product's decisions where that converges, and an unchanged message is not sent again: here.
* Messages fall with the tolerance on average; a huge one leaves the start round and the independent estimate: here, and
  by real messages in `tests/algorithms/test_message_passing.py`.
* Ties, sensors without a neighbour and several components: here. 0 ln 0: `test_communication`, and certain detectors here.
"""

from dataclasses import replace
from itertools import pairwise

import association_oracle as oracle
import networkx as nx
import numpy as np
import pytest
import toulbar2_oracle as toulbar2

from netsim.kernels.assignment import best_assignment, joint_score
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule
from netsim.kernels.injections import count_injections
from netsim.kernels.semiring import Semiring
from netsim.problems.association import AssociationParameters, UniformTargets, build
from netsim.rng import Streams

GRID_M = np.array([[5.0 * x, 5.0 * y] for x in range(5) for y in range(5)])
MODELS = ("strict", "geometric")


def drawn(seed, sensors_m, targets, **chosen):
    parameters = AssociationParameters(targets=UniformTargets(count=targets), **chosen)
    return build(parameters, sensors_m, range(len(sensors_m)), Streams(seed)).instance


def varied(seed):
    """1 to 7 sensors at random places, 0 to 9 targets, all probabilities and both variances random, certainty included."""
    rng = np.random.default_rng(seed)
    sensors_m = rng.uniform(0.0, 12.0, (int(rng.integers(1, 8)), 2))
    return drawn(
        seed,
        sensors_m,
        int(rng.integers(0, 10)),
        false_alarms=MODELS[seed % 2],
        detection_probability=float(rng.choice([0.5, 0.8, 0.95, 1.0])),
        false_alarm_probability=float(rng.choice([0.0, 0.15, 0.6])),
        prior_mean=str(rng.choice(["truth", "drawn"])),
        prior_variance_m2=float(rng.choice([1.0, 5.0])),
        measurement_variance_ratio=float(rng.choice([0.02, 0.2])),
    )


def states(instance):
    """How many joint associations there are (counted by `injections`, which `test_association_kernels` counts out)."""
    pairs = zip(instance.targets_of, instance.measurements_m, strict=True)
    return np.prod([float(count_injections(len(targets), len(points))) for targets, points in pairs])


def skeleton(instance):
    """The graph of the hybrid model."""
    graph = nx.Graph()
    for vertex in instance_vertices(instance):
        graph.add_node(vertex.id)
        graph.add_edges_from((vertex.id, neighbour) for neighbour in vertex.neighbours)
    return graph


# The integer programme


@pytest.mark.parametrize("block", range(7))
def test_integer_programme_and_toulbar2_find_the_same_score(block):
    """210 problems; where all associations can be tried, trying them gives that score too."""
    tried = 0
    for seed in range(30 * block, 30 * (block + 1)):
        instance = varied(seed)
        exact = best_assignment(instance)
        assert exact.score == pytest.approx(toulbar2.best_score(instance), rel=0, abs=toulbar2.slack(instance)), seed
        assert exact.score == joint_score(instance, exact.assignment)
        if states(instance) <= 3_000:
            tried += 1
            assert exact.score == pytest.approx(oracle.joint(instance).max(), rel=1e-12, abs=1e-9), seed
    assert tried >= 5


@pytest.mark.parametrize("false_alarms", MODELS)
def test_integer_programme_and_toulbar2_agree_on_the_papers_grid(false_alarms):
    for seed in range(4):
        instance = drawn(seed, GRID_M, 17, false_alarms=false_alarms)
        exact, other = best_assignment(instance).score, toulbar2.best_score(instance)
        assert exact == pytest.approx(other, rel=0, abs=toulbar2.slack(instance)), seed


@pytest.mark.slow
@pytest.mark.parametrize(("targets", "seeds"), [(33, range(5)), (54, (0,))])
@pytest.mark.parametrize("false_alarms", MODELS)
def test_integer_programme_and_toulbar2_agree_on_full_problems(targets, seeds, false_alarms):
    """25 sensors and 33 or 54 targets. With the literal variances toulbar2 needs far longer."""
    for seed in seeds:
        instance = drawn(seed, GRID_M, targets, false_alarms=false_alarms, variance="total", prior_mean="drawn")
        exact, other = best_assignment(instance).score, toulbar2.best_score(instance)
        assert exact == pytest.approx(other, rel=0, abs=toulbar2.slack(instance)), seed


def test_impossible_problems_are_impossible_to_toulbar2_too():
    assert toulbar2.best_score(oracle.instance([(0, 1)], [3, 0], 3, oracle.model("strict"))) == -np.inf


def test_evidence_by_kalman_filter_equals_one_large_gaussian():
    """The oracle's own evidence, held against yet another form."""
    instance = oracle.instance([(0, 1, 2)], [2, 1, 3], 5, oracle.model())
    np.testing.assert_allclose(toulbar2.log_evidence(instance, 0), oracle.evidence_table(instance, 0), rtol=1e-11)


# Trees


def trees():
    """Drawn problems whose model is a forest, small enough to enumerate, with at least two vertices that talk."""
    seed, found = 0, []
    while len(found) < 24:
        instance = drawn(seed, np.random.default_rng(seed).uniform(0, 16, (4, 2)), 4, false_alarms=MODELS[seed % 2])
        graph = skeleton(instance)
        if graph.edges and nx.is_forest(graph) and states(instance) <= 50_000:
            found.append(instance)
        seed += 1
    return found


TREES = trees()


@pytest.mark.parametrize("semiring", Semiring)
def test_marginals_on_drawn_trees_are_exact(semiring):
    for instance in TREES:
        joint = oracle.joint(instance)
        weight = np.exp(joint - joint.max())
        vertices = instance_vertices(instance)
        result = run_synchronous(vertices, semiring, 12)
        assert result.converged_round is not None
        for sensor in range(len(instance.sensor_nodes)):
            others = tuple(axis for axis in range(joint.ndim) if axis != sensor)
            with np.errstate(divide="ignore"):
                marginal = joint.max(axis=others) if semiring is Semiring.MAX else np.log(weight.sum(axis=others))
            combine = np.max if semiring is Semiring.MAX else np.sum
            expected = oracle.origin_table(instance, sensor, marginal, combine)
            found = vertices[sensor].assignment_probabilities(result.incoming[sensor], semiring)
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13)


def test_decisions_on_drawn_trees_are_the_map():
    for instance in TREES:
        vertices = instance_vertices(instance)
        result = run_synchronous(vertices, Semiring.MAX, 12)
        sensors = vertices[: len(instance.sensor_nodes)]
        decisions = [vertex.decide(result.incoming[vertex.id]) for vertex in sensors]
        assert joint_score(instance, decisions) == pytest.approx(oracle.joint(instance).max(), abs=1e-9)


# Communication-sensitive message passing


GRIDS = [drawn(seed, GRID_M, 33, variance="total", false_alarms=MODELS[seed % 2]) for seed in range(4)]
"""The paper's setting, with the variances that come closest to its table."""


def decided(vertices, incoming, sensors=25):
    return [vertex.decide(incoming.get(vertex.id, {})).tolist() for vertex in vertices[:sensors]]


def test_tolerance_zero_decides_as_max_product_where_that_converges():
    """In as many rounds, with fewer messages (left alone it would send changes of the last digit for ever)."""
    converged = 0
    for instance in GRIDS:
        vertices = instance_vertices(instance)
        standard = run_synchronous(vertices, Semiring.MAX, 40)
        if standard.converged_round is None:
            continue
        converged += 1
        rule = CommunicationRule(tolerance=0.0)
        careful = run_synchronous(vertices, Semiring.MAX, standard.converged_round, rule)
        assert decided(vertices, careful.incoming) == decided(vertices, standard.incoming)
        assert careful.messages_sent < standard.messages_sent
    assert converged >= 2


def test_tolerance_zero_never_sends_an_unchanged_message():
    """A vertex that heard nothing new computes the same messages to the last bit, and keeps every one."""
    for instance in GRIDS:
        result = run_synchronous(instance_vertices(instance), Semiring.MAX, 20, CommunicationRule(tolerance=0.0))
        rounds = [set(count.sent) for count in result.rounds]
        for before, now in pairwise(rounds[1:]):
            told = {destination for _, destination in before}
            assert {source for source, _ in now} <= told


def test_messages_fall_with_the_tolerance_on_average():
    means = []
    for tolerance in (0.0, 0.1, 0.5, 1.0, 2.0, 4.0):
        rule = CommunicationRule(tolerance=tolerance)
        counts = [run_synchronous(instance_vertices(each), Semiring.MAX, 15, rule).messages_sent for each in GRIDS]
        means.append(np.mean(counts))
    assert means == sorted(means, reverse=True)
    assert means[0] > means[2] > means[-1]


@pytest.mark.parametrize("semiring", Semiring)
def test_a_huge_tolerance_leaves_the_start_round_and_the_independent_estimate(semiring):
    """2 E / N messages a sensor, E edges of the model, N sensors."""
    for instance in GRIDS:
        vertices = instance_vertices(instance)
        result = run_synchronous(vertices, semiring, 20, CommunicationRule(tolerance=1e9))
        edges = skeleton(instance).number_of_edges()
        assert result.messages_sent == 2 * edges
        assert len(result.rounds[0].sent) == 2 * edges
        if semiring is Semiring.MAX:
            alone = [vertex.decide_alone().tolist() for vertex in vertices[:25]]
            assert decided(vertices, result.incoming) == alone


# Components, isolation, ties, certainty


def test_components_do_not_disturb_each_other():
    """Two far groups of sensors, and one that shares nothing: each decides as if the others were not there."""
    problem = oracle.instance(
        [(0, 1), (1, 2), (0, 2), (3,), (4, 5, 6), (5, 6), (6,)], [2, 2, 2, 2, 2, 2, 2], 6, oracle.model("geometric")
    )
    graph = skeleton(problem)
    assert sorted(map(len, nx.connected_components(graph))) == [1, 3, 4]
    whole = run_synchronous(instance_vertices(problem), Semiring.SUM, 30, stop_when_converged=False)
    kept = [target for target, sensors in enumerate(problem.coverage) if set(sensors) <= {0, 1, 2}]
    part = replace(
        problem,
        sensor_nodes=problem.sensor_nodes[:3],
        measurements_m=problem.measurements_m[:3],
        means_m=problem.means_m[kept],
        covariances_m2=problem.covariances_m2[kept],
        coverage=tuple(problem.coverage[target] for target in kept),
        hosts=tuple(problem.hosts[target] for target in kept),
    )
    alone = run_synchronous(instance_vertices(part), Semiring.SUM, 30, stop_when_converged=False)
    for vertex, belief in alone.beliefs.items():
        assert belief.tobytes() == whole.beliefs[vertex].tobytes()


def test_an_isolated_sensor_sends_nothing_and_takes_its_best_state():
    problem = oracle.instance([(0,), (0,), (1, 2)], [2, 1, 1], 2, oracle.model())
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.MAX, 5)
    assert all(0 not in edge for count in result.rounds for edge in count.sent)
    best = best_assignment(problem).assignment[0]
    assert vertices[0].decide(result.incoming[0]).tolist() == best.tolist()


@pytest.mark.parametrize("semiring", Semiring)
def test_equal_targets_tie_and_the_lower_one_wins(semiring):
    """Two targets that nothing tells apart: equal marginals, and the tie goes to the first injection."""
    problem = oracle.instance([(0, 1), (0, 1)], [1, 1], 3, oracle.model())
    problem = replace(problem, means_m=np.tile(problem.means_m[:1], (2, 1)))
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, semiring, 5)
    for vertex in vertices:
        table = vertex.assignment_probabilities(result.incoming[vertex.id], semiring)
        np.testing.assert_allclose(table[:, 0], table[:, 1], rtol=1e-12)
    decisions = [vertex.decide(result.incoming[vertex.id]) for vertex in vertices]
    best = best_assignment(problem).score
    assert joint_score(problem, decisions) == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("false_alarms", MODELS)
@pytest.mark.parametrize(("detection", "alarm"), [(1.0, 0.15), (0.8, 0.0), (1.0, 0.0)])
def test_certainty_gives_no_undefined_numbers(false_alarms, detection, alarm):
    """Zeros in potentials and messages: every divergence is a number or infinite, every message normalised."""
    for seed in range(4):
        chosen = {"detection_probability": detection, "false_alarm_probability": alarm, "false_alarms": false_alarms}
        instance = drawn(seed, GRID_M, 17, **chosen)
        with np.errstate(invalid="raise"):
            result = run_synchronous(instance_vertices(instance), Semiring.MAX, 15, CommunicationRule(tolerance=0.1))
        assert not any(np.isnan(count.largest_change) for count in result.rounds)
        for heard in result.incoming.values():
            for message in heard.values():
                assert np.exp(message).sum() == pytest.approx(1.0)
