"""Exact association probabilities, and a tracker's step with them, against Stone Soup and the EHM2 of its plugin PyEHM.

Horridge and Maskell 2006 (Real-time tracking of hundreds of targets with efficient exact JPDAF implementation). EHM2 takes
likelihoods by target, the missed detection's first, and sums over nets of hypotheses: it shares nothing with the sums over
matchings but what is to be found.
"""

from datetime import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import probabilities, random_tree, random_weights

from netsim.kernels.association_bp import propagate
from netsim.kernels.event_gating import gated_weights
from netsim.kernels.jpda import gaussian_predict, jpda_updates, predict_measurement
from netsim.kernels.matchings import association_probabilities

ehm = pytest.importorskip("pyehm.core", reason="PyEHM, of the test extra, is not installed")
fast = settings(deadline=None, max_examples=40)
seeds = st.integers(0, 2**32 - 1)
EVENTS_M = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1)], dtype=float)


def ehm2(weights):
    """beta, shape (N, K), of at least one measurement and event."""
    likelihood = np.hstack([np.ones((weights.shape[1], 1)), weights.T])
    return ehm.EHM2().run((likelihood > 0.0).astype(int), likelihood)[:, 1:].T


def agrees(found, weights):
    assert found == pytest.approx(ehm2(weights), rel=1e-9, abs=1e-15)


@fast
@given(seeds, st.integers(1, 5), st.integers(1, 4), st.sampled_from([0.3, 0.6, 1.0]))
def test_small_graphs_agree_and_so_does_enumeration(seed, measurements, events, share):
    weights = random_weights(seed, measurements, events, share)
    agrees(association_probabilities(weights), weights)
    agrees(probabilities(weights), weights)


@fast
@given(seeds, st.integers(1, 14), st.integers(1, 7), st.floats(0.1, 1.0), st.sampled_from([0.0, 1.5, 4.0]))
def test_graphs_beyond_enumeration_agree(seed, measurements, events, share, spread):
    weights = random_weights(seed, measurements, events, share, spread)
    agrees(association_probabilities(weights), weights)


@pytest.mark.parametrize("seed", range(2))
def test_the_papers_set_up_1_agrees(seed):
    """Oh 2010, section VI: 6 events and 24 measurements, millions of matchings."""
    measurements_m = np.random.default_rng(seed).uniform(-1.4, 1.4, (24, 2))
    weights = gated_weights(measurements_m, EVENTS_M, 0.5 * np.eye(2), 4.0, 0.8, 0.5)
    agrees(association_probabilities(weights), weights)


@pytest.mark.parametrize("seed", range(10))
def test_the_papers_set_up_2_agrees(seed):
    """Its ten cases of 10 events and 40 measurements."""
    rng = np.random.default_rng(seed)
    measurements_m, events_m = rng.uniform(0.0, 1.0, (40, 2)), rng.uniform(0.0, 1.0, (10, 2))
    weights = gated_weights(measurements_m, events_m, 0.01 * np.eye(2), 4.0, 0.8, 0.1)
    agrees(association_probabilities(weights), weights)


@fast
@given(seeds, st.integers(1, 40), st.integers(1, 40))
def test_belief_propagation_agrees_on_trees_of_any_size(seed, measurements, events):
    weights = random_tree(seed, measurements, events)
    agrees(propagate(weights, 1e-13).probabilities, weights)


F, Q = np.eye(4) + np.eye(4, k=2), 0.1 * np.eye(4)
H, R = np.eye(2, 4), np.array([[0.3, 0.1], [0.1, 0.4]])
DETECTION, ALARMS_PER_M2 = 0.8, 0.2


def stone_soup_step(means, covariances, measurements_m):
    """Means and covariances after a second: prediction, gates wide open, JPDA with EHM2, and moment matching."""
    from stonesoup.functions import gm_reduce_single
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.plugins.pyehm import JPDAWithEHM2
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import CovarianceMatrix, StateVector, StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater

    start, then = datetime(2026, 1, 1, 0, 0, 0), datetime(2026, 1, 1, 0, 0, 1)
    motion = LinearGaussianTimeInvariantTransitionModel(transition_matrix=F, covariance_matrix=CovarianceMatrix(Q))
    sensor = LinearGaussian(4, (0, 1), CovarianceMatrix(R))
    updater = KalmanUpdater(sensor)
    hypothesiser = PDAHypothesiser(
        KalmanPredictor(motion), updater, ALARMS_PER_M2, prob_detect=DETECTION, prob_gate=1.0, include_all=True
    )
    tracks = [Track([GaussianState(m, p, start)]) for m, p in zip(means, covariances, strict=True)]
    detections = [Detection(StateVector(y), then, measurement_model=sensor) for y in measurements_m]
    joint = JPDAWithEHM2(hypothesiser).associate(tracks, detections, then)
    found = []
    for track in tracks:
        states = [updater.update(h) if h else h.prediction for h in joint[track]]
        weights = np.array([float(h.probability) for h in joint[track]])
        vectors = StateVectors([state.state_vector for state in states])
        found.append(gm_reduce_single(vectors, np.stack([state.covar for state in states], axis=2), weights))
    return np.array([np.ravel(m) for m, _ in found], float), np.array([p for _, p in found], float)


def test_a_trackers_steps_are_stone_soups():
    rng = np.random.default_rng(11)
    means = theirs = rng.normal(0.0, 1.5, (3, 4))
    covariances = their_covariances = np.tile(np.diag([1.0, 1.0, 0.5, 0.5]), (3, 1, 1))
    for _ in range(3):
        measurements_m = rng.uniform(-4.0, 4.0, (5, 2))
        theirs, their_covariances = stone_soup_step(theirs, their_covariances, measurements_m)
        means, covariances = gaussian_predict(means, covariances, F, Q)
        places_m, spreads_m2 = predict_measurement(means, covariances, H, R)
        weights = gated_weights(measurements_m, places_m, spreads_m2, np.inf, DETECTION, ALARMS_PER_M2)
        beta = association_probabilities(weights)
        means, covariances = jpda_updates(means, covariances, measurements_m, H, R, beta)
        assert means == pytest.approx(theirs, rel=1e-9, abs=1e-9)
        assert covariances == pytest.approx(their_covariances, rel=1e-9, abs=1e-9)
