"""Whether errors are as large as the covariances say: the normalised estimation error squared (NEES).

Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, Wiley 2001, section 5.4.2: of a
consistent estimator it is chi-squared distributed with as many degrees of freedom as the state has dimensions.
"""

import numpy as np
from scipy.special import gammaincinv

from netsim.kernels.semiring import FloatArray


def nees(error: FloatArray, covariance: FloatArray) -> float | None:
    """E' P^-1 e of an error, shape (d,), and its covariance, shape (d, d); None where that is not positive definite."""
    try:
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), error)
    except np.linalg.LinAlgError:
        return None
    return float(whitened @ whitened)


def nees_interval(count: int, dimensions: int, confidence: float) -> tuple[float, float]:
    """Where the mean NEES of so many independent consistent estimates lies with that probability, equal tails.

    Args:
        count: How many estimates, at least 1.
        dimensions: Of the state.
        confidence: Between 0 and 1, such as 0.95.
    """
    half_freedom, tail = count * dimensions / 2.0, (1.0 - confidence) / 2.0
    low, high = 2.0 * gammaincinv(half_freedom, [tail, 1.0 - tail]) / count  # quantiles of chi-squared
    return float(low), float(high)
