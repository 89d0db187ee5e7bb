"""Exact inference and message passing on factor graphs against the joint table."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from netsim.errors import ScenarioError
from netsim.kernels.central import run_synchronous
from netsim.kernels.factor_graph import Factor, FactorGraph, exact_marginals, log_partition, most_probable, vertices_of
from netsim.kernels.semiring import Semiring

COMBINE = {Semiring.MAX: np.max, Semiring.SUM: logsumexp}


def joint(graph):
    """Log of the product of all factors, one axis a variable."""
    total = np.zeros(graph.cardinalities)
    for states in np.ndindex(*graph.cardinalities):
        total[states] = graph.log_score(states)
    return total


def expected_marginals(graph, semiring):
    table, axes = joint(graph), range(len(graph.cardinalities))
    logs = [COMBINE[semiring](table, axis=tuple(a for a in axes if a != axis)) for axis in axes]
    return [log - logsumexp(log) for log in logs]


@st.composite
def graphs(draw, tree=False, most_arity=3, zeros=True):
    """Random graphs: each new factor joins fresh variables to one old one (a tree), or any variables."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    cards = draw(st.lists(st.integers(1, 3), min_size=1, max_size=6))
    scopes, used = [(0,)], 1
    while used < len(cards):
        fresh = list(range(used, min(used + int(rng.integers(1, most_arity)), len(cards))))
        scopes.append(tuple(rng.permutation([int(rng.integers(used)), *fresh]).tolist()))
        used += len(fresh)
    if not tree:
        for _ in range(3):
            arity = int(rng.integers(0, min(most_arity, len(cards)) + 1))
            scopes.append(tuple(rng.choice(len(cards), arity, replace=False).tolist()))
    factors = []
    for scope in scopes:
        table = rng.gamma(0.7, size=[cards[v] for v in scope]) + 1e-3
        if zeros and table.size > 1 and rng.random() < 0.3:
            table.flat[int(rng.integers(1, table.size))] = 0.0
        factors.append(Factor(scope, np.asarray(table)))
    return FactorGraph(tuple(cards), tuple(factors))


@given(graphs(zeros=False), st.sampled_from(Semiring))
@settings(max_examples=40, deadline=None)
def test_exact_marginals_equal_the_joint(graph, semiring):
    for found, expected in zip(exact_marginals(graph, semiring), expected_marginals(graph, semiring), strict=True):
        np.testing.assert_allclose(np.exp(found), np.exp(expected), rtol=1e-10, atol=1e-14)


@given(graphs(zeros=False))
@settings(max_examples=30, deadline=None)
def test_partition_and_mode_equal_the_joint(graph):
    table = joint(graph)
    assert log_partition(graph) == pytest.approx(logsumexp(table), rel=1e-10, abs=1e-10)
    states, score = most_probable(graph)
    assert score == pytest.approx(table.max(), abs=1e-10)
    assert table[states] == score


@given(graphs(tree=True), st.sampled_from(Semiring))
@settings(max_examples=40, deadline=None)
def test_message_passing_is_exact_on_trees(graph, semiring):
    if np.isneginf(joint(graph)).all():
        return
    vertices = vertices_of(graph, "factor")
    result = run_synchronous(vertices, semiring, 20)
    assert result.converged_round is not None
    for variable, expected in enumerate(expected_marginals(graph, semiring)):
        np.testing.assert_allclose(np.exp(result.beliefs[variable]), np.exp(expected), rtol=1e-10, atol=1e-14)


@given(graphs(tree=True, most_arity=2), st.sampled_from(Semiring))
@settings(max_examples=40, deadline=None)
def test_pairwise_form_is_exact_on_trees(graph, semiring):
    if np.isneginf(joint(graph)).all():
        return
    result = run_synchronous(vertices_of(graph, "pairwise"), semiring, 10)
    for variable, expected in enumerate(expected_marginals(graph, semiring)):
        np.testing.assert_allclose(np.exp(result.beliefs[variable]), np.exp(expected), rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_forms_agree_with_loops_too(seed):
    """With weak couplings sum-product has one fixed point, and both forms of the graph lead to it."""
    rng = np.random.default_rng(seed)
    scopes = [(i, j) for i in range(5) for j in range(i)] + [(i,) for i in range(5)] + [()]
    weak = [Factor(scope, np.exp(0.2 * rng.normal(size=(2,) * len(scope)))) for scope in scopes]
    graph = FactorGraph((2,) * 5, tuple(weak))
    pairwise = run_synchronous(vertices_of(graph, "pairwise"), Semiring.SUM, 200, settled=1e-26)
    factor = run_synchronous(vertices_of(graph, "factor"), Semiring.SUM, 400, settled=1e-26)
    assert pairwise.converged_round is not None
    assert factor.converged_round is not None
    for variable in range(5):
        np.testing.assert_allclose(pairwise.beliefs[variable], factor.beliefs[variable], rtol=1e-10)


def test_beliefs_of_factors_are_joint_marginals():
    rng = np.random.default_rng(3)
    graph = FactorGraph((2, 3, 2), (Factor((2, 0), rng.random((2, 2))), Factor((1, 0), rng.random((3, 2)))))
    result = run_synchronous(vertices_of(graph, "factor"), Semiring.SUM, 10)
    table = np.exp(joint(graph))
    np.testing.assert_allclose(np.exp(result.beliefs[3]), (table.sum(axis=1) / table.sum()).ravel(), rtol=1e-12)


def test_long_chains_stay_cheap_and_finite():
    """Three hundred variables: elimination keeps to tables of two, and agrees with sum-product."""
    rng = np.random.default_rng(1)
    pairs = [Factor((i, i + 1), np.exp(5.0 * rng.normal(size=(3, 3)))) for i in range(299)]
    graph = FactorGraph((3,) * 300, tuple(pairs))
    exact = exact_marginals(graph, Semiring.SUM, state_space_limit=9)
    result = run_synchronous(vertices_of(graph, "pairwise"), Semiring.SUM, 300)
    for variable in (0, 150, 299):
        np.testing.assert_allclose(np.exp(result.beliefs[variable]), np.exp(exact[variable]), rtol=1e-9)


def test_wide_graphs_are_refused():
    every = [Factor((i, j), np.ones((4, 4))) for i in range(12) for j in range(i)]
    with pytest.raises(ScenarioError, match="state_space_limit"):
        exact_marginals(FactorGraph((4,) * 12, tuple(every)), Semiring.SUM)


def test_contradictions_are_refused():
    graph = FactorGraph((2,), (Factor((0,), np.array([1.0, 0.0])), Factor((0,), np.array([0.0, 1.0]))))
    with pytest.raises(ScenarioError, match="contradict"):
        most_probable(graph)
    with pytest.raises(ScenarioError, match="contradict"):
        exact_marginals(graph, Semiring.SUM)
    assert log_partition(graph) == -np.inf


@pytest.mark.parametrize(
    ("scope", "table", "what"),
    [
        ((0, 0), np.ones((2, 2)), "distinct"),
        ((2,), np.ones(2), "distinct"),
        ((0, 1), np.ones((3, 2)), "shape"),
        ((0,), np.array([1.0, -1.0]), "0 or more"),
        ((0,), np.array([1.0, np.nan]), "0 or more"),
    ],
)
def test_wrong_factors_are_refused(scope, table, what):
    with pytest.raises(ScenarioError, match=what):
        FactorGraph((2, 3), (Factor(scope, table),))


def test_pairwise_form_refuses_wide_factors():
    graph = FactorGraph((2, 2, 2), (Factor((0, 1, 2), np.ones((2, 2, 2))),))
    with pytest.raises(ScenarioError, match="use `factor`"):
        vertices_of(graph, "pairwise")


@given(graphs())
@settings(max_examples=15, deadline=None)
def test_message_sizes_and_costs(graph):
    vertices = {vertex.id: vertex for vertex in vertices_of(graph, "factor")}
    for vertex in vertices.values():
        assert vertex.neighbours == tuple(sorted(vertex.neighbours))
        assert vertex.operations() > 0 or not vertex.neighbours
        for other in vertex.neighbours:
            assert vertices[other].incoming_size(vertex.id) == vertex.outgoing_size(other)
            assert vertex.multiplicity(other).tolist() == [1.0] * vertex.outgoing_size(other)
