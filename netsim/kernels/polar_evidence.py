r"""Evidence of range and bearing measurements of one target, by quadrature over its Gaussian prior.

A sensor at $s$ measures the target's range $|x - s|$, its bearing $\arg(x - s)$ or both, with Gaussian noise, that of a
bearing wrapped to $(-\pi, \pi]$. The evidence of a joint hypothesis is the integral over $x \sim N(\mu, P)$ of the product
of its likelihoods. It is summed over a uniform grid in the coordinates in which the prior is standard normal: for smooth
integrands of Gaussian width w the rectangle rule errs by about $2 \exp(-2 \pi^2 w^2 / h^2)$, 5e-9 for a spacing of h = w.
Smoothness ends at the sensor itself, where a bearing has no value and a range a kink. As tested: 2e-6 of each evidence
where no sensor stands within the prior's mass; where one does, 1e-4 (ranges) and 5e-4 (with bearings) of the target's
largest evidence, so that hypotheses which are far less likely than others are known less exactly: with bearings near a
sensor, 3e-3 in log evidence at a thousandth of the best one's.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.injections import check_states
from netsim.kernels.semiring import FloatArray

PolarKind = Literal["range_bearing", "range", "bearing"]
REACH_SD = 7.0
"""Half width of the grid in standard deviations of the prior; beyond it lie 3e-12 of its mass."""
MOST_POINTS = 4_000_000
_CHUNK = 4096


def polar_log_evidence(
    mean_m: FloatArray,
    covariance_m2: FloatArray,
    sensors_m: FloatArray,
    measurements: Sequence[FloatArray],
    kind: PolarKind,
    range_sd_m: float,
    bearing_sd_rad: float,
) -> FloatArray:
    """Log evidence of every joint hypothesis about one target.

    Args:
        mean_m: Prior mean, shape (2,).
        covariance_m2: Prior covariance, shape (2, 2), positive definite.
        sensors_m: Positions of the sensors that cover the target, shape (k, 2).
        measurements: For each of them its measurements, shape (q_s, 2) for `range_bearing` (metres, radians), else (q_s, 1).
        kind: What is measured.
        range_sd_m: Standard deviation of a range.
        bearing_sd_rad: Standard deviation of a bearing.

    Returns:
        Shape (q_1 + 1, ..., q_k + 1): index 0 of an axis is "missed", index a is measurement a - 1; densities are in 1/m,
        1/rad or their product for each measurement.

    Raises:
        ScenarioError: When there are too many hypotheses, or the noise is too narrow against the prior for the grid.
    """
    shape = tuple(len(values) + 1 for values in measurements)
    check_states(int(np.prod([float(size) for size in shape])), "the joint association of one target")
    if all(size == 1 for size in shape):
        return np.zeros(shape)
    half = len(shape) // 2
    root = np.linalg.cholesky(covariance_m2)
    width_m = _width_m(kind, range_sd_m, bearing_sd_rad, mean_m, sensors_m)
    total = np.zeros((int(np.prod(shape[:half])), int(np.prod(shape[half:]))))
    for offsets in _grid(_steps(width_m, covariance_m2, len(shape))):
        points_m = mean_m + offsets @ root.T
        weight = np.exp(-0.5 * (offsets**2).sum(axis=1))
        tables = [
            np.exp(_log_likelihood(points_m - place_m, values, kind, range_sd_m, bearing_sd_rad))
            for place_m, values in zip(sensors_m, measurements, strict=True)
        ]
        total += (_khatri_rao(tables[:half], len(weight)) * weight) @ _khatri_rao(tables[half:], len(weight)).T
    mass = total[0, 0]  # of the prior on the grid: the sums are ratios to it
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(total / mass)).reshape(shape)


def _width_m(
    kind: PolarKind, range_sd_m: float, bearing_sd_rad: float, mean_m: FloatArray, sensors_m: FloatArray
) -> float:
    """Least width of a likelihood around the target, in metres."""
    least_m = float(np.linalg.norm(sensors_m - mean_m, axis=1).min())
    across_m = bearing_sd_rad * max(0.5 * least_m, 1.0)
    widths = {"range": (range_sd_m,), "bearing": (across_m,), "range_bearing": (range_sd_m, across_m)}
    return min(widths[kind])


def _steps(width_m: float, covariance_m2: FloatArray, sensors: int) -> int:
    """Grid points from the centre to the rim: the likelihoods of all sensors together are narrower than one of them."""
    sd_m = np.sqrt(np.linalg.norm(covariance_m2, 2))
    return int(np.ceil(REACH_SD / min(float(width_m / sd_m / np.sqrt(sensors)), 0.5)))


def _grid(steps: int) -> Sequence[FloatArray]:
    """Points of the grid in standard deviations, in chunks of shape (n, 2)."""
    if (2 * steps + 1) ** 2 > MOST_POINTS:
        text = (
            f"the evidence of a target needs a grid of {(2 * steps + 1) ** 2} points, more than the {MOST_POINTS} "
            "supported: the measurements' noise is too small against the prior; raise it, or lower prior_variance_m2"
        )
        raise ScenarioError(text)
    axis = np.linspace(-REACH_SD, REACH_SD, 2 * steps + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    inside = np.hypot(x, y) <= REACH_SD
    points = np.column_stack([x[inside], y[inside]])
    return [points[begin : begin + _CHUNK] for begin in range(0, len(points), _CHUNK)]


def _log_likelihood(
    deltas_m: FloatArray, values: FloatArray, kind: PolarKind, range_sd_m: float, bearing_sd_rad: float
) -> FloatArray:
    """Log likelihood of missed (0) and of each measurement at each point, shape (q + 1, n)."""
    rows = np.zeros((len(values) + 1, len(deltas_m)))
    if kind in ("range", "range_bearing"):
        misfit = (values[:, :1] - np.hypot(deltas_m[:, 0], deltas_m[:, 1])) / range_sd_m
        rows[1:] += -0.5 * misfit**2 - np.log(np.sqrt(2.0 * np.pi) * range_sd_m)
    if kind in ("bearing", "range_bearing"):
        turn = values[:, -1:] - np.arctan2(deltas_m[:, 1], deltas_m[:, 0])
        rows[1:] += _log_wrapped_normal(turn, bearing_sd_rad)
    return rows


def _log_wrapped_normal(turn_rad: FloatArray, sd_rad: float) -> FloatArray:
    """Log density of a normal error on the circle: the sum over whole turns, the nearest of which suffice."""
    turn = np.mod(turn_rad + np.pi, 2.0 * np.pi) - np.pi
    most = int(np.ceil(8.0 * sd_rad / (2.0 * np.pi)))
    images = [-0.5 * ((turn + 2.0 * np.pi * k) / sd_rad) ** 2 for k in range(-most, most + 1)]
    return np.asarray(np.logaddexp.reduce(images) - np.log(np.sqrt(2.0 * np.pi) * sd_rad))


def _khatri_rao(tables: Sequence[FloatArray], points: int) -> FloatArray:
    """Products of one row of each table at every point, the last table's row varying fastest: shape (rows, points)."""
    product: FloatArray = np.ones((1, points))
    for table in tables:
        product = (product[:, None, :] * table[None, :, :]).reshape(-1, points)
    return product


def polar_operations(
    mean_m: FloatArray,
    covariance_m2: FloatArray,
    sensors_m: FloatArray,
    measurements: Sequence[int],
    kind: PolarKind,
    range_sd_m: float,
    bearing_sd_rad: float,
) -> int:
    """Estimate of the elementary operations of `polar_log_evidence`, with as many measurements of each sensor.

    At every point of the grid some 20 for the likelihood of each measurement (a root, an angle, an exponential), and two
    for each joint hypothesis.
    """
    if not any(measurements):
        return 0
    width_m = _width_m(kind, range_sd_m, bearing_sd_rad, mean_m, sensors_m)
    points = np.pi * float(_steps(width_m, covariance_m2, len(measurements))) ** 2
    return int(points * (20 * sum(measurements) + 2 * np.prod([count + 1.0 for count in measurements])))


def polar_false_alarm_log_density(values: FloatArray, kind: PolarKind, detection_radius_m: float) -> FloatArray:
    """Log density of false alarms uniform over the disc, in range, bearing or both, shape (q,).

    Over the disc of radius r a range has density 2 rho / r^2 and a bearing 1 / (2 pi), independently. A measured range at
    or beyond the rim, where noise may put it, gets that of the rim; one below a thousandth of r that of a thousandth.
    """
    total = np.zeros(len(values))
    if kind in ("range", "range_bearing"):
        inside_m = np.clip(values[:, 0], 1e-3 * detection_radius_m, detection_radius_m)
        total += np.log(2.0 * inside_m / detection_radius_m**2)
    if kind in ("bearing", "range_bearing"):
        total -= np.log(2.0 * np.pi)
    return total
