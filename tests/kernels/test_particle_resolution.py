"""How far the nearest particle is: the law against draws."""

import numpy as np
import pytest

from netsim.kernels.particle_resolution import resolution_m2, spread_m
from netsim.kernels.particles import uniform_disc


@pytest.mark.parametrize(("count", "targets"), [(100, 1), (500, 1), (1000, 2)])
def test_the_variance_is_that_of_the_nearest_of_so_many_draws(count, targets):
    """At the centre, where the border is far; within four standard errors of 500 sets, and 3 % for the border in 4-D."""
    rng = np.random.default_rng(1)
    sets = [uniform_disc(np.zeros((targets, 2)), 45.0, count, rng).positions_m for _ in range(500)]
    squared_m2 = np.array([(one.reshape(count, -1) ** 2).sum(axis=1).min() for one in sets]) / (2 * targets)
    error_m2 = 4.0 * squared_m2.std() / np.sqrt(len(squared_m2)) + (0.03 * squared_m2.mean() if targets > 1 else 0.0)
    assert squared_m2.mean() == pytest.approx(resolution_m2(count, targets, 45.0), abs=error_m2)


def test_more_particles_resolve_more_and_more_targets_less():
    assert resolution_m2(400, 1, 45.0) == pytest.approx(resolution_m2(100, 1, 45.0) / 4)
    assert resolution_m2(400, 2, 45.0) == pytest.approx(resolution_m2(100, 2, 45.0) / 2)
    assert resolution_m2(200, 2, 45.0) > resolution_m2(100, 1, 45.0)


def test_the_spread_of_draws_from_discs_is_their_radius():
    rng = np.random.default_rng(1)
    belief = uniform_disc([[0.0, 0.0], [900.0, 0.0]], 45.0, 20_000, rng)
    assert spread_m(belief) == pytest.approx(45.0, rel=0.01)
