"""Areas of subregions against the formulas of circles, and where points belong."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.coverage_regions import CellGrid, disc_cover, disc_regions

WIDE = (-100.0, -100.0, 100.0, 100.0)
UNIT = (0.0, 0.0, 1.0, 1.0)


def areas(sensors_m, radius_m, field_m=WIDE):
    return {region.sensors: region.area_m2 for region in disc_regions(np.array(sensors_m), radius_m, field_m)}


def lens(distance, radius):
    """Area common to two equal discs."""
    half = distance / 2.0
    return 2.0 * radius**2 * np.arccos(half / radius) - distance * np.sqrt(radius**2 - half**2)


def test_one_disc_has_its_area():
    assert areas([[3.0, 4.0]], 2.0) == {(0,): pytest.approx(4.0 * np.pi, rel=1e-12)}


@settings(max_examples=20, deadline=None)
@given(distance=st.floats(0.05, 1.95), angle=st.floats(0.0, 6.3))
def test_two_discs_share_a_lens(distance, angle):
    found = areas([[0.0, 0.0], [distance * np.cos(angle), distance * np.sin(angle)]], 1.0)
    shared = lens(distance, 1.0)
    assert found[0, 1] == pytest.approx(shared, abs=1e-4)
    assert found[0,] == pytest.approx(np.pi - shared, abs=1e-4)
    assert found[0,] + found[0, 1] == pytest.approx(np.pi, rel=1e-9)


def test_disc_at_a_corner_is_cut_to_a_quarter():
    assert areas([[0.0, 0.0]], 0.5, UNIT) == {(0,): pytest.approx(np.pi / 16.0, rel=1e-6)}


def test_equal_discs_are_one_region():
    assert areas([[0.0, 0.0], [0.0, 0.0]], 1.0) == {(0, 1): pytest.approx(np.pi)}


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32), count=st.integers(1, 12))
def test_areas_sum_to_the_union(seed, count):
    sensors_m = np.random.default_rng(seed).random((count, 2))
    discs = [shapely.Point(x, y).buffer(0.2, quad_segs=400) for x, y in sensors_m]
    union = shapely.intersection(shapely.unary_union(discs), shapely.box(*UNIT)).area
    regions = disc_regions(sensors_m, 0.2, UNIT)
    assert sum(region.area_m2 for region in regions) == pytest.approx(union, rel=1e-4)
    assert len({region.sensors for region in regions}) == len(regions)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_areas_are_shares_of_random_points(seed):
    """Of 20,000 points each region has its share, within five standard errors."""
    rng = np.random.default_rng(seed)
    sensors_m, points_m = rng.random((8, 2)), rng.random((20_000, 2))
    cover = disc_cover(points_m, sensors_m, 0.25)
    for region in disc_regions(sensors_m, 0.25, UNIT):
        share = cover.count(region.sensors) / len(cover)
        deviation = np.sqrt(region.area_m2 * (1.0 - region.area_m2) / len(cover))
        assert abs(share - region.area_m2) < 5.0 * deviation + 1e-4


def test_order_of_sensors_only_renames_regions():
    sensors_m = np.random.default_rng(3).random((9, 2))
    order = np.random.default_rng(4).permutation(9)
    found = areas(sensors_m, 0.2, UNIT)
    renamed = {
        tuple(sorted(order[list(set_)].tolist())): area for set_, area in areas(sensors_m[order], 0.2, UNIT).items()
    }
    assert renamed.keys() == found.keys()
    for set_, area in found.items():
        assert renamed[set_] == pytest.approx(area, abs=1e-6)


def test_block_is_the_nearest_and_cut_at_the_border():
    grid = CellGrid(10, 10, 2, 2, UNIT)
    assert grid.blocks(np.array([[0.52, 0.31], [0.01, 0.01], [0.99, 0.5]])) == (
        frozenset({24, 25, 34, 35}),
        frozenset({0}),
        frozenset({49, 59}),
    )
    assert grid.blocks(np.array([[0.52, 0.31]])) == (frozenset({24, 25, 34, 35}),)


def test_odd_block_is_centred_on_the_sensors_cell():
    grid = CellGrid(5, 5, 1, 3, UNIT)
    assert grid.blocks(np.array([[0.5, 0.5]])) == (frozenset({11, 12, 13}),)


@given(x=st.floats(0.0, 1.0), y=st.floats(0.0, 1.0))
def test_a_point_lies_in_its_cell(x, y):
    grid = CellGrid(4, 8, 2, 2, UNIT)
    (cell,) = grid.cells_of(np.array([[x, y]]))
    region = grid.region(cell, (0,))
    assert abs(region.centre_m[0] - x) <= 1 / 16 + 1e-12
    assert abs(region.centre_m[1] - y) <= 1 / 8 + 1e-12
    assert region.area_m2 == pytest.approx(1 / 32)
