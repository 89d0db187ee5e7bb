"""Semiring arithmetic, the divergence of eq (19) and the rule that decides what is sent."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import logsumexp, rel_entr

from netsim.errors import ScenarioError
from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule, EdgeMemory, divergence
from netsim.kernels.pairwise_vertex import PairwiseVertex
from netsim.kernels.semiring import Semiring, log_normalise, reduce, uniform

LOG = st.one_of(st.floats(-300.0, 300.0), st.just(-np.inf))
ROWS = arrays(np.float64, (3, 4), elements=LOG)


@given(ROWS, st.sampled_from([None, 0, 1, (0, 1)]))
def test_reduce_is_maximum_or_log_sum(rows, axis):
    np.testing.assert_array_equal(reduce(Semiring.MAX, rows, axis), np.max(rows, axis=axis))
    np.testing.assert_allclose(reduce(Semiring.SUM, rows, axis), logsumexp(rows, axis=axis), rtol=1e-12, atol=1e-12)


@given(arrays(np.float64, 5, elements=LOG).filter(lambda row: row.max() > -np.inf))
def test_normalised_messages_sum_to_one(row):
    normal = log_normalise(row)
    assert np.exp(normal).sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_array_equal(np.isneginf(normal), np.isneginf(row))


def test_contradictions_are_refused():
    with pytest.raises(ScenarioError, match="impossible"):
        log_normalise(np.full(3, -np.inf))


@st.composite
def pairs(draw):
    """Two distributions over the states behind four entries, and the number of states of each."""
    count = np.array(draw(st.lists(st.integers(1, 9), min_size=4, max_size=4)), dtype=float)
    logs = [np.array(draw(st.lists(st.floats(-20, 20), min_size=4, max_size=4))) for _ in range(2)]
    return *(log - logsumexp(log, b=count) for log in logs), count


@given(pairs())
def test_divergence_is_kullback_leibler_over_the_full_states(pair):
    new, old, count = pair
    full = [np.repeat(np.exp(log), count.astype(int)) for log in (new, old)]
    expected = rel_entr(*full).sum()
    assert divergence(new, old, count, "e") == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert divergence(new, old, count, "2") == pytest.approx(expected / np.log(2), rel=1e-9, abs=1e-12)
    assert divergence(new, old, count, "e") >= 0.0
    assert divergence(new, new, count, "e") == 0.0


def test_divergence_of_impossible_states():
    half = np.array([np.log(0.5), np.log(0.5), -np.inf])
    sure = np.array([0.0, -np.inf, -np.inf])
    ones = np.ones(3)
    assert divergence(sure, half, ones, "e") == pytest.approx(np.log(2.0))
    assert divergence(sure, half, ones, "2") == pytest.approx(1.0)
    assert divergence(half, sure, ones, "e") == np.inf
    assert divergence(half, half, ones, "e") == 0.0


def message(*probabilities):
    return np.log(np.array(probabilities))


def sends(rule, messages, multiplicity=(1.0, 1.0)):
    memory = EdgeMemory(rule, np.array(multiplicity))
    return [memory.decide(each).send for each in messages]


A, B, C = message(0.5, 0.5), message(0.6, 0.4), message(0.7, 0.3)  # d(B, A) = .020, d(C, B) = .022, d(C, A) = .082


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (CommunicationRule(), [True, True, True]),
        (CommunicationRule(tolerance=0.0), [True, True, False]),
        (CommunicationRule(tolerance=0.05), [False, True, False]),
        (CommunicationRule(tolerance=0.05, compare_with="previous_generated"), [False, False, False]),
        (CommunicationRule(tolerance=0.05, first_round="both"), [True, False, False]),
        (CommunicationRule(tolerance=0.05, first_round="ones"), [True, False, False]),
        (CommunicationRule(tolerance=0.1), [False, False, False]),
        (CommunicationRule(tolerance=0.1, log_base="2"), [False, True, False]),
    ],
)
def test_what_is_sent(rule, expected):
    assert sends(rule, [B, C, C]) == expected


def test_support_counts_the_receivers_states_or_the_entries():
    """Two entries, one of which stands for 99 states: uniform over the states is (.01, .99) over the entries."""
    wide = log_normalise(np.array([np.log(0.99), np.log(0.01 / 99.0)]))
    full = EdgeMemory(CommunicationRule(support="full"), np.array([1.0, 99.0])).decide(wide)
    projected = EdgeMemory(CommunicationRule(support="projected"), np.array([1.0, 99.0])).decide(wide)
    assert full.divergence == pytest.approx(0.99 * np.log(99.0) + 0.01 * np.log(0.01 / 0.99))
    p = np.exp(wide)
    assert projected.divergence == pytest.approx(float((p * np.log(2.0 * p)).sum()))


def test_all_ones_are_compared_as_they_stand():
    """The divergence from n unnormalised ones is n - 1 minus the entropy."""
    decision = EdgeMemory(CommunicationRule(tolerance=0.3, first_round="ones"), np.ones(2)).decide(A)
    assert decision.divergence == pytest.approx(1.0 - np.log(2.0))
    assert decision.send


def test_damping_mixes_with_the_previous_message():
    memory = EdgeMemory(CommunicationRule(damping=0.5), np.ones(2))
    first = memory.decide(C).message
    np.testing.assert_allclose(first, log_normalise(0.5 * C))
    np.testing.assert_allclose(memory.decide(B).message, log_normalise(0.5 * B + 0.5 * first))


@pytest.mark.parametrize("wrong", [{"damping": 1.0}, {"damping": -0.1}, {"tolerance": -1.0}, {"tolerance": np.nan}])
def test_wrong_rules_are_refused(wrong):
    with pytest.raises(ScenarioError):
        CommunicationRule(**wrong)


def ring(seed, size=5, states=3):
    rng = np.random.default_rng(seed)
    edges = [rng.normal(0.0, 0.7, (states, states)) for _ in range(size)]  # edge i joins i and i + 1
    return [
        PairwiseVertex(
            i, rng.normal(0.0, 1.0, states), {(i + 1) % size: edges[i], (i - 1) % size: edges[(i - 1) % size].T}
        )
        for i in range(size)
    ]


@given(st.integers(0, 2**32 - 1), st.sampled_from(Semiring))
@settings(max_examples=15, deadline=None)
def test_zero_tolerance_changes_nothing_but_the_count(seed, semiring):
    standard = run_synchronous(ring(seed), semiring, 40, stop_when_converged=False)
    careful = run_synchronous(ring(seed), semiring, 40, CommunicationRule(tolerance=0.0), stop_when_converged=False)
    assert careful.messages_sent <= standard.messages_sent
    for vertex, belief in standard.beliefs.items():
        np.testing.assert_allclose(careful.beliefs[vertex], belief, atol=1e-6)  # KL 0 hides changes below 1e-8


@pytest.mark.parametrize("semiring", Semiring)
def test_a_huge_tolerance_leaves_the_start_round(semiring):
    result = run_synchronous(ring(1), semiring, 20, CommunicationRule(tolerance=1e9))
    assert [len(count.sent) for count in result.rounds] == [10, 0]
    assert result.converged_round == 1
    for vertex in ring(1):
        np.testing.assert_allclose(result.beliefs[vertex.id], vertex.belief({}, semiring), atol=1e-15)


def test_start_messages_change_no_bit():
    """Explicit uniform messages and missing ones are the same to the receiver."""
    init = run_synchronous(ring(2), Semiring.SUM, 3, CommunicationRule(), stop_when_converged=False)
    ones = run_synchronous(ring(2), Semiring.SUM, 3, CommunicationRule(first_round="ones"), stop_when_converged=False)
    assert not ones.rounds[0].sent
    for vertex, belief in init.beliefs.items():
        assert belief.tobytes() == ones.beliefs[vertex].tobytes()


def test_rounds_are_counted():
    result = run_synchronous(ring(3), Semiring.SUM, 7, stop_when_converged=False)
    assert [count.round for count in result.rounds] == list(range(8))
    assert all(count.computed == len(count.sent) == 10 for count in result.rounds)
    assert result.rounds[0].sent == tuple(sorted(result.rounds[0].sent))
    assert result.messages_sent == 80


def test_uniform_is_normalised():
    assert np.exp(uniform(7)).sum() == pytest.approx(1.0)
