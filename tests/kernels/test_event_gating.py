"""Gated weights: the density from scipy, the gate's edge, and units of length that make no difference."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, multivariate_normal

from netsim.errors import ScenarioError
from netsim.kernels.event_gating import gated_weights, require_weights, weight_factor

COVARIANCE = np.array([[0.5, 0.2], [0.2, 0.8]])
seeds = st.integers(0, 2**32 - 1)


def points(seed, count, spread_m=2.0):
    return np.random.default_rng(seed).normal(0.0, spread_m, (count, 2))


def covariances(seed, count):
    roots = np.random.default_rng(seed).normal(0.0, 0.5, (count, 2, 2))
    return roots @ np.swapaxes(roots, 1, 2) + 0.1 * np.eye(2)


def test_the_papers_weight_factors():
    assert weight_factor(0.8, 0.5) == pytest.approx(8.0)
    assert weight_factor(0.8, 0.1) == pytest.approx(40.0)
    assert weight_factor(0.0, 0.1) == 0.0


@pytest.mark.parametrize("detection", [-0.1, 1.0, 1.5, math.nan])
def test_a_detection_that_leaves_no_weight_is_refused(detection):
    with pytest.raises(ScenarioError, match="detection probability: expected 0 or more and below 1"):
        weight_factor(detection, 0.5)


@pytest.mark.parametrize("density", [-0.1, 0.0, math.inf, math.nan])
def test_a_density_that_leaves_no_weight_is_refused(density):
    with pytest.raises(ScenarioError, match="false alarm density: expected above 0"):
        weight_factor(0.8, density)


@settings(deadline=None, max_examples=40)
@given(seed=seeds, measurements=st.integers(0, 6), events=st.integers(0, 5), own=st.booleans())
def test_weights_are_the_densities_within_the_gate(seed, measurements, events, own):
    y, predicted, gate = points(seed, measurements), points(seed + 1, events), 4.0
    covariance = covariances(seed, events) if own else COVARIANCE
    found = gated_weights(y, predicted, covariance, gate, 0.8, 0.5)
    assert found.shape == (measurements, events)
    for j, k in np.ndindex(found.shape):
        here = covariance[k] if own else covariance
        offset = y[j] - predicted[k]
        inside = offset @ np.linalg.inv(here) @ offset < gate
        expected = 8.0 * multivariate_normal.pdf(y[j], predicted[k], here) if inside else 0.0
        assert found[j, k] == pytest.approx(expected, rel=1e-10)


def test_a_pair_on_the_gate_is_left_out():
    inside = np.nextafter(2.0, 0.0)
    found = gated_weights(np.array([[2.0, 0.0], [inside, 0.0]]), np.zeros((1, 2)), np.eye(2), 4.0, 0.8, 0.5)
    assert found[0, 0] == 0.0
    assert found[1, 0] > 0.0


@settings(deadline=None, max_examples=40)
@given(seed=seeds, octaves=st.integers(-20, 20), own=st.booleans())
def test_the_unit_of_length_makes_no_difference(seed, octaves, own):
    """Exactly so for powers of two, which floats scale by without rounding."""
    scale = 2.0**octaves
    covariance = covariances(seed, 4) if own else COVARIANCE
    y, predicted = points(seed, 8), points(seed + 1, 4)
    found = gated_weights(y, predicted, covariance, 4.0, 0.8, 0.5)
    scaled = gated_weights(y * scale, predicted * scale, covariance * scale**2, 4.0, 0.8, 0.5 / scale**2)
    assert np.array_equal(found, scaled)


@pytest.mark.parametrize("gate", [1.0, 4.0, 9.0])
def test_the_gate_loses_its_share_of_an_events_own_measurements(gate):
    count = 4000
    y = np.random.default_rng(5).multivariate_normal((3.0, -1.0), COVARIANCE, count)
    kept = np.count_nonzero(gated_weights(y, np.array([[3.0, -1.0]]), COVARIANCE, gate, 0.8, 0.5))
    share = chi2.cdf(gate, 2)
    assert share == pytest.approx(1.0 - math.exp(-gate / 2.0))
    assert abs(kept - count * share) < 4.0 * math.sqrt(count * share * (1.0 - share))


def test_arrays_of_other_shapes_are_refused():
    good = np.zeros((3, 2))
    for y, predicted, covariance, name in (
        (np.zeros(2), good, COVARIANCE, "measurements"),
        (good, np.zeros((3, 3)), COVARIANCE, "predictions"),
        (good, good, np.zeros((2, 2, 2)), "covariance"),
        (good, good, np.array([[1.0, 2.0], [2.0, 1.0]]), "covariance: expected a positive definite"),
    ):
        with pytest.raises(ValueError, match=name):
            gated_weights(y, predicted, covariance, 4.0, 0.8, 0.5)


@pytest.mark.parametrize("bad", [[1.0], [[-1.0]], [[math.nan]], [[math.inf]]])
def test_weights_that_are_none_are_refused(bad):
    with pytest.raises(ValueError, match="weights: expected"):
        require_weights(np.array(bad))
