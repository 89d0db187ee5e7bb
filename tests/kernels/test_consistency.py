"""NEES by hand, against the inverse, and of errors drawn from the covariance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from netsim.kernels.consistency import nees, nees_interval


def test_by_hand():
    assert nees(np.array([3.0, 4.0]), np.diag([9.0, 4.0])) == pytest.approx(1 + 4)


@given(st.integers(0, 10_000), st.integers(1, 4))
def test_it_is_the_quadratic_form_of_the_inverse(seed, dimensions):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(dimensions, dimensions)) + 2 * np.eye(dimensions)
    covariance, error = root @ root.T + 0.1 * np.eye(dimensions), rng.normal(size=dimensions)
    assert nees(error, covariance) == pytest.approx(error @ np.linalg.inv(covariance) @ error, rel=1e-8)


def test_a_covariance_that_is_none_has_none():
    assert nees(np.ones(2), np.array([[1.0, 2.0], [2.0, 1.0]])) is None
    assert nees(np.ones(2), np.zeros((2, 2))) is None


def test_the_mean_of_a_consistent_estimator_lies_in_the_interval_as_often_as_it_says():
    """1,000 means of 20 each at 90 %: 900 inside, standard deviation 9.5; four of them either way."""
    rng = np.random.default_rng(7)
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    errors = rng.multivariate_normal(np.zeros(2), covariance, size=(1000, 20))
    means = [np.mean([nees(error, covariance) for error in batch]) for batch in errors]
    low, high = nees_interval(20, 2, 0.9)
    assert low < 2.0 < high
    assert abs(sum(low <= mean <= high for mean in means) - 900) < 4 * np.sqrt(1000 * 0.9 * 0.1)


def test_the_interval_of_two_degrees_of_freedom_has_a_closed_form():
    """One estimate in the plane: chi-squared with 2 degrees is exponential with mean 2."""
    low, high = nees_interval(1, 2, 0.95)
    assert (low, high) == pytest.approx((-2 * np.log(0.975), -2 * np.log(0.025)))


@given(st.integers(1, 2_000), st.integers(1, 6), st.floats(0.5, 0.999))
def test_the_interval_has_the_quantiles_of_chi_squared(count, dimensions, confidence):
    tail = (1 - confidence) / 2
    expected = chi2.ppf([tail, 1 - tail], count * dimensions) / count
    assert nees_interval(count, dimensions, confidence) == pytest.approx(tuple(expected), rel=1e-9)
