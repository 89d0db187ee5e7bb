"""Belief propagation for association: exact on trees, and it converges on any graph at the rate that is promised."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import GRAPHS, TREES, probabilities, random_weights

from netsim.kernels.association_bp import beliefs, change, contraction, message_round, propagate

fast = settings(deadline=None, max_examples=40)


def textbook(weights, rounds):
    """Williams and Lau's recursion, entry by entry."""
    count, events = weights.shape
    nu, mu = np.ones(weights.shape), np.zeros(weights.shape)
    for _ in range(rounds):
        for j, k in np.ndindex(weights.shape):
            mu[j, k] = weights[j, k] / (1 + sum(weights[i, k] * nu[i, k] for i in range(count) if i != j))
        for j, k in np.ndindex(weights.shape):
            nu[j, k] = 1 / (1 + sum(mu[j, e] for e in range(events) if e != k))
    found = weights * nu
    return found / (1 + found.sum(axis=0))


@fast
@given(GRAPHS, st.integers(1, 6))
def test_rounds_are_the_textbooks(weights, rounds):
    nu = np.ones(weights.shape)
    for _ in range(rounds):
        nu = message_round(weights, nu)
    assert beliefs(weights, nu) == pytest.approx(textbook(weights, rounds), rel=1e-12)


@fast
@given(TREES)
def test_trees_are_exact_and_done_after_as_many_rounds_as_they_are_deep(weights):
    found = propagate(weights, tolerance=1e-15)
    assert found.converged
    assert found.iterations <= sum(weights.shape) + 1
    assert found.probabilities == pytest.approx(probabilities(weights), rel=1e-12)


@fast
@given(GRAPHS)
def test_what_it_ends_in_is_consistent_on_both_sides(weights):
    found = propagate(weights, tolerance=1e-12)
    assert found.converged
    assert (found.probabilities[weights == 0.0] == 0.0).all()
    assert (found.probabilities.sum(axis=0) <= 1.0).all()
    assert (found.probabilities.sum(axis=1) <= 1.0 + 1e-9).all()
    turned = propagate(weights.T, tolerance=1e-12).probabilities.T
    assert turned == pytest.approx(found.probabilities, rel=1e-9)


@fast
@given(GRAPHS, st.integers(0, 2**32 - 1), st.floats(-7.0, 7.0))
def test_every_round_brings_any_two_starts_closer(weights, seed, log_scale):
    weights = weights * math.exp(log_scale)
    rate = contraction(weights)
    rng = np.random.default_rng(seed)
    one, other = np.where(weights > 0.0, rng.uniform(1e-3, 1.0, (2, *weights.shape)), 1.0)
    for _ in range(8):
        before = change(one, other)
        one, other = message_round(weights, one), message_round(weights, other)
        assert change(one, other) <= rate * before * (1.0 + 1e-12) + 1e-14


@pytest.mark.parametrize("w", [0.1, 1.0, 3.0, 640.0])
def test_two_equal_measurements_and_events_solved_by_hand(w):
    """w nu^2 + nu = 1 is the fixed point. It is less than the truth, w (1 + w) / (1 + 4 w + 2 w^2)."""
    weights = np.full((2, 2), w)
    nu = (math.sqrt(1.0 + 4.0 * w) - 1.0) / (2.0 * w)
    found = propagate(weights, tolerance=1e-13)
    assert found.converged
    assert found.probabilities == pytest.approx(np.full((2, 2), w * nu / (1.0 + 2.0 * w * nu)), rel=1e-10)
    truth = w * (1.0 + w) / (1.0 + 4.0 * w + 2.0 * w * w)
    assert probabilities(weights) == pytest.approx(np.full((2, 2), truth), rel=1e-12)
    assert (found.probabilities < truth - 1e-6).all()
    assert contraction(weights) == pytest.approx((w / (1.0 + w)) ** 2)


def test_the_tolerance_bounds_the_distance_from_the_end():
    weights = random_weights(4, 6, 5, 1.0) * 20.0
    rate, tolerance = contraction(weights), 1e-4
    near, end = propagate(weights, tolerance), propagate(weights, 1e-14)
    assert near.iterations < end.iterations
    gap = float(np.abs(np.log(near.probabilities / end.probabilities)).max())
    assert 0.0 < gap <= 2.0 * tolerance * rate / (1.0 - rate)


def test_it_stops_at_the_limit_and_says_so():
    weights = np.full((4, 4), 50.0)
    assert not propagate(weights, max_iterations=3).converged
    assert propagate(weights, max_iterations=3).iterations == 3


@pytest.mark.parametrize("arguments", [{"tolerance": 0.0}, {"tolerance": math.nan}, {"max_iterations": 0}])
def test_bounds_that_are_none_are_refused(arguments):
    with pytest.raises(ValueError, match="expected a tolerance above 0 and at least 1 iteration"):
        propagate(np.ones((2, 2)), **arguments)
