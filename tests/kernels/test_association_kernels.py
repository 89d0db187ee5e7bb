"""Association kernels against enumeration and against the model written out state by state."""

import association_oracle as oracle
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.assignment import best_assignment, joint_score
from netsim.kernels.association_likelihood import false_alarm_log_density, log_evidence
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import hosted_vertices, instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule
from netsim.kernels.injections import count_injections, injections
from netsim.kernels.semiring import Semiring

TREES = [
    [(0,), (0, 1), (0, 1), (1,), (1, 2)],
    [(0, 1, 2), (0,), (2, 3), (3,)],
    [(0, 1, 2), (2,), (2, 3, 4)],
    [(0, 1), (1, 2, 3), (1,), (3,)],
    [(0,), (), (1, 2), (1, 2), (1, 2)],
]
LOOPY = [
    [(0, 1), (1, 2), (0, 2), (0,)],
    [(0, 1, 2), (0, 1), (1, 2), (2,)],
    [(0, 1, 2), (0, 1, 2), (0, 1)],
]
FALSE_ALARMS = st.sampled_from(["strict", "geometric"])


@st.composite
def problems(draw, coverages):
    coverage = draw(st.sampled_from(coverages))
    sensors = 1 + max((s for covering in coverage for s in covering), default=0)
    model = oracle.model(draw(FALSE_ALARMS))
    # Under `strict` more measurements than targets plus one would have no explanation.
    most = [min(3, sum(s in covering for covering in coverage) + 1) for s in range(sensors)]
    counts = [draw(st.integers(0, limit)) for limit in most]
    return oracle.instance(coverage, counts, draw(st.integers(0, 2**32 - 1)), model)


def marginal(problem, sensor, reduce):
    table = oracle.joint(problem)
    others = tuple(axis for axis in range(table.ndim) if axis != sensor)
    return reduce(table, axis=others)


def log_sum(table, axis):
    with np.errstate(divide="ignore"):
        return np.log(np.exp(table - table.max()).sum(axis=axis))


@given(problems(TREES))
@settings(max_examples=40, deadline=None)
def test_max_product_is_exact_on_trees(problem):
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.MAX, 10)
    best = oracle.assignment(problem, np.unravel_index(np.argmax(oracle.joint(problem)), oracle.joint(problem).shape))
    for sensor in range(len(problem.sensor_nodes)):
        vertex = vertices[sensor]
        expected = oracle.origin_table(problem, sensor, marginal(problem, sensor, np.max), np.max)
        found = vertex.assignment_probabilities(result.incoming[sensor], Semiring.MAX)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)
        np.testing.assert_array_equal(vertex.decide(result.incoming[sensor]), best[sensor])


@given(problems(TREES))
@settings(max_examples=40, deadline=None)
def test_sum_product_is_exact_on_trees(problem):
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.SUM, 10)
    for sensor in range(len(problem.sensor_nodes)):
        expected = oracle.origin_table(problem, sensor, marginal(problem, sensor, log_sum), np.sum)
        found = vertices[sensor].assignment_probabilities(result.incoming[sensor], Semiring.SUM)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)


@given(problems(TREES))
@settings(max_examples=20, deadline=None)
def test_target_beliefs_are_exact_on_trees(problem):
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.SUM, 10)
    states, joint = oracle.sensor_states(problem), oracle.joint(problem)
    for vertex in vertices[len(states) :]:
        sensors = problem.coverage[vertex.target]
        expected = np.zeros([len(problem.measurements_m[s]) + 1 for s in sensors])
        columns = [problem.targets_of[s].index(vertex.target) for s in sensors]
        weight = np.exp(joint - joint.max())
        for index in np.ndindex(*joint.shape):
            expected[tuple(states[s][index[s]][c] for s, c in zip(sensors, columns, strict=True))] += weight[index]
        expected /= expected.sum()
        np.testing.assert_allclose(np.exp(result.beliefs[vertex.id]), expected.ravel(), rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("semiring", Semiring)
@pytest.mark.parametrize("tolerance", [None, 0.0, 0.05, 0.4])
@pytest.mark.parametrize("compare_with", ["last_sent", "previous_generated"])
@given(problems(TREES + LOOPY))
@settings(max_examples=8, deadline=None)
def test_projected_messages_act_as_the_full_state_model(semiring, tolerance, compare_with, problem):
    """Same sends, same divergences and same beliefs as with every state written out, loops or not."""
    rule = CommunicationRule(tolerance=tolerance, compare_with=compare_with)
    vertices = instance_vertices(problem)
    rounds = 6 if tolerance else 4
    ours = run_synchronous(vertices, semiring, rounds, rule, stop_when_converged=False)
    full = run_synchronous(oracle.full_state_vertices(problem), semiring, rounds, rule, stop_when_converged=False)
    for a, b in zip(ours.rounds, full.rounds, strict=True):
        assert a.largest_change == pytest.approx(b.largest_change, rel=1e-8, abs=1e-12)
        if tolerance != 0.0:  # at 0 a change of one unit in the last place decides
            assert a.sent == b.sent
    for sensor in range(len(problem.sensor_nodes)):
        expected = oracle.origin_table(
            problem, sensor, full.beliefs[sensor], np.max if semiring is Semiring.MAX else np.sum
        )
        found = vertices[sensor].assignment_probabilities(ours.incoming[sensor], semiring)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13)


@given(problems(TREES + LOOPY))
@settings(max_examples=20, deadline=None)
def test_multiplicities_count_the_receivers_states(problem):
    full = {vertex.id: vertex for vertex in oracle.full_state_vertices(problem)}
    for vertex in instance_vertices(problem):
        for neighbour in vertex.neighbours:
            multiplicity = vertex.multiplicity(neighbour)
            assert len(multiplicity) == vertex.outgoing_size(neighbour)
            assert multiplicity.sum() == full[vertex.id].outgoing_size(neighbour)
            assert multiplicity.min() >= 1


@given(problems(TREES + LOOPY))
@settings(max_examples=20, deadline=None)
def test_both_ends_agree_on_message_sizes(problem):
    vertices = {vertex.id: vertex for vertex in instance_vertices(problem)}
    for vertex in vertices.values():
        for neighbour in vertex.neighbours:
            assert vertices[neighbour].incoming_size(vertex.id) == vertex.outgoing_size(neighbour)


@given(problems(TREES + LOOPY))
@settings(max_examples=30, deadline=None)
def test_alone_a_sensor_takes_its_best_local_state(problem):
    for vertex in instance_vertices(problem)[: len(problem.sensor_nodes)]:
        options = oracle.states_of(problem.targets_of[vertex.id], vertex.measurement_count)
        node = next(v for v in oracle.full_state_vertices(problem) if v.id == vertex.id)
        scores = dict(
            zip(
                options,
                node.belief({other: np.zeros(len(options)) for other in node.neighbours}, Semiring.MAX),
                strict=True,
            )
        )
        decision = vertex.decide_alone().tolist()
        chosen = tuple(decision.index(t) + 1 if t in decision else 0 for t in problem.targets_of[vertex.id])
        assert scores[chosen] == pytest.approx(max(scores.values()), abs=1e-10)


def test_ties_go_to_the_first_injection():
    """Two targets shared with another sensor have no local evidence: the lower target takes the lower measurement."""
    problem = oracle.instance([(0, 1), (0, 1)], [2, 1], 1, oracle.model())
    assert instance_vertices(problem)[0].decide_alone().tolist() == [0, 1]


def test_sum_decisions_use_each_target_once():
    problem = oracle.instance([(0,), (0,)], [3], 4, oracle.model("geometric"))
    vertex = instance_vertices(problem)[0]
    decision = vertex.decide({}, Semiring.SUM)
    named = decision[decision >= 0]
    assert len(set(named.tolist())) == len(named)
    table = vertex.assignment_probabilities({}, Semiring.SUM)
    gain = sum(table[a, t] if t >= 0 else table[a, -1] for a, t in enumerate(decision))
    best = max(
        sum(table[a, t] for a, t in enumerate(option))
        for option in np.ndindex(3, 3, 3)
        if all(option.count(t) <= 1 for t in (0, 1))
    )
    assert gain == pytest.approx(best, rel=1e-12)


def test_evidence_equals_one_large_gaussian():
    problem = oracle.instance([(0, 1, 2)], [2, 0, 3], 5, oracle.model())
    table = log_evidence(
        problem.means_m[0], problem.covariances_m2[0], np.array(problem.model.noise_m2), problem.measurements_m
    )
    assert table.shape == (3, 1, 4)
    np.testing.assert_allclose(table, oracle.evidence_table(problem, 0), rtol=1e-11)


def test_evidence_of_no_sensor_is_one():
    assert log_evidence(np.zeros(2), np.eye(2), np.eye(2), []) == 0.0


def test_false_alarms_are_uniform_over_the_disc():
    assert np.exp(false_alarm_log_density(2.0)) * np.pi * 4.0 == pytest.approx(1.0)


@pytest.mark.parametrize(("targets", "measurements"), [(0, 0), (0, 3), (3, 0), (1, 4), (2, 3), (3, 3), (4, 2)])
def test_injections_are_complete_and_ordered(targets, measurements):
    expected = oracle.states_of(range(targets), measurements)
    made = injections(targets, measurements)
    assert [tuple(row) for row in made.states.tolist()] == expected
    assert count_injections(targets, measurements) == len(expected)


@pytest.mark.parametrize("false_alarms", ["strict", "geometric"])
def test_sensors_that_share_many_targets(false_alarms):
    """Five shared targets and seven measurements at each end: 9276 injections there, solved exactly all the same."""
    coverage = [(0, 1)] * 5 + [(0,), (1,)]
    problem = oracle.instance(coverage, [7, 7], 11, oracle.model(false_alarms))
    vertices = instance_vertices(problem)
    assert vertices[0].outgoing_size(1) == count_injections(5, 7)
    result = run_synchronous(vertices, Semiring.MAX, 3)
    exact = best_assignment(problem)
    decisions = [vertex.decide(result.incoming[vertex.id]) for vertex in vertices]
    assert joint_score(problem, decisions) == pytest.approx(exact.score, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_zero_tolerance_makes_the_decisions_of_max_product(seed):
    """On loopy problems where max-product converges."""
    problem = oracle.instance(LOOPY[seed % 3], [3, 2, 2], seed, oracle.model())
    vertices = instance_vertices(problem)
    standard = run_synchronous(vertices, Semiring.MAX, 200)
    careful = run_synchronous(vertices, Semiring.MAX, 200, CommunicationRule(tolerance=0.0))
    assert standard.converged_round is not None
    for vertex in vertices[:3]:
        expected = vertex.decide(standard.incoming[vertex.id])
        np.testing.assert_array_equal(vertex.decide(careful.incoming[vertex.id]), expected)


def test_cost_estimates_grow_with_the_tables():
    small, large = (
        instance_vertices(oracle.instance(LOOPY[1], counts, 8, oracle.model())) for counts in ([1, 1, 1], [3, 3, 3])
    )
    assert all(a.operations() < b.operations() for a, b in zip(small, large, strict=True))


def test_too_many_states_are_refused():
    with pytest.raises(ScenarioError, match="entries, more than"):
        injections(9, 9)


def test_sensors_without_targets_or_measurements():
    problem = oracle.instance([(1,), ()], [1, 0, 0], 3, oracle.model())
    alone, blind, idle = instance_vertices(problem)
    assert alone.decide({}).tolist() == [-1]
    assert blind.decide({}).tolist() == []
    assert idle.assignment_probabilities({}, Semiring.SUM).shape == (0, 1)
    assert alone.neighbours == blind.neighbours == idle.neighbours == ()


def test_unexplainable_measurements_are_refused():
    """Two measurements, no target and at most one false alarm: no state is possible."""
    problem = oracle.instance([(1,)], [2, 0], 3, oracle.model("strict"))
    with pytest.raises(ScenarioError, match="contradict"):
        instance_vertices(problem)[0].decide({})


@pytest.mark.parametrize(
    ("detection", "alarm", "counts"), [(1.0, 0.0, [1, 2, 2]), (0.0, 1.0, [1, 1, 1]), (1.0, 1.0, [2, 3, 3])]
)
@pytest.mark.parametrize("false_alarms", ["strict", "geometric"])
def test_certain_detectors(detection, alarm, counts, false_alarms):
    """Probabilities of 0 and 1 make impossible states, and max-product still finds the best possible one on a tree."""
    problem = oracle.instance([(0, 1), (1, 2), (2,)], counts, 2, oracle.model(false_alarms, detection, alarm))
    joint = oracle.joint(problem)
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.MAX, 5)
    best = oracle.assignment(problem, np.unravel_index(np.argmax(joint), joint.shape))
    for vertex, expected in zip(vertices, best, strict=True):
        np.testing.assert_array_equal(vertex.decide(result.incoming[vertex.id]), expected)


def test_nodes_build_the_same_vertices_from_what_they_know():
    """Knowledge and the partners' measurements suffice, and messages equal those of the central builder bit for bit."""
    problem = oracle.instance(LOOPY[1], [3, 2, 3], 8, oracle.model())
    central = {vertex.id: vertex for vertex in instance_vertices(problem)}
    for sensor in range(3):
        knowledge = problem.knowledge(sensor)
        others = {other: problem.measurements_m[other] for other in knowledge.partners}
        own, targets = hosted_vertices(knowledge, problem.measurements_m[sensor], others)
        assert [v.target for v in targets] == ([0] if sensor == 0 else [])
        for vertex in [own, *targets]:
            expected = central[vertex.id].outgoing({}, Semiring.SUM)
            for neighbour, message in vertex.outgoing({}, Semiring.SUM).items():
                assert message.tobytes() == expected[neighbour].tobytes()
                assert knowledge.hosts[neighbour] in problem.sensor_nodes


def test_instances_survive_json_bit_for_bit():
    problem = oracle.instance(LOOPY[1], [3, 0, 3], 8, oracle.model("geometric"))
    again = AssociationInstance.from_json(problem.to_json())
    assert again.to_json() == problem.to_json()
    assert again.model == problem.model
    for a, b in zip(again.measurements_m, problem.measurements_m, strict=True):
        assert a.tobytes() == b.tobytes()
        assert a.shape == b.shape
    assert again.knowledge(1) == problem.knowledge(1)


def test_messages_do_not_depend_on_where_they_came_from():
    """Read-only bytes off the air at an odd offset give the same bits as the sender's own arrays."""
    problem = oracle.instance(LOOPY[1], [3, 2, 3], 8, oracle.model())
    vertices = {vertex.id: vertex for vertex in instance_vertices(problem)}
    result = run_synchronous(vertices.values(), Semiring.SUM, 3, stop_when_converged=False)
    for vertex, incoming in result.incoming.items():
        wire = {
            other: np.frombuffer(b"x" + message.tobytes(), dtype="<f8", offset=1)
            for other, message in reversed(incoming.items())
        }
        for semiring in Semiring:
            expected = vertices[vertex].outgoing(incoming, semiring)
            for other, message in vertices[vertex].outgoing(wire, semiring).items():
                assert message.tobytes() == expected[other].tobytes()
