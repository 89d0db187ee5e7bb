"""Products of beliefs and logical targets: pairs drawn independently, eqs 6 and 7 by hand, round trips without loss."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.logical_targets import (
    clusters,
    contiguous_groups,
    join,
    join_operations,
    mixing,
    order_shares,
    ordered,
    principal_axis,
    separate,
    separate_operations,
)
from netsim.kernels.particles import ParticleBelief, equal_weights

SEEDS = st.integers(0, 2**32 - 1)


def belief_of(places_m, weights) -> ParticleBelief:
    with np.errstate(divide="ignore"):
        return ParticleBelief(np.asarray(places_m, dtype=float), np.log(weights))


def blob(centre_m, radius_m, count, rng) -> ParticleBelief:
    angle, range_m = rng.uniform(0, 2 * np.pi, count), radius_m * np.sqrt(rng.random(count))
    places_m = centre_m + np.stack([range_m * np.cos(angle), range_m * np.sin(angle)], axis=-1)
    return equal_weights(places_m[:, None, :])


def shuffled(joint: ParticleBelief, rng: np.random.Generator) -> ParticleBelief:
    """The same belief with each particle's targets in a random order."""
    places = rng.permuted(np.broadcast_to(np.arange(joint.targets), (joint.count, joint.targets)), axis=1)
    return ParticleBelief(np.take_along_axis(joint.positions_m, places[:, :, None], axis=1), joint.log_weights)


def sorted_places(belief: ParticleBelief) -> np.ndarray:
    flat = belief.positions_m.reshape(belief.count, -1)
    return flat[np.lexsort(flat.T)]


@given(SEEDS, st.integers(1, 40), st.floats(0.0, 6.3))
def test_disjoint_blobs_survive_the_round_trip_exactly(seed, count, bearing):
    rng = np.random.default_rng(seed)
    apart_m = 60.0 * np.array([math.cos(bearing), math.sin(bearing)])
    a, b = blob(np.zeros(2), 10.0, count, rng), blob(apart_m, 10.0, count, rng)
    joint = shuffled(join(a, b, count, rng), rng)
    low, high = separate(joint, (1, 1), rng, (count, count))
    a_is_low = principal_axis(joint) @ apart_m > 0.0
    for found, given_belief in zip((low, high), (a, b) if a_is_low else (b, a), strict=True):
        np.testing.assert_array_equal(sorted_places(found), sorted_places(given_belief))
        np.testing.assert_allclose(found.weights, given_belief.weights)


@settings(max_examples=40)
@given(SEEDS, st.permutations(range(4)))
def test_four_blobs_in_a_row_come_back_in_groups(seed, order):
    rng = np.random.default_rng(seed)
    parts = [blob(np.array([40.0 * k, 5.0 * k]), 8.0, 30, rng) for k in range(4)]
    joint = parts[order[0]]
    for number in order[1:]:
        joint = join(joint, parts[number], 30, rng)
    low, middle, high = separate(shuffled(joint, rng), (1, 2, 1), rng)
    np.testing.assert_array_equal(sorted_places(low), sorted_places(parts[0]))
    np.testing.assert_array_equal(sorted_places(high), sorted_places(parts[3]))
    for place in (0, 1):
        inner = equal_weights(middle.positions_m[:, [place]])
        np.testing.assert_array_equal(sorted_places(inner), sorted_places(parts[1 + place]))


def test_a_product_has_each_pair_as_often_as_the_weights_say():
    a = belief_of([[[0.0, 0.0]], [[1.0, 0.0]]], [0.3, 0.7])
    b = belief_of([[[10.0, 0.0]], [[20.0, 0.0]], [[30.0, 0.0]]], [0.5, 0.1, 0.4])
    rng, seen = np.random.default_rng(2), np.zeros((2, 3))
    for _ in range(300):
        joint = join(a, b, 50, rng)
        np.add.at(seen, (joint.positions_m[:, 0, 0].astype(int), (joint.positions_m[:, 1, 0] / 10 - 1).astype(int)), 1)
    np.testing.assert_allclose(seen / seen.sum(), np.outer(a.weights, b.weights), atol=4 * 0.5 / math.sqrt(15_000))


def test_a_product_keeps_the_order_within_its_factors():
    rng = np.random.default_rng(4)
    a, b = equal_weights(rng.normal(size=(9, 2, 2))), equal_weights(rng.normal(size=(5, 1, 2)))
    joint = join(a, b, 20, rng)
    assert (joint.count, joint.targets) == (20, 3)
    rows = {tuple(place.ravel()) for place in a.positions_m}
    assert {tuple(place[:2].ravel()) for place in joint.positions_m} == rows


@given(SEEDS, st.integers(1, 30))
def test_on_a_line_logical_targets_are_the_least_and_the_greatest(seed, count):
    rng = np.random.default_rng(seed)
    line = np.stack([rng.normal(0.0, 10.0, (count, 2)), np.zeros((count, 2))], axis=-1)
    weights = rng.dirichlet(np.ones(count))
    left, right = separate(belief_of(line, weights), (1, 1), rng)
    np.testing.assert_array_equal(left.positions_m[:, 0, 0], line[..., 0].min(axis=1))  # eq 6
    np.testing.assert_array_equal(right.positions_m[:, 0, 0], line[..., 0].max(axis=1))  # eq 7
    np.testing.assert_allclose(left.weights, weights)


def test_plain_marginals_spread_over_two_places_where_logical_ones_are_compact():
    a, b = np.array([0.0, 0.0]), np.array([50.0, 0.0])
    joint = belief_of([[a, b], [b, a]], [0.5, 0.5])  # Fig 3a
    assert joint.covariance_m2(0)[0, 0] == pytest.approx(625.0)
    left, right = separate(joint, (1, 1), np.random.default_rng(0))
    assert left.covariance_m2(0)[0, 0] == right.covariance_m2(0)[0, 0] == 0.0
    np.testing.assert_array_equal(ordered(joint).estimate_m, [a, b])


@given(SEEDS, st.integers(1, 4))
def test_the_order_of_a_particles_targets_does_not_matter(seed, targets):
    rng = np.random.default_rng(seed)
    joint = belief_of(rng.normal(size=(12, targets, 2)), rng.dirichlet(np.ones(12)))
    np.testing.assert_allclose(ordered(shuffled(joint, rng)).positions_m, ordered(joint).positions_m)


@given(SEEDS, st.integers(1, 4))
def test_order_shares_are_probabilities_of_orders(seed, targets):
    rng = np.random.default_rng(seed)
    joint = belief_of(rng.normal(size=(12, targets, 2)), rng.dirichlet(np.ones(12)))
    shares = order_shares(joint)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    by_hand = np.zeros((targets, targets))
    for places, weight in zip(joint.positions_m @ principal_axis(joint), joint.weights, strict=True):
        for target, along in enumerate(places):
            by_hand[sum(other < along for other in places), target] += weight
    np.testing.assert_allclose(shares, by_hand, atol=1e-12)


def test_mixing_is_the_weight_of_the_swapped_pairs():
    a, b = [0.0, 0.0], [50.0, 0.0]
    assert mixing(belief_of([[a, b], [b, a], [a, b]], [0.5, 0.3, 0.2])) == pytest.approx(0.3)
    with pytest.raises(ValueError, match="expected 2"):
        mixing(belief_of([[a, b, b]], [1.0]))


@pytest.mark.parametrize("groups", [(1,), (1, 1, 1), (2, 0), (3, -1), ()])
def test_groups_must_share_out_the_targets(groups):
    with pytest.raises(ValueError, match="sum up to 2"):
        separate(belief_of([[[0.0, 0.0], [1.0, 0.0]]], [1.0]), groups, np.random.default_rng(0))


def test_clusters_hang_together_by_short_steps():
    places_m = np.array([[0.0, 0.0], [200.0, 0.0], [90.0, 0.0], [300.0, 0.0], [0.0, 100.0]])
    assert clusters(places_m, 100.0) == [(0, 2, 4), (1, 3)]  # 0-2 90, 1-3 100, 0-4 100 m
    assert clusters(places_m, 110.0) == [(0, 1, 2, 3, 4)]
    assert clusters(places_m, 50.0) == [(0,), (1,), (2,), (3,), (4,)]
    assert clusters(places_m[:1], 50.0) == [(0,)]


@pytest.mark.parametrize(
    ("parts", "sizes"),
    [([(0,), (1,)], (1, 1)), ([(0, 1), (2,)], (2, 1)), ([(0, 2), (1,), (3,)], (3, 1)), ([(0,)], (1,))],
)
def test_clusters_that_overlap_along_the_axis_stay_together(parts, sizes):
    assert contiguous_groups(parts) == sizes


def test_work_is_counted():
    assert join_operations(200, 200) > 200
    assert separate_operations(200, 2) == 200 * 2 * 16
