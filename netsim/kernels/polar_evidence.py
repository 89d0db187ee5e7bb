r"""Evidence of range and bearing measurements of one target, by quadrature over its Gaussian prior.

A sensor at $s$ measures the target's range $|x - s|$, its bearing $\arg(x - s)$ or both, with Gaussian noise, that of a
bearing wrapped to $(-\pi, \pi]$. The evidence of a joint hypothesis is the integral over $x \sim N(\mu, P)$ of the product
of its likelihoods. It is summed over a uniform grid in the coordinates in which the prior is standard normal: for smooth
integrands of Gaussian width w the rectangle rule errs by about $2 \exp(-2 \pi^2 w^2 / h^2)$, 5e-9 for a spacing of h = w.
Smoothness ends at the sensor itself, where a bearing has no value and a range a kink. Bearings narrow towards a sensor
without end; the grid follows them down to half the sensor's distance from the prior's mean or, where that is less, to 0.45
standard deviations of the prior, whose disc holds little of its mass. So the grid has no length of its own: with all
lengths scaled alike the evidence of bearings is the same. As tested: 2e-6 of each evidence
where no sensor stands within the prior's mass; where one does, 1e-4 (ranges) and 5e-4 (with bearings) of the target's
largest evidence, so that hypotheses which are far less likely than others are known less exactly: with bearings near a
sensor, 3e-3 in log evidence at a thousandth of the best one's.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.injections import check_states
from netsim.kernels.semiring import FloatArray

PolarKind = Literal["range_bearing", "range", "bearing"]
REACH_SD = 7.0
"""Half width of the grid in standard deviations of the prior; beyond it lie 3e-12 of its mass."""
MOST_POINTS = 4_000_000
MOST_TERMS = 40_000_000_000
"""Points of the grid times joint hypotheses; some 1e9 are summed in a second."""
FLOOR_SD = 0.45
"""Grids do not get finer near a sensor than for one at twice this many standard deviations of the prior from its mean."""
_CHUNK = 4096
_MEMO_ENTRIES = 10_000
"""Tables up to this size are remembered: host, sensors, scores and integer programme ask for the same ones."""


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
    entries = int(np.prod([float(size) for size in shape]))
    check_states(entries, "the joint association of one target")
    if entries == 1:
        return np.zeros(shape)
    arrays = [np.ascontiguousarray(each, dtype=float) for each in (mean_m, covariance_m2, sensors_m, *measurements)]
    keys = tuple((each.tobytes(), each.shape) for each in arrays)
    tabulate = _remembered if entries <= _MEMO_ENTRIES else _remembered.__wrapped__
    return tabulate(keys, kind, range_sd_m, bearing_sd_rad).copy()


@lru_cache(maxsize=256)
def _remembered(
    keys: tuple[tuple[bytes, tuple[int, ...]], ...], kind: PolarKind, range_sd_m: float, bearing_sd_rad: float
) -> FloatArray:
    """As `polar_log_evidence`, of arrays as (bytes, shape)."""
    mean_m, covariance_m2, sensors_m, *measurements = (np.frombuffer(data).reshape(shape) for data, shape in keys)
    return _summed(mean_m, covariance_m2, sensors_m, measurements, kind, range_sd_m, bearing_sd_rad)


def _summed(
    mean_m: FloatArray,
    covariance_m2: FloatArray,
    sensors_m: FloatArray,
    measurements: Sequence[FloatArray],
    kind: PolarKind,
    range_sd_m: float,
    bearing_sd_rad: float,
) -> FloatArray:
    """The sum over the grid."""
    shape = tuple(len(values) + 1 for values in measurements)
    half = len(shape) // 2
    root = np.linalg.cholesky(covariance_m2)
    steps = _steps(mean_m, covariance_m2, sensors_m, kind, range_sd_m, bearing_sd_rad)
    _check_points(steps)
    check_states((2 * steps + 1) ** 2 * int(np.prod(shape)), "the quadrature of one target's evidence", MOST_TERMS)
    total = np.zeros((int(np.prod(shape[:half])), int(np.prod(shape[half:]))))
    for offsets in _grid(steps):
        points_m = mean_m + offsets @ root.T
        weight = np.exp(-0.5 * (offsets**2).sum(axis=1))
        tables = [
            _likelihood(points_m - place_m, values, kind, range_sd_m, bearing_sd_rad)
            for place_m, values in zip(sensors_m, measurements, strict=True)
        ]
        first, second = (_khatri_rao(part, len(weight)) for part in (tables[:half], tables[half:]))
        # Not a matrix product: BLAS may split it over threads, and runs must be equal bit for bit.
        total += np.einsum("ap,bp->ab", first * weight, second)
    mass = total[0, 0]  # of the prior on the grid: the sums are ratios to it
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(total / mass)).reshape(shape)


def quadrature_points(
    mean_m: FloatArray,
    covariance_m2: FloatArray,
    sensors_m: FloatArray,
    kind: PolarKind,
    range_sd_m: float,
    bearing_sd_rad: float,
) -> int:
    """How many points the square around the grid of `polar_log_evidence` has; arguments and errors as there."""
    steps = _steps(mean_m, covariance_m2, sensors_m, kind, range_sd_m, bearing_sd_rad)
    _check_points(steps)
    return (2 * steps + 1) ** 2


def _steps(
    mean_m: FloatArray,
    covariance_m2: FloatArray,
    sensors_m: FloatArray,
    kind: PolarKind,
    range_sd_m: float,
    bearing_sd_rad: float,
) -> int:
    """Steps of the grid from the prior's mean to its rim, so small that products of all sensors' likelihoods are smooth."""
    root = np.linalg.cholesky(covariance_m2)
    least_m = float(np.linalg.norm(sensors_m - mean_m, axis=1).min())
    floor_m = FLOOR_SD * float(np.prod(np.diag(root))) ** 0.5  # of the prior's geometric mean standard deviation
    across_m = bearing_sd_rad * max(0.5 * least_m, floor_m)
    widths_m = {"range": (range_sd_m,), "bearing": (across_m,), "range_bearing": (range_sd_m, across_m)}
    spacing_sd = min(widths_m[kind]) / len(sensors_m) ** 0.5 / float(np.linalg.norm(root, 2))
    return int(np.ceil(REACH_SD / min(spacing_sd, 0.5)))


def _check_points(steps: int) -> None:
    if (2 * steps + 1) ** 2 > MOST_POINTS:
        text = (
            f"the evidence of a target needs a grid of {(2 * steps + 1) ** 2:,} points, more than the {MOST_POINTS:,} "
            "supported: the measurements' noise is too small against the prior; raise it, or lower prior_variance_m2"
        )
        raise ScenarioError(text)


def _grid(steps: int) -> Sequence[FloatArray]:
    """Points of the grid in standard deviations, in chunks of shape (n, 2)."""
    axis = np.linspace(-REACH_SD, REACH_SD, 2 * steps + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    inside = np.hypot(x, y) <= REACH_SD
    points = np.column_stack([x[inside], y[inside]])
    return [points[begin : begin + _CHUNK] for begin in range(0, len(points), _CHUNK)]


def _likelihood(
    deltas_m: FloatArray, values: FloatArray, kind: PolarKind, range_sd_m: float, bearing_sd_rad: float
) -> FloatArray:
    """Likelihood of missed (0) and of each measurement at each point, shape (q + 1, n)."""
    rows = np.ones((len(values) + 1, len(deltas_m)))
    if not len(values):
        return rows
    if kind in ("range", "range_bearing"):
        misfit = (values[:, :1] - np.hypot(deltas_m[:, 0], deltas_m[:, 1])) / range_sd_m
        rows[1:] *= np.exp(-0.5 * misfit**2) / (np.sqrt(2.0 * np.pi) * range_sd_m)
    if kind in ("bearing", "range_bearing"):
        turn = values[:, -1:] - np.arctan2(deltas_m[:, 1], deltas_m[:, 0])
        rows[1:] *= _wrapped_normal(turn, bearing_sd_rad)
    return rows


def _wrapped_normal(turn_rad: FloatArray, sd_rad: float) -> FloatArray:
    """Density of a normal error on the circle: the sum over whole turns, of which those within eight deviations suffice."""
    turn = np.mod(turn_rad + np.pi, 2.0 * np.pi) - np.pi
    most = int(np.ceil(max(8.0 * sd_rad - np.pi, 0.0) / (2.0 * np.pi)))
    images = [np.exp(-0.5 * ((turn + 2.0 * np.pi * k) / sd_rad) ** 2) for k in range(-most, most + 1)]
    return np.asarray(sum(images) / (np.sqrt(2.0 * np.pi) * sd_rad))


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
    points = np.pi * float(_steps(mean_m, covariance_m2, sensors_m, kind, range_sd_m, bearing_sd_rad)) ** 2
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
