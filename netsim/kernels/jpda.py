"""Kalman filtering of targets whose measurements are known by their association probabilities only (JPDA).

The state of a target is a mixture over which measurement is its own, if any (Oh 2010, eq 1); one Gaussian with the
mixture's mean and covariance takes its place (Bar-Shalom and Fortmann 1988, Tracking and Data Association). States have S
dimensions. A measurement has M and is linear in the state: y = H x + v, v normal with covariance R.

A step of a tracker: `gaussian_predict`, `predict_measurement`, `netsim.kernels.event_gating.gated_weights` with what that
gives, association probabilities of the weights, `jpda_updates`.
"""

import numpy as np

from netsim.kernels.semiring import FloatArray

_ROUNDING = 1e-9


def gaussian_predict(
    mean: FloatArray, covariance: FloatArray, transition: FloatArray, process_noise: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of F x + w: F m and F P F' + Q.

    Args:
        mean: m of one target, shape (S,), or of several, shape (K, S).
        covariance: P, shape (S, S) or (K, S, S).
        transition: F, shape (S, S).
        process_noise: Q, the covariance of w, shape (S, S).
    """
    return mean @ transition.T, _symmetric(transition @ covariance @ transition.T + process_noise)


def predict_measurement(
    mean: FloatArray, covariance: FloatArray, observation_matrix: FloatArray, noise_covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of a target's measurement: H m and H P H' + R; shapes (M,) and (M, M), or (K, M) and (K, M, M).

    Args:
        mean: m, shape (S,) or (K, S).
        covariance: P, shape (S, S) or (K, S, S).
        observation_matrix: H, shape (M, S).
        noise_covariance: R, shape (M, M).
    """
    return gaussian_predict(mean, covariance, observation_matrix, noise_covariance)


def jpda_update(
    mean: FloatArray,
    covariance: FloatArray,
    measurements: FloatArray,
    observation_matrix: FloatArray,
    noise_covariance: FloatArray,
    probabilities: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """One target's state after measurements each of which is its own with some probability.

    With gain K and innovations v_j, the mean moves by K v, v = sum_j beta_j v_j. The covariance is
    beta_0 P + (1 - beta_0) P_c + K (sum_j beta_j v_j v_j' - v v') K', with P_c that of a Kalman update. Every term is added
    in a form that rounding cannot make negative: P_c as (I - K H) P (I - K H)' + K R K', and the spread of the innovations
    about v, a missed detection's innovation being 0.

    Args:
        mean: Predicted, shape (S,).
        covariance: Predicted, shape (S, S).
        measurements: y_j, shape (N, M).
        observation_matrix: H, shape (M, S).
        noise_covariance: R, shape (M, M).
        probabilities: beta_j, shape (N,); what is missing to one is beta_0, that none is the target's.

    Returns:
        Mean, shape (S,), and covariance, shape (S, S).

    Raises:
        ValueError: For probabilities of another number than the measurements, below 0, or of a sum above 1.
    """
    beta = _checked(probabilities, len(measurements))
    missed = max(0.0, 1.0 - float(beta.sum()))
    predicted, innovation_covariance = predict_measurement(mean, covariance, observation_matrix, noise_covariance)
    gain = np.linalg.solve(innovation_covariance, observation_matrix @ covariance).T
    innovations = np.asarray(measurements, dtype=float).reshape(len(beta), len(predicted)) - predicted
    combined = beta @ innovations
    about = innovations - combined
    spread = (beta[:, None] * about).T @ about + missed * np.outer(combined, combined)
    kept = np.eye(len(mean)) - gain @ observation_matrix
    updated = kept @ covariance @ kept.T + gain @ noise_covariance @ gain.T
    total = missed * covariance + (1.0 - missed) * updated + gain @ spread @ gain.T
    return mean + gain @ combined, _symmetric(total)


def jpda_updates(
    means: FloatArray,
    covariances: FloatArray,
    measurements: FloatArray,
    observation_matrix: FloatArray,
    noise_covariance: FloatArray,
    probabilities: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """`jpda_update` of several targets, each by its own column of probabilities.

    Args:
        means: Predicted, shape (K, S).
        covariances: Predicted, shape (K, S, S).
        measurements: y_j, shape (N, M).
        observation_matrix: H, shape (M, S).
        noise_covariance: R, shape (M, M).
        probabilities: beta_jk, shape (N, K).

    Returns:
        Means, shape (K, S), and covariances, shape (K, S, S).

    Raises:
        ValueError: As `jpda_update`, or for probabilities of another shape.
    """
    if np.shape(probabilities) != (len(measurements), len(means)):
        text = f"probabilities: expected shape {(len(measurements), len(means))}, got {np.shape(probabilities)}"
        raise ValueError(text)
    found_means, found_covariances = np.array(means, dtype=float), np.array(covariances, dtype=float)
    for k, beta in enumerate(np.asarray(probabilities).T):
        found_means[k], found_covariances[k] = jpda_update(
            found_means[k], found_covariances[k], measurements, observation_matrix, noise_covariance, beta
        )
    return found_means, found_covariances


def _checked(probabilities: FloatArray, count: int) -> FloatArray:
    beta = np.asarray(probabilities, dtype=float)
    if beta.shape != (count,):
        text = f"probabilities: expected one for each of {count} measurements, got shape {beta.shape}"
        raise ValueError(text)
    if not ((beta >= 0.0).all() and beta.sum() <= 1.0 + _ROUNDING):
        text = (
            f"probabilities of a target's measurements: expected 0 or more with a sum of at most 1, got a least of "
            f"{beta.min():g} and a sum of {beta.sum():g}; take an estimator whose probabilities are normalised by event"
        )
        raise ValueError(text)
    return beta


def _symmetric(matrix: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (matrix + np.swapaxes(matrix, -1, -2)))
