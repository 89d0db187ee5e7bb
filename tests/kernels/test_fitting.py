"""Scaling to given sums: textbook cases, entries that must vanish, and sums that cannot be had."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.fitting import fitted

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS, st.integers(1, 6), st.integers(1, 6))
def test_sums_are_met_and_the_odds_ratios_kept(seed, rows, columns):
    rng = np.random.default_rng(seed)
    table, wanted = rng.uniform(0.01, 1.0, (rows, columns)), rng.uniform(0.01, 1.0, (rows, columns))
    found = fitted(table, wanted.sum(axis=1), wanted.sum(axis=0))
    np.testing.assert_allclose(found.sum(axis=1), wanted.sum(axis=1), atol=1e-10)
    np.testing.assert_allclose(found.sum(axis=0), wanted.sum(axis=0), atol=1e-10)
    scales = np.log(found / table)  # a sum of one number a row and one a column
    np.testing.assert_allclose(scales - scales[:1] - scales[:, :1] + scales[0, 0], 0.0, atol=1e-6)


def test_a_table_by_hand():
    # odds ratio 4 with all sums 1: a / (1 - a) = 2
    expected = np.array([[2.0, 1.0], [1.0, 2.0]]) / 3.0
    np.testing.assert_allclose(fitted(np.array([[4.0, 1.0], [1.0, 1.0]]), np.ones(2), np.ones(2)), expected, atol=1e-12)


@pytest.mark.parametrize("size", [2, 3, 5, 8])
def test_entries_that_must_vanish_do(size):
    # above the diagonal nothing may stay, where alternate scaling alone would still miss the sums by 1 / sweeps
    found = fitted(np.triu(np.ones((size, size))), np.ones(size), np.ones(size))
    np.testing.assert_allclose(found, np.eye(size), atol=1e-9)
    np.testing.assert_allclose(found.sum(axis=0), 1.0, atol=1e-10)


def test_impossible_sums_are_none():
    assert fitted(np.array([[1.0, 0.0], [1.0, 0.0]]), np.ones(2), np.ones(2)) is None
    block = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert fitted(block, np.ones(3), np.array([1.5, 1.0, 0.5])) is None
    assert fitted(np.array([[1.0, 0.0], [1.0, 1.0]]), np.ones(2), np.array([0.5, 1.5])) is None


def test_sums_wrong_by_rounding_are_rounded_away():
    # row 1 holds nothing of the first column, which is given 1e-8
    found = fitted(np.array([[0.0, 1.0], [0.0, 1.0]]), np.ones(2), np.array([1e-8, 2.0 - 1e-8]))
    np.testing.assert_allclose(found.sum(axis=0), [1e-8, 2.0 - 1e-8], atol=1e-13)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-13)
    assert (found >= 0.0).all()


def test_columns_without_mass_are_emptied():
    found = fitted(np.array([[1.0, 1.0, 1.0]]), np.ones(1), np.array([0.25, 0.0, 0.75]))
    np.testing.assert_allclose(found, [[0.25, 0.0, 0.75]])
