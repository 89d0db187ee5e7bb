"""Which measurement can be of which event, and with what weight: the edges of a data association graph.

With Gaussian predictions of the events' measurements, a pair is kept where the measurement is within a gate of the
prediction (Bar-Shalom and Fortmann 1988, Tracking and Data Association; Oh 2010, section VI). Its weight is
w_jk = alpha L(y_j | k), and a joint association has the product of its pairs' weights (Oh 2010, eq 8).
"""

import math

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.semiring import FloatArray


def weight_factor(detection_probability: float, false_alarm_density: float) -> float:
    """Alpha = p_d / (lambda_f (1 - p_d)), which turns a likelihood density into a weight (Oh 2010, eq 8).

    Args:
        detection_probability: p_d, at least 0 and below 1: an event that is never missed leaves no finite weight.
        false_alarm_density: lambda_f, above 0: expected false measurements per unit of the space of measurements.

    Returns:
        Alpha, in units of the reciprocal of the density.

    Raises:
        ScenarioError: For numbers outside these bounds.
    """
    if not 0.0 <= detection_probability < 1.0:
        text = (
            f"detection probability: expected 0 or more and below 1, got {detection_probability:g}; with certain detection "
            "the weight of a pair is infinite, give for example 0.999"
        )
        raise ScenarioError(text)
    if not (false_alarm_density > 0.0 and math.isfinite(false_alarm_density)):
        text = (
            f"false alarm density: expected above 0 and finite, got {false_alarm_density:g}; without false alarms the "
            "weight of a pair is infinite, give a small density"
        )
        raise ScenarioError(text)
    return detection_probability / (1.0 - detection_probability) / false_alarm_density


def gated_weights(
    measurements_m: FloatArray,
    predicted_m: FloatArray,
    covariance_m2: FloatArray,
    gate: float,
    detection_probability: float,
    false_alarm_density_per_m2: float,
) -> FloatArray:
    """Weights of all pairs of measurements and events in the plane.

    Args:
        measurements_m: y_j, shape (N, 2).
        predicted_m: Predicted measurement of each event, shape (K, 2).
        covariance_m2: Of the measurement about its prediction, for all events, shape (2, 2), or for each, shape (K, 2, 2).
        gate: Largest squared Mahalanobis distance, itself left out; chi-squared with two degrees of freedom for the event's
            own measurement, which is lost with probability exp(-gate / 2).
        detection_probability: p_d, at least 0 and below 1.
        false_alarm_density_per_m2: lambda_f, above 0.

    Returns:
        alpha L_jk, a number without unit: shape (N, K), zero where a pair is not gated.

    Raises:
        ScenarioError: For a probability or a density that leaves no finite weight.
        ValueError: For arrays of other shapes, or a covariance that is not positive definite.
    """
    alpha = weight_factor(detection_probability, false_alarm_density_per_m2)
    measurements, predicted = _points(measurements_m, "measurements"), _points(predicted_m, "predictions")
    squared, area_m2 = _squared_distance(measurements[:, None] - predicted, _roots(covariance_m2, len(predicted)))
    weights = alpha * np.exp(-0.5 * squared) / (2.0 * np.pi * area_m2)
    return np.where(squared < gate, weights, 0.0)


def require_weights(weights: FloatArray) -> FloatArray:
    """The weights as floats.

    Raises:
        ValueError: If they are no matrix, or one is negative or not finite.
    """
    found = np.asarray(weights, dtype=float)
    if found.ndim != 2:
        text = f"weights: expected shape (measurements, events), got {found.shape}"
        raise ValueError(text)
    if not (np.isfinite(found).all() and (found >= 0.0).all()):
        text = "weights: expected finite numbers, 0 or more, got others; a pair that cannot be has weight 0"
        raise ValueError(text)
    return found


def _points(points_m: FloatArray, what: str) -> FloatArray:
    points = np.asarray(points_m, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2:
        text = f"{what}: expected shape (points, 2), got {points.shape}"
        raise ValueError(text)
    return points


def _roots(covariance_m2: FloatArray, events: int) -> FloatArray:
    """Lower Cholesky factors, shape (2, 2) or (K, 2, 2)."""
    covariance = np.asarray(covariance_m2, dtype=float)
    if covariance.shape not in ((2, 2), (events, 2, 2)):
        text = f"covariance: expected shape (2, 2) or ({events}, 2, 2), got {covariance.shape}"
        raise ValueError(text)
    try:
        return np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        text = "covariance: expected a positive definite matrix, got one that is not"
        raise ValueError(text) from None


def _squared_distance(offsets_m: FloatArray, roots_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared Mahalanobis distance of offsets, shape (N, K), and the square root of the covariances' determinants."""
    first = offsets_m[..., 0] / roots_m[..., 0, 0]
    second = (offsets_m[..., 1] - roots_m[..., 1, 0] * first) / roots_m[..., 1, 1]
    return first * first + second * second, roots_m[..., 0, 0] * roots_m[..., 1, 1]
