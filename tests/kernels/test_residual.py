"""Residual scheduling: its fixed points are those of the synchronous update, and it always sends what changed most."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule, divergence
from netsim.kernels.pairwise_vertex import PairwiseVertex
from netsim.kernels.residual import run_residual
from netsim.kernels.semiring import Semiring, uniform


def graph(seed, edges, states=3, strength=0.7):
    """Vertices with random potentials, joined by the given edges."""
    rng = np.random.default_rng(seed)
    tables = {edge: rng.normal(0.0, strength, (states, states)) for edge in edges}
    count = 1 + max(map(max, edges))
    joined = [
        {b: table for (a, b), table in tables.items() if a == v}
        | {a: table.T for (a, b), table in tables.items() if b == v}
        for v in range(count)
    ]
    return [PairwiseVertex(v, rng.normal(0.0, 1.0, states), joined[v]) for v in range(count)]


RING = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]
TREE = [(0, 1), (1, 2), (1, 3), (3, 4), (3, 5)]


@given(st.integers(0, 2**32 - 1), st.sampled_from(Semiring))
@settings(max_examples=20, deadline=None)
def test_where_it_settles_the_synchronous_update_changes_nothing(seed, semiring):
    vertices = graph(seed, RING)
    result = run_residual(vertices, semiring, 2_000)
    if not result.converged:
        return  # max-product on a ring may circulate for ever
    for vertex in vertices:
        for other, message in vertex.outgoing(result.incoming[vertex.id], semiring).items():
            sent = result.incoming[other].get(vertex.id, uniform(len(message)))
            assert divergence(message, sent, vertex.multiplicity(other), "e") <= 1e-11


@pytest.mark.parametrize("semiring", Semiring)
def test_it_finds_what_the_synchronous_update_finds(semiring):
    for seed in range(10):
        vertices = graph(seed, TREE)
        plain, residual = run_synchronous(vertices, semiring, 20), run_residual(vertices, semiring, 500)
        assert residual.converged
        for vertex, belief in plain.beliefs.items():
            np.testing.assert_allclose(residual.beliefs[vertex], belief, atol=1e-5)


def test_the_most_changed_message_goes_first_and_the_count_is_a_limit():
    vertices = graph(3, RING)
    change = {
        (vertex.id, other): divergence(message, uniform(3), np.ones(3), "e")
        for vertex in vertices
        for other, message in vertex.outgoing({}, Semiring.MAX).items()
    }
    result = run_residual(vertices, Semiring.MAX, 1)
    assert result.order == (max(change, key=lambda edge: change[edge]),)
    assert not result.converged


@pytest.mark.parametrize("most", [1, 2])
@pytest.mark.parametrize("semiring", Semiring)
def test_few_messages_a_round_reach_the_same_fixed_point(most, semiring):
    for seed in range(5):
        plain = run_synchronous(graph(seed, TREE), semiring, 20)
        rule = CommunicationRule(tolerance=0.0, messages_per_round=most)
        patient = run_synchronous(graph(seed, TREE), semiring, 200, rule)
        assert patient.converged_round is not None
        for count in patient.rounds[1:]:
            sources = [source for source, _ in count.sent]
            assert max((sources.count(source) for source in sources), default=0) <= most
        for vertex, belief in plain.beliefs.items():
            np.testing.assert_allclose(patient.beliefs[vertex], belief, atol=1e-5)


def test_damping_and_few_messages_go_with_a_tolerance():
    """Damped communication-sensitive message passing with tolerance 0 settles where the plain update does."""
    for seed in range(5):
        plain = run_synchronous(graph(seed, TREE), Semiring.MAX, 20)
        rule = CommunicationRule(tolerance=0.0, damping=0.5, messages_per_round=2)
        damped = run_synchronous(graph(seed, TREE), Semiring.MAX, 600, rule)
        assert damped.converged_round is not None
        for vertex, belief in plain.beliefs.items():
            np.testing.assert_allclose(damped.beliefs[vertex], belief, atol=1e-4)
