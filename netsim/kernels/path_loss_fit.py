"""What a set of measured gains says of the air: path-loss exponent, static shadowing, asymmetry of directions.

The model is PL(d) = PL(d0) + 10 n log10(d / d0) + X with X normal of mean 0, in dB (Rappaport, Wireless Communications,
4.9); its least-squares fit is a straight line of the gain over 10 log10(d / d0).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PathLossFit:
    """A straight line through gains over log-distance.

    Attributes:
        exponent: Path-loss exponent n.
        exponent_se: Its standard error, if the residuals are independent.
        reference_loss_db: Loss at the reference distance.
        reference_loss_se_db: Its standard error.
        shadowing_sd_db: Standard deviation of the residuals, two degrees of freedom spent on the line.
        r_squared: Share of the gains' variance that the line explains.
        count: Number of gains.
    """

    exponent: float
    exponent_se: float
    reference_loss_db: float
    reference_loss_se_db: float
    shadowing_sd_db: float
    r_squared: float
    count: int


def fit_path_loss(distance_m: ArrayLike, gain_db: ArrayLike, reference_distance_m: float = 1.0) -> PathLossFit:
    """Fit exponent, reference loss and shadowing by least squares.

    Gains that are missing because they were too weak to be measured bias the fit towards a smaller exponent and a smaller
    deviation. Where both directions of a pair are given, the standard errors are too small: the two share their shadowing.

    Args:
        distance_m: (M,) distances, above 0, not all equal; M at least 3.
        gain_db: (M,) received over transmitted power.
        reference_distance_m: Distance d0 of the reference loss.

    Raises:
        ValueError: For arrays of different or too small size, numbers that are not finite, a distance of 0 or less, or
            distances that are all equal.
    """
    distance, gain = np.asarray(distance_m, float), np.asarray(gain_db, float)
    _check(distance, gain, reference_distance_m)
    x = 10.0 * np.log10(distance / reference_distance_m)
    centred = x - x.mean()
    spread = float(centred @ centred)
    slope = float(centred @ (gain - gain.mean())) / spread
    intercept = float(gain.mean() - slope * x.mean())
    residual = gain - intercept - slope * x
    squares, total = float(residual @ residual), float(np.sum((gain - gain.mean()) ** 2))
    sd = (squares / (len(x) - 2)) ** 0.5
    return PathLossFit(
        exponent=-slope,
        exponent_se=sd / spread**0.5,
        reference_loss_db=-intercept,
        reference_loss_se_db=sd * float(1.0 / len(x) + x.mean() ** 2 / spread) ** 0.5,
        shadowing_sd_db=sd,
        r_squared=1.0 - squares / total if total > 0.0 else 1.0,
        count=len(x),
    )


def asymmetry_sd_db(gain_matrix_or_pairs: ArrayLike) -> float:
    """Standard deviation, about 0, of the difference between the two directions of a pair of nodes, in dB.

    It is taken about 0, because which of the two directions comes first is a matter of numbering.

    Args:
        gain_matrix_or_pairs: Square (N, N), row the sender, of which the pairs with two finite gains count; or (M, 2) with
            the two gains of each pair. A 2 x 2 array is a matrix.

    Raises:
        ValueError: If it has another shape, or no pair with two finite gains.
    """
    given = np.asarray(gain_matrix_or_pairs, float)
    if given.ndim != 2 or (given.shape[0] != given.shape[1] and given.shape[1] != 2):
        message = f"expected gains of shape (N, N) or (M, 2), got {given.shape}"
        raise ValueError(message)
    if given.shape[0] == given.shape[1]:
        upper = np.triu_indices(len(given), 1)
        given = np.column_stack([given[upper], given.T[upper]])
    both = given[np.all(np.isfinite(given), axis=1)]
    if not len(both):
        message = "expected at least one pair with a gain in both directions, got none"
        raise ValueError(message)
    return float(np.sqrt(np.mean((both[:, 0] - both[:, 1]) ** 2)))


def _check(distance: Array, gain: Array, reference_distance_m: float) -> None:
    wrong = {
        f"distances and gains of one shape (M,), got {distance.shape} and {gain.shape}": distance.ndim != 1
        or distance.shape != gain.shape,
        f"at least 3 gains, got {distance.size}": distance.size < 3,
        f"a reference distance above 0, got {reference_distance_m}": not reference_distance_m > 0.0,
        "finite distances above 0": not np.all((distance > 0.0) & np.isfinite(distance)),
        "finite gains": not np.all(np.isfinite(gain)),
        "at least two different distances": distance.size > 0 and bool(np.all(distance == distance.flat[0])),
    }
    for expected, is_so in wrong.items():
        if is_so:
            message = f"expected {expected}"
            raise ValueError(message)
