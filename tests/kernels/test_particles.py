"""Particle beliefs: weights that stay a distribution, systematic draws, and Bayes where it can be done exactly."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from netsim.kernels.particles import (
    ParticleBelief,
    condition,
    condition_operations,
    equal_weights,
    log_evidence,
    predict,
    predict_operations,
    resample,
    resample_operations,
    systematic,
    uniform_disc,
)

SEEDS = st.integers(0, 2**32 - 1)
WEIGHTS = arrays(float, st.integers(1, 30), elements=st.sampled_from([0.0, 1e-9, 0.1, 0.5, 1.0, 7.0])).filter(np.any)


def weighted(weights) -> ParticleBelief:
    """Particles at (0, 0), (1, 0), ... with weights that need not sum to one."""
    places = np.stack([np.arange(len(weights)), np.zeros(len(weights))], axis=-1)[:, None, :]
    with np.errstate(divide="ignore"):
        return ParticleBelief(places.astype(float), np.log(np.asarray(weights) / np.sum(weights)))


def test_a_first_belief_fills_its_discs_evenly():
    belief = uniform_disc([[10.0, 20.0], [100.0, 0.0]], 30.0, 20_000, np.random.default_rng(1))
    range_m = np.hypot(*np.moveaxis(belief.positions_m - [[10.0, 20.0], [100.0, 0.0]], -1, 0))
    assert range_m.max() <= 30.0
    np.testing.assert_allclose((range_m < 15.0).mean(axis=0), 0.25, atol=4 * math.sqrt(0.25 * 0.75 / 20_000))
    np.testing.assert_allclose(belief.covariance_m2(1), 225.0 * np.eye(2), atol=8.0)
    assert uniform_disc((1.0, 2.0), 0.0, 3, np.random.default_rng(1)).positions_m.tolist() == [[[1.0, 2.0]]] * 3


@given(SEEDS, st.integers(1, 3), st.floats(0.0, 50.0))
def test_prediction_moves_no_target_further_than_it_may(seed, targets, most_m):
    rng = np.random.default_rng(seed)
    before = equal_weights(rng.uniform(0, 100, (20, targets, 2)))
    after = predict(before, most_m, rng)
    assert np.hypot(*np.moveaxis(after.positions_m - before.positions_m, -1, 0)).max() <= most_m + 1e-9
    assert after.log_weights is before.log_weights


def test_targets_move_independently_of_each_other():
    after = predict(equal_weights(np.zeros((20_000, 2, 2))), 1.0, np.random.default_rng(3))
    flat = after.positions_m.reshape(-1, 4)
    np.testing.assert_allclose(np.cov(flat.T), 0.25 * np.eye(4), atol=0.01)


@given(WEIGHTS, SEEDS)
def test_conditioning_is_bayes(weights, seed):
    belief = weighted(weights)
    logs = np.random.default_rng(seed).normal(0.0, 3.0, belief.count)
    product = belief.weights * np.exp(logs)
    np.testing.assert_allclose(condition(belief, logs).weights, product / product.sum(), rtol=1e-12, atol=1e-300)
    assert log_evidence(belief, logs) == pytest.approx(math.log(product.sum()), rel=1e-9, abs=1e-12)


@given(WEIGHTS, SEEDS, st.floats(-1e6, 1e6))
def test_weights_sum_to_one_however_unlikely_a_measurement(weights, seed, level):
    belief = weighted(weights)
    for _ in range(5):
        logs = level + np.random.default_rng(seed).normal(0.0, 1000.0, belief.count)
        belief = condition(belief, logs)
        assert belief.weights.sum() == pytest.approx(1.0, abs=1e-12)
        assert 1.0 - 1e-12 <= belief.effective_sample_size <= belief.count + 1e-9


def test_ratios_survive_where_densities_underflow():
    after = condition(weighted([1.0, 1.0, 1.0]), np.array([-1e5, -1e5 - math.log(3.0), -np.inf]))
    np.testing.assert_allclose(after.weights, [0.75, 0.25, 0.0], rtol=1e-9)


@pytest.mark.parametrize("value", [-np.inf, np.nan])
def test_a_measurement_that_no_particle_explains_is_refused(value):
    belief = weighted([1.0, 2.0])
    with pytest.raises(ValueError, match="of 2 particles"):
        condition(belief, np.array([value, value]))
    with pytest.raises(ValueError, match="of 2 particles"):
        condition(belief, np.array([0.0, np.nan]))
    assert log_evidence(belief, np.array([-np.inf, -np.inf])) == -np.inf


def test_a_particle_of_weight_0_alone_cannot_explain_a_measurement():
    with pytest.raises(ValueError, match="expected a finite number"):
        condition(weighted([0.0, 1.0]), np.array([0.0, -np.inf]))


@given(WEIGHTS, st.integers(1, 60), SEEDS)
def test_a_particle_is_drawn_as_often_as_its_weight_says_to_within_one(weights, count, seed):
    belief = weighted(weights)
    drawn = systematic(belief.weights, count, np.random.default_rng(seed))
    times = np.bincount(drawn, minlength=belief.count)
    assert times.sum() == count
    assert (np.abs(times - count * belief.weights) < 1.0 + 1e-6).all()
    assert not times[belief.weights == 0.0].any()


def test_draws_are_unbiased():
    rng, weights = np.random.default_rng(5), np.array([0.07, 0.33, 0.11, 0.49])
    times = sum(np.bincount(systematic(weights, 3, rng), minlength=4) for _ in range(4000))
    np.testing.assert_allclose(times / 12_000, weights, atol=4 * 0.5 / math.sqrt(12_000))


def test_equal_particles_are_each_drawn_once():
    belief = equal_weights(np.random.default_rng(7).normal(size=(40, 2, 2)))
    again = resample(belief, 40, np.random.default_rng(8))
    np.testing.assert_array_equal(again.positions_m, belief.positions_m)
    assert again.effective_sample_size == pytest.approx(40.0)


def test_estimate_and_covariance_are_weighted_moments():
    belief = weighted([1.0, 2.0, 1.0])
    np.testing.assert_allclose(belief.estimate_m, [[1.0, 0.0]])
    np.testing.assert_allclose(belief.covariance_m2(0), [[0.5, 0.0], [0.0, 0.0]], atol=1e-15)
    assert belief.effective_sample_size == pytest.approx(1.0 / (0.0625 + 0.25 + 0.0625))


def exact_mean(readings: np.ndarray, sd: float, motion: float) -> float:
    """Posterior mean of a coordinate after each reading: eq 1 by sums over a fine grid of one dimension."""
    grid = np.linspace(-40.0, 40.0, 1601)
    density = np.where(np.abs(grid) <= 20.0, np.sqrt(np.maximum(400.0 - grid**2, 0.0)), 0.0)
    offsets = np.arange(-motion, motion + 1e-9, grid[1] - grid[0])
    kernel = np.sqrt(np.maximum(motion**2 - offsets**2, 0.0))  # a disc's shadow on one axis
    for reading in readings:
        density = np.convolve(density, kernel, mode="same") * np.exp(-0.5 * ((reading - grid) / sd) ** 2)
        density /= density.sum()
    return float(density @ grid)


def test_the_filter_agrees_with_sums_over_a_grid():
    readings, sd, motion = np.array([3.0, 5.5, 9.0, 11.0]), 4.0, 5.0
    rng = np.random.default_rng(11)
    belief = uniform_disc((0.0, 0.0), 20.0, 20_000, rng)
    for reading in readings:
        belief = predict(belief, motion, rng)
        belief = condition(belief, -0.5 * ((reading - belief.positions_m[:, 0, 0]) / sd) ** 2)
        belief = resample(belief, belief.count, rng)
    assert belief.estimate_m[0, 0] == pytest.approx(exact_mean(readings, sd, motion), abs=0.15)


def test_work_grows_with_the_particles():
    assert predict_operations(200, 2) == 2 * predict_operations(200, 1) == 4 * predict_operations(100, 1)
    assert condition_operations(200) > condition_operations(100) > 100
    assert resample_operations(200, 100) > resample_operations(100, 100)
