"""JPDA updates against the moments of the mixture over all joint associations, with a Kalman update for each."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import matchings, partition, probabilities
from scipy.stats import multivariate_normal

from netsim.kernels.consistency import nees
from netsim.kernels.event_gating import gated_weights
from netsim.kernels.jpda import gaussian_predict, jpda_update, jpda_updates, predict_measurement
from netsim.kernels.matchings import association_probabilities

H = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
R = np.array([[0.3, 0.1], [0.1, 0.4]])
F = np.eye(4) + np.eye(4, k=2)
Q = np.kron(np.array([[1.0 / 3.0, 0.5], [0.5, 1.0]]), np.eye(2))
fast = settings(deadline=None, max_examples=40)
seeds = st.integers(0, 2**32 - 1)


def targets(rng, count):
    roots = rng.normal(0.0, 0.6, (count, 4, 4))
    return rng.normal(0.0, 1.0, (count, 4)), roots @ np.swapaxes(roots, 1, 2) + 0.1 * np.eye(4)


def kalman(mean, covariance, y):
    """As in a textbook."""
    gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + R)
    return mean + gain @ (y - H @ mean), covariance - gain @ H @ covariance


def moments(weights, means, covariances):
    """Of a mixture."""
    mean = sum(w * m for w, m in zip(weights, means, strict=True))
    return mean, sum(
        w * (p + np.outer(m - mean, m - mean)) for w, m, p in zip(weights, means, covariances, strict=True)
    )


@fast
@given(seed=seeds, count=st.integers(0, 5))
def test_the_update_has_the_moments_of_the_mixture(seed, count):
    rng = np.random.default_rng(seed)
    (mean,), (covariance,) = targets(rng, 1)
    y = rng.normal(0.0, 3.0, (count, 2))
    beta = rng.dirichlet(np.ones(count + 1))
    parts = [(mean, covariance), *(kalman(mean, covariance, each) for each in y)]
    expected = moments(beta, *zip(*parts, strict=True))
    found = jpda_update(mean, covariance, y, H, R, beta[1:])
    for ours, theirs in zip(found, expected, strict=True):
        assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10)


@fast
@given(seed=seeds, own=st.integers(0, 2))
def test_a_certain_measurement_is_a_kalman_update(seed, own):
    rng = np.random.default_rng(seed)
    (mean,), (covariance,) = targets(rng, 1)
    y = rng.normal(0.0, 3.0, (3, 2))
    found = jpda_update(mean, covariance, y, H, R, np.eye(3)[own])
    for ours, theirs in zip(found, kalman(mean, covariance, y[own]), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10)


@fast
@given(seed=seeds, count=st.integers(0, 3))
def test_nothing_associated_changes_nothing(seed, count):
    rng = np.random.default_rng(seed)
    (mean,), (covariance,) = targets(rng, 1)
    found = jpda_update(mean, covariance, rng.normal(0.0, 3.0, (count, 2)), H, R, np.zeros(count))
    assert np.array_equal(found[0], mean)
    assert found[1] == pytest.approx(covariance, rel=1e-12, abs=1e-12)


@settings(deadline=None, max_examples=12)
@given(seed=seeds)
def test_a_step_of_a_tracker_is_the_bayesian_one_over_all_joint_associations(seed):
    """With the likelihood of everything under each joint association, eq 7, rather than weights and beta."""
    rng = np.random.default_rng(seed)
    means, covariances = targets(rng, 3)
    y = np.vstack([means[:2] @ H.T + rng.normal(0.0, 0.5, (2, 2)), rng.uniform(-3.0, 3.0, (2, 2))])
    detection, alarms, gate = 0.8, 0.2, 9.0
    places, spreads = predict_measurement(means, covariances, H, R)
    weights = gated_weights(y, places, spreads, gate, detection, alarms)

    posteriors, parts = [], []
    for pairs, _ in matchings(weights > 0.0):
        density = alarms ** (len(y) - len(pairs)) * detection ** len(pairs) * (1 - detection) ** (3 - len(pairs))
        for j, k in pairs:
            density *= multivariate_normal.pdf(y[j], places[k], spreads[k])
        posteriors.append(density)
        own = {k: j for j, k in pairs}
        parts.append(
            [kalman(means[k], covariances[k], y[own[k]]) if k in own else (means[k], covariances[k]) for k in range(3)]
        )
    posteriors = np.array(posteriors) / sum(posteriors)

    found = jpda_updates(means, covariances, y, H, R, probabilities(weights))
    for k in range(3):
        expected = moments(posteriors, *zip(*(part[k] for part in parts), strict=True))
        assert found[0][k] == pytest.approx(expected[0], rel=1e-9, abs=1e-9)
        assert found[1][k] == pytest.approx(expected[1], rel=1e-9, abs=1e-9)
    assert posteriors.max() == pytest.approx(max(w for _, w in matchings(weights)) / partition(weights), rel=1e-9)


@fast
@given(seed=seeds, exponent=st.integers(0, 12))
def test_a_covariance_stays_one_when_measurements_are_exact(seed, exponent):
    rng = np.random.default_rng(seed)
    (mean,), (covariance,) = targets(rng, 1)
    y, beta = rng.normal(0.0, 3.0, (4, 2)), rng.dirichlet(np.full(5, 0.1))[1:]
    _, found = jpda_update(mean, covariance, y, H, R * 10.0**-exponent, beta)
    assert np.array_equal(found, found.T)
    assert np.linalg.eigvalsh(found).min() > 0.0


def nees_of_drawn_worlds(runs, assumed_detection):
    """Of two targets close together, drawn from the priors, seen with p_d = 0.7 among 0.3 false alarms a square metre."""
    rng = np.random.default_rng(8)
    means, covariances = np.array([[0.0, 0.0], [1.0, 0.5]]), np.array([[[1.0, 0.3], [0.3, 0.6]], 0.7 * np.eye(2)])
    roots, noise, half_m = np.linalg.cholesky(covariances), np.linalg.cholesky(R), 6.0
    places, spreads = predict_measurement(means, covariances, np.eye(2), R)
    found = []
    for _ in range(runs):
        x = means + (roots @ rng.standard_normal((2, 2, 1)))[..., 0]
        seen = (x + rng.standard_normal((2, 2)) @ noise.T)[rng.random(2) < 0.7]
        false = rng.uniform(-half_m, half_m, (rng.poisson(0.3 * (2.0 * half_m) ** 2), 2))
        y = np.vstack([seen, false])
        weights = gated_weights(y, places, spreads, 16.0, assumed_detection, 0.3)
        m, p = jpda_updates(means, covariances, y, np.eye(2), R, association_probabilities(weights))
        found.append(sum(nees(x[k] - m[k], p[k]) for k in range(2)))
    return np.array(found)


@pytest.mark.slow
def test_errors_are_as_large_as_the_covariances_say():
    """The mean NEES given any measurements is the number of dimensions, though errors are far from normal; and a tracker
    that takes detection for nearly certain is found out.
    """
    deviations = []
    for assumed_detection in (0.7, 0.98):
        found = nees_of_drawn_worlds(5000, assumed_detection)
        deviations.append((found.mean() - 4.0) / (found.std() / math.sqrt(len(found))))
    assert abs(deviations[0]) < 4.0 < deviations[1]


def test_prediction_matches_samples_and_works_for_several_targets():
    rng = np.random.default_rng(2)
    means, covariances = targets(rng, 2)
    found_means, found_covariances = gaussian_predict(means, covariances, F, Q)
    for k in range(2):
        count = 200_000
        x = rng.multivariate_normal(means[k], covariances[k], count) @ F.T + rng.multivariate_normal(
            np.zeros(4), Q, count
        )
        sd = np.sqrt(np.diag(found_covariances[k]))
        assert np.abs((x.mean(axis=0) - found_means[k]) / sd).max() < 5.0 / math.sqrt(count)
        assert np.abs(np.cov(x.T) - found_covariances[k]).max() < 10.0 * sd.max() ** 2 / math.sqrt(count)
        one = gaussian_predict(means[k], covariances[k], F, Q)
        assert one[0] == pytest.approx(found_means[k], rel=1e-12)
        assert one[1] == pytest.approx(found_covariances[k], rel=1e-12)


def test_no_targets_and_no_measurements():
    found = jpda_updates(np.zeros((0, 4)), np.zeros((0, 4, 4)), np.zeros((3, 2)), H, R, np.zeros((3, 0)))
    assert found[0].shape == (0, 4)
    means, covariances = targets(np.random.default_rng(3), 2)
    found = jpda_updates(means, covariances, np.zeros((0, 2)), H, R, np.zeros((0, 2)))
    assert np.array_equal(found[0], means)


@pytest.mark.parametrize(
    ("beta", "message"),
    [
        ([0.7, 0.6], "sum of at most 1, got a least of 0.6 and a sum of 1.3"),
        ([-0.1, 0.6], "0 or more"),
        ([math.nan, 0.5], "0 or more"),
        ([0.5], "one for each of 2 measurements"),
    ],
)
def test_probabilities_that_are_none_are_refused(beta, message):
    with pytest.raises(ValueError, match=message):
        jpda_update(np.zeros(4), np.eye(4), np.zeros((2, 2)), H, R, np.array(beta))


def test_probabilities_of_other_targets_are_refused():
    with pytest.raises(ValueError, match=r"probabilities: expected shape \(2, 3\), got \(3, 2\)"):
        jpda_updates(np.zeros((3, 4)), np.tile(np.eye(4), (3, 1, 1)), np.zeros((2, 2)), H, R, np.zeros((3, 2)))
