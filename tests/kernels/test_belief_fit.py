"""Normal distributions and mixtures in place of grid beliefs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from netsim.kernels.belief_fit import Mixture, divergence_bit, fitted, on_grid
from netsim.kernels.grid_belief import Grid, GridBelief, pruned

GRID = Grid((0.0, 0.0), 5.0, 30, 40)


def blobs(*centres_m: tuple[float, float], sd_m: float = 12.0) -> GridBelief:
    count = len(centres_m)
    mixture = Mixture(np.full(count, 1 / count), np.array(centres_m), np.tile([sd_m**2, 0.0, sd_m**2], (count, 1)))
    return pruned(on_grid(mixture, GRID), 2e-5)


def scattered(seed: int) -> GridBelief:
    rng = np.random.default_rng(seed)
    cells = np.sort(rng.choice(GRID.size, rng.integers(1, 60), replace=False))
    weights = rng.exponential(size=len(cells)) + 1e-4
    return GridBelief(GRID, cells, weights / weights.sum())


def test_densities_are_those_of_scipy():
    mixture = Mixture(
        np.array([0.3, 0.7]), np.array([[1.0, 2.0], [30.0, 4.0]]), np.array([[9.0, 2.0, 4.0], [1.0, 0.0, 25.0]])
    )
    points_m = np.random.default_rng(1).uniform(-10, 40, (20, 2))
    for row, weight, mean_m, (xx, xy, yy) in zip(
        mixture.log_densities(points_m), mixture.weights, mixture.means_m, mixture.covariances_m2, strict=True
    ):
        expected = math.log(weight) + multivariate_normal(mean_m, [[xx, xy], [xy, yy]]).logpdf(points_m)
        np.testing.assert_allclose(row, expected, rtol=1e-10)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_one_component_has_the_moments_of_the_belief(seed):
    belief = scattered(seed)
    mixture = fitted(belief, 1)
    np.testing.assert_allclose(mixture.means_m[0], belief.mean_m, rtol=1e-12, atol=1e-9)
    (xx, xy), (_, yy) = belief.covariance_m2
    if min(np.linalg.eigvalsh(belief.covariance_m2)) > (0.3 * GRID.cell_m) ** 2:
        np.testing.assert_allclose(mixture.covariances_m2[0], [xx, xy, yy], rtol=1e-9, atol=1e-9)


@given(st.integers(0, 10_000), st.integers(1, 4))
@settings(max_examples=30, deadline=None)
def test_a_fit_is_a_distribution_and_its_belief_sums_to_one(seed, components):
    mixture = fitted(scattered(seed), components)
    assert mixture.weights.sum() == pytest.approx(1.0)
    assert np.all(mixture.weights > 0.0)
    xx, xy, yy = mixture.covariances_m2.T
    assert np.all(xx * yy > xy**2)
    assert on_grid(mixture, GRID).probability.sum() == pytest.approx(1.0)


def test_a_mixture_finds_two_blobs_that_one_normal_distribution_smears():
    belief = blobs((40.0, 40.0), (110.0, 160.0))
    two = fitted(belief, 2)
    np.testing.assert_allclose(sorted(two.means_m[:, 0]), [40.0, 110.0], atol=1.0)
    assert divergence_bit(belief, on_grid(two, GRID)) < 0.01
    assert divergence_bit(belief, on_grid(fitted(belief, 1), GRID)) > 0.5


def test_a_belief_in_one_cell_stays_near_it():
    belief = GridBelief(GRID, np.array([615]), np.ones(1))
    decoded = on_grid(fitted(belief, 1), GRID)
    assert decoded.probability[decoded.cells == 615][0] > 0.9


def test_divergence_by_hand():
    one = GridBelief(GRID, np.array([3, 4]), np.array([0.5, 0.5]))
    other = GridBelief(GRID, np.array([3, 4, 5]), np.array([0.25, 0.5, 0.25]))
    assert divergence_bit(one, other) == pytest.approx(0.5)
    assert divergence_bit(one, one) == 0.0
    assert divergence_bit(other, one) == math.inf
