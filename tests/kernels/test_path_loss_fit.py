"""The fit against numpy's least squares, exact data, its own error bars, and what it refuses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.path_loss_fit import asymmetry_sd_db, fit_path_loss


def drawn(count: int, sd_db: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    distance = rng.uniform(2.0, 150.0, count)
    return distance, -40.0 - 27.0 * np.log10(distance) + rng.normal(0.0, sd_db, count)


@given(st.floats(0.5, 6.0), st.floats(-20.0, 130.0), st.floats(0.1, 50.0))
def test_exact_gains_give_the_exact_line(exponent: float, loss: float, reference: float) -> None:
    distance = np.array([1.0, 3.0, 10.0, 70.0])
    fit = fit_path_loss(distance, -loss - 10 * exponent * np.log10(distance / reference), reference)
    assert (fit.exponent, fit.reference_loss_db) == pytest.approx((exponent, loss), abs=1e-9)
    assert (fit.shadowing_sd_db, fit.r_squared) == pytest.approx((0.0, 1.0), abs=1e-8)
    assert fit.count == 4


def test_it_is_the_least_squares_line_with_its_standard_errors() -> None:
    distance, gain = drawn(200, 4.0)
    fit = fit_path_loss(distance, gain)
    design = np.column_stack([-10 * np.log10(distance), -np.ones(200)])
    answer, squares, _, _ = np.linalg.lstsq(design, gain, rcond=None)
    covariance = squares[0] / 198 * np.linalg.inv(design.T @ design)
    assert (fit.exponent, fit.reference_loss_db) == pytest.approx(tuple(answer))
    assert (fit.exponent_se, fit.reference_loss_se_db) == pytest.approx(tuple(np.sqrt(np.diag(covariance))))
    assert fit.shadowing_sd_db == pytest.approx(math.sqrt(squares[0] / 198))
    assert fit.r_squared == pytest.approx(1 - squares[0] / np.sum((gain - gain.mean()) ** 2))


def test_standard_errors_are_honest() -> None:
    """Of 400 fits the truth lies within two standard errors in about 95.2 % (t of 58 degrees): 4 binomial sd around it."""
    hits = [abs(f.exponent - 2.7) < 2 * f.exponent_se for f in (fit_path_loss(*drawn(60, 4.0, s)) for s in range(400))]
    assert abs(sum(hits) / 400 - 0.950) < 4 * math.sqrt(0.95 * 0.05 / 400)


def test_asymmetry_of_a_matrix_and_of_its_pairs() -> None:
    gains = np.array([[-math.inf, -60.0, -70.0], [-63.0, -math.inf, -math.inf], [-66.0, -90.0, -math.inf]])
    assert asymmetry_sd_db(gains) == pytest.approx(math.sqrt((9 + 16) / 2))
    assert asymmetry_sd_db([[-60.0, -63.0], [-70.0, -66.0], [-90.0, -math.inf]]) == asymmetry_sd_db(gains)
    assert asymmetry_sd_db(np.zeros((4, 4))) == 0.0


@pytest.mark.parametrize(
    ("distance", "gain", "text"),
    [
        ([1.0, 2.0], [0.0, 1.0], "at least 3"),
        ([1.0, 2.0, 3.0], [0.0, 1.0], "one shape"),
        ([0.0, 2.0, 3.0], [0.0, 1.0, 2.0], "above 0"),
        ([2.0, 2.0, 2.0], [0.0, 1.0, 2.0], "different distances"),
        ([1.0, 2.0, 3.0], [0.0, 1.0, math.nan], "finite gains"),
    ],
)
def test_what_cannot_be_fitted(distance: list[float], gain: list[float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        fit_path_loss(distance, gain)


@pytest.mark.parametrize("gains", [np.zeros((3, 4)), np.full((3, 3), -np.inf), np.zeros(3)])
def test_no_asymmetry_without_pairs(gains: np.ndarray) -> None:
    with pytest.raises(ValueError, match="expected"):
        asymmetry_sd_db(gains)
