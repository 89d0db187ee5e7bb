"""Beliefs on a grid: every step against its textbook form, and probability that stays probability."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_beliefs import scattered

from netsim.kernels.grid_belief import (
    Grid,
    GridBelief,
    condition,
    diffuse,
    diffusion_operations,
    from_dense,
    grid_over,
    pruned,
    uniform,
    update_operations,
)

RADII_M = st.sampled_from([0.0, 2.0, 5.0, 7.5, 10.0, 12.0, 21.0])


def dense(belief: GridBelief) -> np.ndarray:
    flat = np.zeros(belief.grid.size)
    flat[belief.cells] = belief.probability
    return flat.reshape(belief.grid.rows, belief.grid.columns)


def spread_by_hand(belief: GridBelief, radius_m: float) -> np.ndarray:
    """The integral of eq 3, cell by cell: each gives to all cells of the grid within the radius alike."""
    centres = belief.grid.centres_m(np.arange(belief.grid.size))
    apart = np.hypot(*(centres[:, None, :] - centres[None, :, :]).transpose(2, 0, 1))
    weights = (apart <= radius_m + 1e-9) @ dense(belief).ravel()
    return (weights / weights.sum()).reshape(belief.grid.rows, belief.grid.columns)


@given(scattered(), RADII_M)
def test_diffusion_is_the_convolution_with_the_disc_on_borders_too(belief, radius_m):
    np.testing.assert_allclose(
        dense(diffuse(belief, radius_m)), spread_by_hand(belief, radius_m), rtol=1e-10, atol=1e-300
    )


def test_half_a_second_at_15_metres_a_second_reaches_the_eight_cells_around():
    grid = grid_over((0.0, 0.0, 35.0, 35.0), 5.0)
    middle = GridBelief(grid, np.array([24]), np.array([1.0]))
    expected = np.zeros((7, 7))
    expected[2:5, 2:5] = 1.0 / 9.0
    np.testing.assert_allclose(dense(diffuse(middle, 7.5)), expected, rtol=1e-12)
    corner = GridBelief(grid, np.array([0]), np.array([1.0]))
    assert diffuse(corner, 7.5).cells.tolist() == [0, 1, 7, 8]


@given(scattered(), RADII_M, st.integers(0, 2**32 - 1), st.sampled_from([0.0, 2e-5, 1e-2, 0.3, 2.0]))
def test_a_belief_sums_to_one_after_every_stage(belief, radius_m, seed, least):
    predicted = diffuse(belief, radius_m)
    logs = np.random.default_rng(seed).normal(0.0, 200.0, len(predicted.cells))
    after, _ = condition(predicted, logs)
    kept = pruned(after, least)
    for stage in (predicted, after, kept):
        assert stage.probability.sum() == pytest.approx(1.0, abs=1e-12)
        assert (stage.probability > 0.0).all()
        assert (np.diff(stage.cells) > 0).all()
        assert len(stage.cells) == len(stage.probability) >= 1
    assert set(kept.cells.tolist()) <= set(after.cells.tolist())


@given(scattered(), st.integers(0, 2**32 - 1))
def test_conditioning_is_bayes_and_gives_the_evidence(belief, seed):
    likelihood = np.random.default_rng(seed).uniform(0.0, 3.0, len(belief.cells))
    after, log_evidence = condition(belief, np.log(likelihood))
    joint = belief.probability * likelihood
    assert log_evidence == pytest.approx(math.log(joint.sum()), rel=1e-10, abs=1e-10)
    np.testing.assert_allclose(after.probability, joint / joint.sum(), rtol=1e-10)


def test_far_too_small_likelihoods_do_not_vanish():
    grid = Grid((0.0, 0.0), 1.0, 3, 1)
    belief = uniform(grid)
    after, log_evidence = condition(belief, np.array([-5000.0, -5001.0, -math.inf]))
    assert after.cells.tolist() == [0, 1]
    assert after.probability[0] == pytest.approx(1.0 / (1.0 + math.exp(-1.0)), rel=1e-12)
    assert log_evidence == pytest.approx(-5000.0 + math.log((1.0 + math.exp(-1.0)) / 3.0), rel=1e-12)


def test_no_cell_is_kept_whose_probability_is_too_small_to_be_told_from_zero():
    grid = Grid((0.0, 0.0), 1.0, 4, 1)
    after, _ = condition(uniform(grid), np.array([0.0, 0.0, -745.0, -800.0]))
    assert after.cells.tolist() == [0, 1]
    assert from_dense(grid, np.array([[1.0, 1.0, 5e-324, 0.0]])).cells.tolist() == [0, 1]
    rare = GridBelief(grid, np.array([0, 3]), np.array([1.0, 5e-324]))
    assert (diffuse(rare, 1.0).probability > 0.0).all()


@pytest.mark.parametrize("logs", [[-math.inf, -math.inf], [math.nan, math.nan]])
def test_an_impossible_measurement_leaves_the_belief_as_it_was(logs):
    belief = uniform(Grid((0.0, 0.0), 1.0, 2, 1))
    after, log_evidence = condition(belief, np.array(logs))
    assert after is belief
    assert log_evidence == -math.inf


def test_pruning_never_leaves_nothing():
    belief = uniform(Grid((0.0, 0.0), 1.0, 100, 1))
    assert pruned(belief, 0.02) is belief
    assert pruned(belief, 0.01) is belief


def test_pruning_drops_the_small_and_scales_the_rest():
    belief = GridBelief(Grid((0.0, 0.0), 1.0, 4, 1), np.array([0, 1, 3]), np.array([0.1, 0.3, 0.6]))
    left = pruned(belief, 0.2)
    assert left.cells.tolist() == [1, 3]
    np.testing.assert_allclose(left.probability, [1 / 3, 2 / 3], rtol=1e-12)


def test_moments_by_hand():
    belief = GridBelief(Grid((10.0, 20.0), 2.0, 3, 2), np.array([0, 2, 4]), np.array([0.5, 0.25, 0.25]))
    places = np.array([[11.0, 21.0], [15.0, 21.0], [13.0, 23.0]])
    np.testing.assert_allclose(belief.centres_m, places)
    np.testing.assert_allclose(belief.mean_m, [12.5, 21.5])
    np.testing.assert_allclose(belief.covariance_m2, np.cov(places.T, aweights=[2, 1, 1], ddof=0), rtol=1e-12)
    assert belief.variance_m2 == pytest.approx(2.75 + 0.75)
    assert belief.entropy_bit == pytest.approx(1.5)


@given(st.floats(-20, 60), st.floats(-20, 60))
def test_the_cell_of_a_point_is_the_nearest_one(x_m, y_m):
    grid = Grid((-3.0, 2.0), 5.0, 7, 5)
    distance_m = np.hypot(*(grid.centres_m(np.arange(grid.size)) - (x_m, y_m)).T)
    assert distance_m[grid.cell_of((x_m, y_m))] == pytest.approx(distance_m.min(), abs=1e-6)


def test_a_grid_covers_its_field_with_the_fewest_cells():
    grid = grid_over((0.0, 0.0, 150.0, 250.0), 5.0)
    assert (grid.columns, grid.rows, grid.size) == (30, 50, 1500)
    assert grid_over((0.0, 0.0, 151.0, 1.0), 5.0) == Grid((0.0, 0.0), 5.0, 31, 1)


def test_uniform_beliefs():
    grid = grid_over((0.0, 0.0, 150.0, 250.0), 5.0)
    assert uniform(grid).entropy_bit == pytest.approx(math.log2(1500))
    square = uniform(grid, (72.5, 122.5), 50.0)
    assert len(square.cells) == 21 * 21
    np.testing.assert_allclose(square.mean_m, [72.5, 122.5])
    tiny = uniform(grid, (71.0, 121.0), 0.1)
    assert tiny.cells.tolist() == [grid.cell_of((71.0, 121.0))]


def test_dense_weights_need_not_sum_to_one():
    belief = from_dense(Grid((0.0, 0.0), 1.0, 2, 2), np.array([[0.0, 3.0], [1.0, 0.0]]))
    assert belief.cells.tolist() == [1, 2]
    np.testing.assert_allclose(belief.probability, [0.75, 0.25])


@settings(max_examples=20)
@given(scattered(), RADII_M)
def test_operations_follow_the_cells_that_are_touched(belief, radius_m):
    after = diffuse(belief, radius_m)
    centres = belief.grid.centres_m(np.arange(belief.grid.size))
    gives = sum(int((np.hypot(*(centres - place).T) <= radius_m + 1e-9).sum()) for place in belief.centres_m)
    count = diffusion_operations(belief, after, radius_m)
    if radius_m < belief.grid.cell_m:
        assert count == 0
    else:
        assert count >= gives + 2 * len(after.cells)  # what falls off the border is added in vain
    assert update_operations(2 * len(after.cells)) == 2 * update_operations(len(after.cells))
