"""Theorems 2 and 3 against enumeration, with Algorithms 1 and 2 as the paper prints them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import GRAPHS, partition, probabilities, random_weights, without

from netsim.kernels.decay_bounds import DecayBound, exact_depth, paper_bound, sharp_bound
from netsim.kernels.event_gating import gated_weights

fast = settings(deadline=None, max_examples=30)
scales = st.floats(-4.0, 4.0).map(math.exp)


def phi(weights, vertex, depth):
    """Algorithm 1."""
    if depth == 0:
        return 1.0
    rows = len(weights)
    line = weights[vertex] if vertex < rows else weights[:, vertex - rows]
    rest, first = without(weights, vertex), rows if vertex < rows else 0
    return 1.0 / (1.0 + sum(line[other] * phi(rest, first + other, depth - 1) for other in np.flatnonzero(line)))


def algorithm_2(weights, pair, depth):
    """One pair's probability, with the vertices in the order of their numbers."""

    def product(left, vertices):
        found = 1.0
        for vertex in vertices:
            found *= phi(left, vertex, depth)
            left = without(left, vertex)
        return found

    everything = range(sum(weights.shape))
    ends = (pair[0], len(weights) + pair[1])
    others = [vertex for vertex in everything if vertex not in ends]
    return weights[pair] * product(weights, everything) / product(without(weights, *ends), others)


def alone(weights, vertex):
    """P(vertex is in no pair)."""
    return partition(without(weights, vertex)) / partition(weights)


@fast
@given(GRAPHS, scales)
def test_lemma_2_and_theorem_2_hold_and_the_sharp_bound_is_no_larger(weights, scale):
    weights = weights * scale
    paper, sharp = paper_bound(weights), sharp_bound(weights)
    for vertex in range(sum(weights.shape)):
        truth = alone(weights, vertex)
        assert truth >= (1.0 - 1e-12) / sharp.rho >= (1.0 - 2e-12) / paper.rho
        for depth in (0, 2, 4):
            error = abs(math.log(truth / phi(weights, vertex, depth)))
            assert error <= sharp.factor_error(depth) + 1e-12
            assert sharp.factor_error(depth) <= paper.factor_error(depth) + 1e-12


@fast
@given(GRAPHS, scales)
def test_the_ratios_of_all_estimators_keep_within_their_bounds(weights, scale):
    weights = weights * scale
    truth, bound = probabilities(weights), sharp_bound(weights)
    for j, k in np.argwhere(weights > 0.0):
        rest = without(weights, len(weights) + k)
        for depth in (2, 4):
            literal = math.log(algorithm_2(weights, (j, k), depth) / truth[j, k])
            assert abs(literal) <= bound.ratio_error(depth) + 1e-12
            terms = [weights[i, k] * phi(rest, i, depth) for i in range(len(weights))]
            two = weights[j, k] * phi(weights, len(weights) + k, depth) * phi(rest, j, depth)
            for estimate in (two, terms[j] / (1.0 + sum(terms))):
                assert abs(math.log(estimate / truth[j, k])) <= bound.ratio_error(depth, factors=2) + 1e-12


def test_a_star_meets_lemma_2_and_a_path_decays_at_its_own_rate_below_the_bounds():
    """At the end of a long path of equal weights w, Phi = 1 / (1 + w Phi) is the limit, which two levels approach by the
    square of (sqrt(1 + 4 w) - 1) / (sqrt(1 + 4 w) + 1).
    """
    star = np.array([[0.3], [2.0], [0.7]])
    assert -math.log(alone(star, 3)) == pytest.approx(sharp_bound(star).factor_error(0))
    w, length = 2.0, 12
    path = np.zeros((length, length))
    path[np.arange(length), np.arange(length)] = w
    path[np.arange(1, length), np.arange(length - 1)] = w
    root = math.sqrt(1.0 + 4.0 * w)
    errors = [abs(math.log(phi(path, 0, depth) * (1.0 + root) / 2.0)) for depth in (12, 14)]
    per_two_levels = ((root - 1.0) / (root + 1.0)) ** 2
    assert errors[1] / errors[0] == pytest.approx(per_two_levels, rel=1e-3)
    assert per_two_levels <= 1.0 - sharp_bound(path).decay


@given(st.floats(1e-4, 2.0), st.integers(0, 2**32 - 1), st.sampled_from([paper_bound, sharp_bound]), st.booleans())
def test_the_depth_is_the_least_that_does(epsilon, seed, kind, two):
    bound, factors = kind(random_weights(seed, 5, 4)), 2 if two else None
    depth = bound.depth_for(epsilon, factors)
    assert bound.ratio_error(depth, factors) <= epsilon * (1.0 + 1e-9)
    assert depth == 0 or bound.ratio_error(depth - 2, factors) > epsilon * (1.0 - 1e-9)


@given(st.floats(1e-4, 2.0), st.integers(0, 2**32 - 1))
def test_the_printed_depth_is_enough_and_more(epsilon, seed):
    bound = paper_bound(random_weights(seed, 5, 4, 1.0))
    delta = -math.log1p(-bound.decay)
    assert delta <= math.log(2.0)
    count, rho = bound.vertices, bound.rho
    printed = 2 * math.ceil(math.log(2 * count * math.log(rho) / (delta * epsilon)) / delta)
    assert bound.depth_for(epsilon) <= printed
    assert printed - bound.depth_for(epsilon) == pytest.approx(2.0 * math.log(1.0 / delta) / delta, abs=2.0)


def test_on_the_papers_set_up_the_bounds_are_far_beyond_exactness():
    """Oh 2010, section VI: 6 events, 24 measurements."""
    predicted_m = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1)], dtype=float)
    measurements_m = np.random.default_rng(1).uniform(-1.4, 1.4, (24, 2))
    weights = gated_weights(measurements_m, predicted_m, 0.5 * np.eye(2), 4.0, 0.8, 0.5)
    exact, paper, sharp = exact_depth(weights), paper_bound(weights), sharp_bound(weights)
    assert exact == 12
    assert paper.depth_for(0.05) > sharp.depth_for(0.05) > sharp.depth_for(0.05, factors=2) > exact


@fast
@given(GRAPHS)
def test_from_the_exact_depth_on_every_factor_is_the_truth(weights):
    depth = exact_depth(weights)
    assert depth <= 2 * min(weights.shape)
    for vertex in range(sum(weights.shape)):
        for later in (depth, depth + 1):
            assert phi(weights, vertex, later) == pytest.approx(alone(weights, vertex), rel=1e-12)


def test_one_level_less_is_not_exact():
    weights = np.ones((4, 3))
    assert exact_depth(weights) == 6
    assert phi(weights, 0, 5) != pytest.approx(alone(weights, 0), rel=1e-6)


def test_components_are_counted_each_for_itself():
    weights = np.zeros((9, 5))
    weights[:3, :2] = weights[3:7, 3:4] = weights[7, 4] = 1.0
    assert exact_depth(weights) == 4
    assert exact_depth(np.zeros((3, 0))) == exact_depth(np.zeros((0, 3))) == exact_depth(np.zeros((2, 2))) == 0


@pytest.mark.parametrize("kind", [paper_bound, sharp_bound])
def test_without_pairs_there_is_no_error(kind):
    for shape in ((3, 2), (0, 2), (3, 0), (0, 0)):
        bound = kind(np.zeros(shape))
        assert bound == DecayBound(1.0, 1.0, sum(shape))
        assert bound.factor_error(0) == bound.ratio_error(4) == bound.depth_for(1e-9) == 0


@pytest.mark.parametrize("kind", [paper_bound, sharp_bound])
def test_a_hardly_decaying_bound_still_has_a_depth(kind):
    bound = kind(np.array([[1e-6, 1e7], [1.0, 1.0]]))
    depth = bound.depth_for(0.1)
    assert bound.ratio_error(depth) == pytest.approx(0.1, rel=1e-2)


def test_odd_depths_and_no_epsilon_are_refused():
    bound = sharp_bound(np.ones((2, 2)))
    for depth in (-2, 1, 7):
        with pytest.raises(ValueError, match="depth: expected an even number"):
            bound.factor_error(depth)
    for epsilon in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="epsilon: expected above 0"):
            bound.depth_for(epsilon)
