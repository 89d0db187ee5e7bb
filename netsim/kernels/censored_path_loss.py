"""Path loss from gains of which the weakest are missing: maximum likelihood with censoring or truncation.

The model is that of `netsim.kernels.path_loss_fit`: gain = -L0 - 10 n log10(d / d0) + X, X normal with mean 0 and standard
deviation s. A receiver reports no gain below a limit, so least squares sees, at long distances, only the links that
shadowing favoured: exponent and deviation come out too small. Here a link known to lie below its limit counts with
Phi((limit - mean) / s) (Tobin 1958, Amemiya 1984); if such links are not even listed, each listed one counts with its
density given that it is above its limit (truncation; Hausman and Wise 1977).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

Floats = NDArray[np.float64]

_STEP: Final = 1e-4
_ITERATIONS: Final = 100
_LOG_2PI: Final = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, slots=True)
class CensoredPathLossFit:
    """A straight line through gains over log-distance, the unseen ones considered.

    Attributes:
        exponent: Path-loss exponent n.
        exponent_se: Its standard error, clustered.
        reference_loss_db: Loss at the reference distance, L0.
        reference_loss_se_db: Its standard error, clustered.
        sd_db: Standard deviation of a link's gain about the line.
        sd_se_db: Its standard error, clustered.
        seen: Links with a gain.
        unseen: Links known to be below their limit.
        truncated: Whether links below the limit were taken to be missing from the list.
    """

    exponent: float
    exponent_se: float
    reference_loss_db: float
    reference_loss_se_db: float
    sd_db: float
    sd_se_db: float
    seen: int
    unseen: int
    truncated: bool


@dataclass(frozen=True, slots=True)
class _Data:
    x: Floats
    gain: Floats
    limit: Floats
    seen: NDArray[np.bool_]
    truncated: bool


def fit_censored_path_loss(
    distance_m: Floats,
    gain_db: Floats,
    limit_db: Floats,
    cluster: NDArray[np.intp],
    *,
    truncated: bool,
    reference_distance_m: float = 1.0,
) -> CensoredPathLossFit:
    """Fit exponent, reference loss and deviation.

    Args:
        distance_m: (M,) distances above 0.
        gain_db: (M,) received over transmitted power; NaN for a link known to be below its limit.
        limit_db: (M,) gain below which a link is not seen; gains given lie at or above it.
        cluster: (M,) links of one number are not independent (the two directions of a pair).
        truncated: Whether unseen links are missing from the arrays rather than marked by NaN.
        reference_distance_m: Distance d0 of the reference loss.

    Raises:
        ValueError: If fewer than four gains are given, at fewer than two distances, or the likelihood has no maximum (the
            links reach the limit everywhere: nothing tells exponent from deviation).
    """
    seen = np.isfinite(gain_db)
    logs = 10.0 * np.log10(np.asarray(distance_m, float) / reference_distance_m)
    if np.count_nonzero(seen) < 4 or np.ptp(logs[seen]) == 0.0:
        message = "at least four links at two or more distances"
        raise ValueError(message)
    centre = float(logs[seen].mean())
    data = _Data(logs - centre, np.where(seen, gain_db, 0.0), np.asarray(limit_db, float), seen, truncated)
    theta = _climb(_start(data), data)
    covariance = _covariance(theta, data, np.unique(cluster, return_inverse=True)[1])
    sd = float(np.exp(theta[2]))
    to_reference = np.array([-1.0, -centre, 0.0])  # L0 = -(intercept + n centre), as a function of theta
    se = np.sqrt(np.diag(covariance))
    return CensoredPathLossFit(
        exponent=float(theta[1]),
        exponent_se=float(se[1]),
        reference_loss_db=float(to_reference @ theta),
        reference_loss_se_db=float(np.sqrt(to_reference @ covariance @ to_reference)),
        sd_db=sd,
        sd_se_db=float(se[2]) * sd,
        seen=int(np.count_nonzero(seen)),
        unseen=int(np.count_nonzero(~seen)),
        truncated=truncated,
    )


def _start(data: _Data) -> Floats:
    """Least squares through what was seen."""
    slope, intercept = np.polyfit(data.x[data.seen], data.gain[data.seen], 1)
    residual = data.gain[data.seen] - intercept - slope * data.x[data.seen]
    return np.array([intercept, -slope, np.log(max(float(residual.std()), 0.1))])


def _log_likelihoods(theta: Floats, data: _Data) -> Floats:
    """Of each link; theta is (intercept at the centre, exponent, ln s)."""
    sd = np.exp(theta[2])
    mean = theta[0] - theta[1] * data.x
    below = (data.limit - mean) / sd
    density = -0.5 * (_LOG_2PI + ((data.gain - mean) / sd) ** 2) - theta[2]
    if data.truncated:
        density = density - log_ndtr(-below)
    found: Floats = np.where(data.seen, density, log_ndtr(below))
    return found


def _gradients(theta: Floats, data: _Data) -> Floats:
    """Of each link's log-likelihood, (M, 3)."""
    shifts = _STEP * np.eye(3)
    columns = [
        (_log_likelihoods(theta + shift, data) - _log_likelihoods(theta - shift, data)) / (2.0 * _STEP)
        for shift in shifts
    ]
    return np.column_stack(columns)


def _hessian(theta: Floats, data: _Data) -> Floats:
    shifts = _STEP * np.eye(3)
    rows = [
        (_gradients(theta + shift, data) - _gradients(theta - shift, data)).sum(axis=0) / (2.0 * _STEP)
        for shift in shifts
    ]
    symmetric: Floats = 0.5 * (np.array(rows) + np.array(rows).T)
    return symmetric


def _climb(theta: Floats, data: _Data) -> Floats:
    """Newton's method, made to ascend where the likelihood is not concave."""
    value = float(_log_likelihoods(theta, data).sum())
    for _ in range(_ITERATIONS):
        gradient = _gradients(theta, data).sum(axis=0)
        eigenvalues, vectors = np.linalg.eigh(-_hessian(theta, data))
        step = vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(eigenvalues), 1e-6))
        step = step / max(1.0, float(np.abs(step / np.array([20.0, 2.0, 0.7])).max()))
        while float(np.abs(step).max()) > 1e-9:
            trial = float(_log_likelihoods(theta + step, data).sum())
            if trial >= value:
                break
            step = 0.5 * step
        else:
            return theta
        theta, gained, value = theta + step, trial - value, trial
        if not (abs(theta[1]) < 100.0 and abs(theta[2]) < 6.0):
            break
        if gained < 1e-9 * (abs(value) + 1.0) and float(np.abs(step).max()) < 1e-6:
            return theta
    message = "links that do not all lie at the limit of what is received: the likelihood has no maximum"
    raise ValueError(message)


def _covariance(theta: Floats, data: _Data, cluster: NDArray[np.intp]) -> Floats:
    """The sandwich, clustered (Liang and Zeger 1986)."""
    bread = np.linalg.pinv(-_hessian(theta, data))
    summed = np.zeros((int(cluster.max()) + 1, 3))
    np.add.at(summed, cluster, _gradients(theta, data))
    count = len(summed)
    covariance: Floats = bread @ (summed.T @ summed) @ bread * (count / max(count - 1, 1))
    return covariance
