"""Sensor-oriented, target-oriented and hybrid models of the same association problems, against enumeration."""

from dataclasses import replace
from itertools import product

import association_oracle as oracle
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.assignment import best_assignment, joint_score
from netsim.kernels.association_graph import decide_by_claims, graph_vertices
from netsim.kernels.association_model import AssociationInstance, clustered
from netsim.kernels.central import run_synchronous
from netsim.kernels.semiring import Semiring
from netsim.kernels.trmp import run_trmp

LOOPY = [
    [(0, 1), (1, 2), (0, 2), (0,)],
    [(0, 1, 2), (0, 1), (2, 3), (2,)],
    [(0, 1, 2), (0, 1, 2)],
    [(0, 1, 2), (2, 3), (1, 3), (3,)],
    [(0, 1), (0, 1), (1,), ()],
]
TARGET_TREES = [[(0, 1), (1, 2), (2, 3)], [(0, 1, 2), (0, 1, 2)], [(0, 1), (1,)], [(0, 1, 2), (2, 3)]]
CLUSTER_TREES = [[(0, 1, 2), (0, 1), (2, 3), (1, 3)], [(0, 1), (0, 1), (1, 2)], [(0, 1, 2), (3, 4, 5), (2, 3), (1, 5)]]


def as_graph(problem, graph):
    nodes = problem.sensor_nodes
    hosts = tuple(nodes[sensors[-1]] if sensors and graph == "target" else None for sensors in problem.coverage)
    cluster_hosts = [0] * len(nodes)
    for sensors in clustered(len(nodes), problem.coverage):
        for sensor in sensors:
            cluster_hosts[sensor] = nodes[sensors[-1]]
    return replace(problem, graph=graph, hosts=hosts, cluster_hosts=tuple(cluster_hosts))


@st.composite
def problems(draw, coverages, false_alarms=("geometric",), most=2):
    coverage = draw(st.sampled_from(coverages))
    sensors = 1 + max(max(covering, default=0) for covering in coverage)
    limits = [min(most, sum(s in covering for covering in coverage) + 1) for s in range(sensors)]
    counts = [draw(st.integers(0, limit)) for limit in limits]
    model = oracle.model(draw(st.sampled_from(false_alarms)), alarm=draw(st.sampled_from([0.15, 0.9])))
    return oracle.instance(coverage, counts, draw(st.integers(0, 2**32 - 1)), model)


def score(vertices, chosen):
    """The model's own joint score: node potentials, and every edge potential once."""
    total = sum(vertex.node[chosen[vertex.id]] for vertex in vertices)
    by_id = {vertex.id: vertex for vertex in vertices}
    for vertex in vertices:
        for other in vertex.neighbours:
            if vertex.id < other:
                there = by_id[other]
                point = np.full(vertex.incoming_size(other), -np.inf)
                point[vertex.classes(other)[chosen[vertex.id]]] = 0.0
                total += vertex.towards(other, point)[there.classes(vertex.id)[chosen[other]]]
    return total


def assignment_of(problem, vertices, chosen):
    decisions = [np.full(len(points), -1) for points in problem.measurements_m]
    for vertex in vertices:
        for (sensor, target), value in zip(vertex.scope, vertex.states[chosen[vertex.id]], strict=True):
            if value:
                decisions[sensor][value - 1] = target
    return [decision.tolist() for decision in decisions]


@pytest.mark.parametrize("graph", ["target", "sensor"])
@given(problems(LOOPY[:1] + LOOPY[2:3] + LOOPY[4:], most=2))
@settings(max_examples=12, deadline=None)
def test_the_models_have_the_same_best_state(graph, problem):
    vertices = graph_vertices(as_graph(problem, graph))
    every = [
        dict(zip([v.id for v in vertices], s, strict=True)) for s in product(*(range(len(v.node)) for v in vertices))
    ]
    scores = np.array([score(vertices, chosen) for chosen in every])
    joint, exact = oracle.joint(problem), best_assignment(problem)
    if np.ptp(np.sort(joint, axis=None)[-2:]) > 1e-9:
        best = every[int(np.argmax(scores))]
        assert assignment_of(problem, vertices, best) == [decision.tolist() for decision in exact.assignment]
    possible = np.sort(scores[np.isfinite(scores)])
    expected = np.sort(joint[np.isfinite(joint)])
    assert possible - possible[-1] == pytest.approx(expected - expected[-1], abs=1e-9)


@pytest.mark.parametrize("semiring", Semiring)
@pytest.mark.parametrize(("graph", "trees"), [("target", TARGET_TREES), ("sensor", CLUSTER_TREES)])
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_messages_are_exact_on_trees(semiring, graph, trees, data):
    kinds = ("geometric",) if graph == "target" else ("geometric", "strict")
    problem = data.draw(problems(trees, kinds, most=1 if trees is CLUSTER_TREES else 2))
    joint = oracle.joint(problem)
    if not np.isfinite(joint).any():
        return
    vertices = graph_vertices(as_graph(problem, graph))
    result = run_synchronous(vertices, semiring, 10)
    for vertex in vertices:
        for pair, found in vertex.claims(result.incoming[vertex.id], semiring).items():
            assert found == pytest.approx(marginal(problem, joint, *pair, semiring), abs=1e-9)


def marginal(problem, joint, sensor, target, semiring):
    """From the joint table: one axis a sensor, over its associations."""
    weights = np.exp(joint - joint.max())
    others = tuple(axis for axis in range(joint.ndim) if axis != sensor)
    weights = weights.max(axis=others) if semiring is Semiring.MAX else weights.sum(axis=others)
    column = problem.targets_of[sensor].index(target)
    values = np.array([state[column] for state in oracle.sensor_states(problem)[sensor]])
    rows = [weights[values == value] for value in range(len(problem.measurements_m[sensor]) + 1)]
    found = np.array([(row.max() if semiring is Semiring.MAX else row.sum()) if len(row) else 0.0 for row in rows])
    return found / found.sum()


@pytest.mark.parametrize("graph", ["target", "sensor"])
def test_agreement_of_trees_is_the_exact_answer(graph):
    proved = 0
    for seed in range(12):
        coverage = LOOPY[seed % 4]
        problem = oracle.instance(
            coverage, [2, 2, 2, 1][: 1 + max(map(max, coverage))], seed, oracle.model("geometric")
        )
        vertices = graph_vertices(as_graph(problem, graph))
        results = run_trmp(vertices)
        if all(result.proved for result in results):
            proved += 1
            chosen = {vertex: state[0] for result in results for vertex, state in result.states.items()}
            exact = best_assignment(problem).assignment
            assert assignment_of(problem, vertices, chosen) == [decision.tolist() for decision in exact]
    assert proved > 0  # exclusion between targets makes cliques, on which trees need not agree


@pytest.mark.slow
@pytest.mark.parametrize("graph", ["target", "sensor"])
@pytest.mark.parametrize("schedule", ["two_pass", "flooding"])
@given(problem=problems(LOOPY, most=3))
@settings(max_examples=200, deadline=None)
def test_no_agreement_of_trees_is_wrong(graph, schedule, problem):
    vertices = graph_vertices(as_graph(problem, graph))
    results = run_trmp(vertices, schedule=schedule, iterations=60)
    if all(result.proved for result in results):
        chosen = {vertex: state[0] for result in results for vertex, state in result.states.items()}
        decisions = [np.array(each, dtype=np.int64) for each in assignment_of(problem, vertices, chosen)]
        assert joint_score(problem, decisions) == pytest.approx(best_assignment(problem).score, abs=1e-7)


@pytest.mark.parametrize("graph", ["target", "sensor"])
@given(problem=problems(LOOPY, most=2))
@settings(max_examples=10, deadline=None)
def test_both_ends_of_an_edge_agree(graph, problem):
    vertices = {vertex.id: vertex for vertex in graph_vertices(as_graph(problem, graph))}
    for vertex in vertices.values():
        for other in vertex.neighbours:
            there = vertices[other]
            assert vertex.outgoing_size(other) == there.incoming_size(vertex.id)
            stands_for = np.bincount(there.classes(vertex.id), minlength=vertex.outgoing_size(other))
            ratio = stands_for / vertex.multiplicity(other)
            assert ratio == pytest.approx(np.full(len(ratio), ratio[0]))


@pytest.mark.parametrize("graph", ["target", "sensor"])
def test_instances_keep_their_model_in_json(graph):
    problem = as_graph(oracle.instance(LOOPY[1], [1, 1, 1, 0], 2, oracle.model("geometric")), graph)
    read = AssociationInstance.from_json(problem.to_json())
    assert (read.graph, read.cluster_hosts, read.hosts) == (graph, problem.cluster_hosts, problem.hosts)
    assert "graph" not in replace(problem, graph="hybrid").to_json()


def test_strict_false_alarms_are_no_pairwise_model_of_targets():
    problem = as_graph(oracle.instance(LOOPY[0], [1, 1, 1], 2, oracle.model("strict")), "target")
    with pytest.raises(ScenarioError, match="set false_alarms: geometric, or model: hybrid"):
        graph_vertices(problem)


def test_a_cluster_too_large_says_how_large():
    problem = as_graph(oracle.instance([(0, 1, 2)] * 4, [5, 5, 5], 2, oracle.model()), "sensor")
    with pytest.raises(
        ScenarioError, match=r"nodes 10, 13, 16 would be one variable of 1\.26e\+08 .* set model: hybrid"
    ):
        graph_vertices(problem)


def test_clusters_are_joined_by_covers_of_three():
    assert clustered(6, [(0, 1), (1, 2, 3), (3, 4), (3, 4, 5)]) == ((0,), (1, 2, 3, 4, 5))


def test_a_measurement_claimed_twice_goes_where_it_is_likelier():
    claims = {3: np.array([0.1, 0.6, 0.3]), 5: np.array([0.05, 0.9, 0.05])}
    assert decide_by_claims(claims, 2, Semiring.MAX).tolist() == [5, 3]
    claims = {3: np.array([0.4, 0.6]), 5: np.array([0.1, 0.9])}
    assert decide_by_claims(claims, 1, Semiring.MAX).tolist() == [5]
    claims = {3: np.array([0.9, 0.1])}
    assert decide_by_claims(claims, 1, Semiring.MAX).tolist() == [-1]
    assert decide_by_claims({}, 1, Semiring.SUM).tolist() == [-1]
