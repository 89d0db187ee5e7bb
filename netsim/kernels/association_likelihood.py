"""Likelihoods of data association: joint evidence of position measurements of one target, and false alarms."""

from collections.abc import Sequence

import numpy as np

from netsim.kernels.injections import check_states
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vertex import along


def log_evidence(
    mean_m: FloatArray, covariance_m2: FloatArray, noise_m2: FloatArray, measurements_m: Sequence[FloatArray]
) -> FloatArray:
    r"""Log evidence of every joint hypothesis about one target (Chen et al. 2006, section 3.2).

    A target at $x \sim N(\mu, P)$ gives each sensor that detects it a measurement $y \sim N(x, R)$. With $m$
    measurements of deviations $z = y - \mu$ the integral over $x$ is, in information form,
    $-\frac12 (\sum z^T R^{-1} z - h^T \Lambda^{-1} h) - m \ln 2\pi - \frac m2 \ln |R| - \frac12 \ln |P \Lambda|$ with
    $h = R^{-1} \sum z$ and $\Lambda = P^{-1} + m R^{-1}$.

    Args:
        mean_m: Prior mean, shape (2,).
        covariance_m2: Prior covariance P, shape (2, 2), positive definite.
        noise_m2: Measurement covariance R, shape (2, 2), positive definite.
        measurements_m: For each sensor that covers the target its measurements, shape (q_s, 2).

    Returns:
        Shape (q_1 + 1, ..., q_k + 1): index 0 of an axis is "missed", index a is measurement a - 1. With no sensor a
        scalar array, 0. Detection probabilities are not included.

    Raises:
        ScenarioError: When there are too many hypotheses to tabulate.
    """
    shape = tuple(len(points) + 1 for points in measurements_m)
    check_states(int(np.prod([float(size) for size in shape])), "the joint association of one target")
    count, total, spread = _sums(mean_m, np.asarray(np.linalg.inv(noise_m2), dtype=float), measurements_m, shape)
    return _evidence_of_sums(count, total, spread, covariance_m2, noise_m2)


def _sums(
    mean_m: FloatArray, noise_information: FloatArray, measurements_m: Sequence[FloatArray], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Number of measurements, sum of deviations (last axis 2) and sum of their squared lengths, per hypothesis."""
    count, total, spread = np.zeros(shape), np.zeros((*shape, 2)), np.zeros(shape)
    for axis, points in enumerate(measurements_m):
        deviations = np.vstack([np.zeros((1, 2)), np.reshape(points, (-1, 2)) - mean_m])
        squares = np.einsum("ai,ij,aj->a", deviations, noise_information, deviations)
        count += along(np.minimum(np.arange(len(deviations)), 1.0), axis, len(shape))
        spread += along(squares, axis, len(shape))
        for coordinate in (0, 1):
            total[..., coordinate] += along(deviations[:, coordinate], axis, len(shape))
    return count, total, spread


def _evidence_of_sums(
    count: FloatArray, total: FloatArray, spread: FloatArray, covariance_m2: FloatArray, noise_m2: FloatArray
) -> FloatArray:
    most = int(count.max())
    noise_information, identity = np.linalg.inv(noise_m2), np.eye(2)
    gains, offsets = np.zeros((most + 1, 2, 2)), np.zeros(most + 1)
    log_noise = np.linalg.slogdet(noise_m2)[1]
    for m in range(most + 1):
        scaled = identity + m * covariance_m2 @ noise_information  # P Lambda
        gains[m] = noise_information @ np.linalg.solve(scaled, covariance_m2) @ noise_information
        offsets[m] = -m * np.log(2.0 * np.pi) - 0.5 * (m * log_noise + np.linalg.slogdet(scaled)[1])
    index = count.astype(np.int64)
    gained = np.einsum("...i,...ij,...j->...", total, gains[index], total)
    return np.asarray(offsets[index] - 0.5 * (spread - gained))


def false_alarm_log_density(detection_radius_m: float) -> float:
    """Log density of a false alarm, uniform over the disc in which a sensor detects, in 1/m^2."""
    return float(-np.log(np.pi * detection_radius_m**2))
