"""Packet reception ratio against received power: a rising curve fitted to binomial counts by maximum likelihood.

The model of a row with mean received power r is: received ~ Binomial(sent, c F((r - m) / s)), with F the logistic or the
normal distribution function. The ceiling c <= 1 is what a strong link reaches: frames lost to something
else than noise (another network, a full queue) are lost at any power. Fisher scoring (McCullagh and Nelder, Generalized
Linear Models, 2.5). Rows of one link are not independent, and links differ by more than a binomial: standard errors are
therefore those of the sandwich estimator, clustered by link (Liang and Zeger 1986), which supposes neither.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, ndtr, xlogy

Floats = NDArray[np.float64]
Curve = Callable[[Floats], Floats]
CurveName = Literal["logistic", "erf"]

CURVES: Final[dict[CurveName, Curve]] = {"logistic": expit, "erf": ndtr}
WIDTH_OF_UNIT: Final[dict[CurveName, float]] = {"logistic": 4.394449154672439, "erf": 2.5631031310892007}
"""From 10 % to 90 % of the standard curve: 2 ln 9 and twice the normal quantile of 0.9."""
_ITERATIONS = 200
_HALVINGS = 40
_TINY = 1e-12
_STEP = 1e-5


@dataclass(frozen=True, slots=True)
class PrrFit:
    """A fitted curve.

    Attributes:
        curve: Which curve.
        half_dbm: Received power at which half of the ceiling is reached.
        half_se_db: Its standard error.
        width_db: From 10 % to 90 % of the ceiling.
        width_se_db: Its standard error.
        ceiling: Ratio that strong links reach.
        ceiling_se: Its standard error; 0 where it was held at 1.
        deviance: Twice the log-likelihood lost against a ratio of its own for each row; about `freedom` if rows differ by
            binomial chance only.
        dispersion: Pearson's chi-squared over `freedom`: how many times more rows scatter than binomial chance allows.
        freedom: Rows less parameters.
        rows: Number of rows.
        frames: Frames sent.
        prr: The curve: from received power in dBm to the ratio.
    """

    curve: CurveName
    half_dbm: float
    half_se_db: float
    width_db: float
    width_se_db: float
    ceiling: float
    ceiling_se: float
    deviance: float
    dispersion: float
    freedom: int
    rows: int
    frames: int
    prr: Curve


@dataclass(frozen=True, slots=True)
class _Data:
    power_dbm: Floats
    received: Floats
    sent: Floats
    cluster: NDArray[np.intp]


def fit_prr(
    rssi_dbm: Floats,
    received: Floats,
    sent: Floats,
    cluster: NDArray[np.intp] | None = None,
    curve: CurveName = "logistic",
    with_ceiling: bool = True,
) -> PrrFit:
    """Fit place, width and ceiling of a curve.

    Args:
        rssi_dbm: (R,) mean received power of each row's frames.
        received: (R,) frames received, of `sent`.
        sent: (R,) frames sent, at least 1.
        cluster: (R,) number of each row's link; by default every row is a link of its own.
        curve: `logistic`, or `erf` (the normal distribution function).
        with_ceiling: Whether the ceiling is fitted too; otherwise it is 1.

    Raises:
        ValueError: If the shapes or counts are wrong, or no curve can be placed: fewer rows than parameters and one, one
            power only, all or nothing received, ratios that jump from nothing to all, or that fall with power.
    """
    data = _checked(rssi_dbm, received, sent, cluster, 3 if with_ceiling else 2)
    shape = CURVES[curve]
    unit = WIDTH_OF_UNIT[curve]

    def ratios(theta: Floats) -> Floats:
        ceiling = expit(theta[2]) if with_ceiling else 1.0
        return np.asarray(ceiling * shape((data.power_dbm - theta[0]) * np.exp(-theta[1])))

    start_dbm, start_log_scale = _start(data)
    theta = np.array([start_dbm, start_log_scale - np.log(unit), 4.0][: 3 if with_ceiling else 2])
    theta, covariance = _maximise(ratios, theta, data)
    scale = float(np.exp(theta[1]))
    ceiling = float(expit(theta[2])) if with_ceiling else 1.0
    _refuse_a_step(scale * unit, data)
    half, se = float(theta[0]), np.sqrt(np.diag(covariance))
    deviance, pearson = _fit_quality(ratios(theta), data)
    freedom = len(data.sent) - len(theta)
    return PrrFit(
        curve=curve,
        half_dbm=half,
        half_se_db=float(se[0]),
        width_db=scale * unit,
        width_se_db=float(se[1]) * scale * unit,
        ceiling=ceiling,
        ceiling_se=float(se[2]) * ceiling * (1.0 - ceiling) if with_ceiling else 0.0,
        deviance=deviance,
        dispersion=pearson / freedom,
        freedom=freedom,
        rows=len(data.sent),
        frames=int(data.sent.sum()),
        prr=lambda power_dbm: np.asarray(ceiling * shape((power_dbm - half) / scale)),
    )


def _checked(
    rssi_dbm: Floats, received: Floats, sent: Floats, cluster: NDArray[np.intp] | None, unknowns: int
) -> _Data:
    power, got, all_sent = (np.asarray(column, dtype=float) for column in (rssi_dbm, received, sent))
    links = np.arange(len(power)) if cluster is None else np.unique(cluster, return_inverse=True)[1]
    problem = ""
    if not len(power) == len(got) == len(all_sent) == len(links):
        problem = "columns of one length"
    elif len(power) < unknowns + 1:
        problem = f"at least {unknowns + 1} rows with a received power, got {len(power)}"
    elif not np.isfinite(power).all() or (got < 0).any() or (all_sent < 1).any() or (got > all_sent).any():
        problem = "finite powers and 0 <= received <= sent, sent at least 1"
    elif np.ptp(power) == 0.0:
        problem = "rows at more than one received power"
    elif got.sum() in (0.0, all_sent.sum()):
        problem = "some frames received and some lost: the curve's place shows in neither alone"
    elif float(np.cov(power, got / all_sent, aweights=all_sent)[0, 1]) <= 0.0:
        problem = "ratios that rise with received power: they do not"
    if problem:
        raise ValueError(problem)
    return _Data(power, got, all_sent, links)


def _start(data: _Data) -> tuple[float, float]:
    """First guess of the 50 % point and of the logarithm of the width, from means over the sorted rows."""
    order = np.argsort(data.power_dbm, kind="stable")
    power, ratio = data.power_dbm[order], (data.received / data.sent)[order]
    lost_above = np.cumsum((1.0 - ratio)[::-1])[::-1]
    got_below = np.concatenate([[0.0], np.cumsum(ratio)[:-1]])
    place = int(np.argmin(got_below + lost_above))
    return float(power[place]), float(np.log(max(np.ptp(power) / 8.0, 0.5)))


def _maximise(ratios: Callable[[Floats], Floats], theta: Floats, data: _Data) -> tuple[Floats, Floats]:
    """Fisher scoring with halved steps; returns the estimate and its clustered sandwich covariance."""
    value = _deviance(ratios(theta), data)
    for _ in range(_ITERATIONS):
        scores, information = _scores(ratios, theta, data)
        step = np.linalg.lstsq(information, scores.sum(axis=0), rcond=1e-12)[0]
        step = np.clip(step, -3.0, 3.0)
        for _ in range(_HALVINGS):
            trial = _deviance(ratios(theta + step), data)
            if trial <= value:
                break
            step = 0.5 * step
        else:
            break
        theta, gained, value = theta + step, value - trial, trial
        if gained <= 1e-10 * (abs(value) + 1e-3) and np.abs(step).max() < 1e-7:
            break
    scores, information = _scores(ratios, theta, data)
    bread = np.linalg.pinv(information)
    summed = np.zeros((int(data.cluster.max()) + 1, len(theta)))
    np.add.at(summed, data.cluster, scores)
    clusters = len(summed)
    meat = summed.T @ summed * (clusters / max(clusters - 1, 1))
    return theta, bread @ meat @ bread


def _scores(ratios: Callable[[Floats], Floats], theta: Floats, data: _Data) -> tuple[Floats, Floats]:
    """Each row's derivative of the log-likelihood, (R, P), and the expected information, (P, P)."""
    ratio = np.clip(ratios(theta), _TINY, 1.0 - _TINY)
    slopes = np.empty((len(data.sent), len(theta)))
    for place in range(len(theta)):
        shift = np.zeros(len(theta))
        shift[place] = _STEP
        slopes[:, place] = (ratios(theta + shift) - ratios(theta - shift)) / (2.0 * _STEP)
    weight = data.sent / (ratio * (1.0 - ratio))
    scores = slopes * ((data.received - data.sent * ratio) / (ratio * (1.0 - ratio)))[:, None]
    return scores, (slopes * weight[:, None]).T @ slopes


def _deviance(ratio: Floats, data: _Data) -> float:
    ratio = np.clip(ratio, _TINY, 1.0 - _TINY)
    lost = data.sent - data.received
    rows = xlogy(data.received, data.received / (data.sent * ratio)) + xlogy(lost, lost / (data.sent * (1.0 - ratio)))
    return float(2.0 * rows.sum())


def _fit_quality(ratio: Floats, data: _Data) -> tuple[float, float]:
    """Deviance and Pearson's chi-squared."""
    safe = np.clip(ratio, _TINY, 1.0 - _TINY)
    pearson = (data.received - data.sent * safe) ** 2 / (data.sent * safe * (1.0 - safe))
    return _deviance(ratio, data), float(pearson.sum())


def _refuse_a_step(width_db: float, data: _Data) -> None:
    gaps = np.diff(np.unique(data.power_dbm))
    between = (data.received > 0) & (data.received < data.sent)
    if width_db < 0.02 * float(gaps.min()) or not between.any():
        message = "some rows with a ratio between nothing and all: the ratios jump, so the curve has no width"
        raise ValueError(message)
