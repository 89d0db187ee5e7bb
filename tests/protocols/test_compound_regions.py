"""Unions and intersections of shapes: what lies in them, and single shapes that enclose them."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from netsim.api import Circle, Polygon, Rectangle
from netsim.protocols.regions import CompoundRegion, Intersection, Union, contains, covering
from netsim.sim.net.regions import contains as simple_contains
from netsim.sim.net.regions import decode_region, encode_region

COORDINATES = st.floats(-200.0, 200.0, width=32)
POINTS = st.tuples(COORDINATES, COORDINATES)


@st.composite
def boxes(draw):
    (ax, ay), (bx, by) = draw(POINTS), draw(POINTS)
    return Rectangle((min(ax, bx), min(ay, by)), (max(ax, bx), max(ay, by)))


@st.composite
def polygons(draw):
    """Convex: corners on a circle."""
    x, y = draw(POINTS)
    angles = sorted(draw(st.lists(st.integers(0, 71), min_size=3, max_size=8, unique=True)))
    radius_m = draw(st.floats(1.0, 100.0))
    corners = [(math.radians(5 * a)) for a in angles]
    return Polygon(tuple((x + radius_m * math.cos(a), y + radius_m * math.sin(a)) for a in corners))


SHAPES = st.one_of(st.builds(Circle, POINTS, st.floats(0.5, 120.0)), boxes(), polygons())
REGIONS = st.recursive(
    SHAPES,
    lambda inner: st.one_of(
        st.builds(Union, st.lists(inner, min_size=1, max_size=3).map(tuple)),
        st.builds(Intersection, st.lists(inner, min_size=1, max_size=3).map(tuple)),
    ),
    max_leaves=5,
)


def lies_in(region: CompoundRegion, point_m: tuple[float, float]) -> bool:
    """By the rule of single shapes, and by the words *any* and *all*."""
    if isinstance(region, Union):
        return any(lies_in(part, point_m) for part in region.parts)
    if isinstance(region, Intersection):
        return all(lies_in(part, point_m) for part in region.parts)
    return simple_contains(region, point_m)


@settings(max_examples=60, deadline=None)
@given(REGIONS, st.lists(POINTS, min_size=1, max_size=20))
def test_a_point_is_judged_as_the_network_judges_it(region, points):
    assert contains(region, points).tolist() == [lies_in(region, point) for point in points]
    assert bool(contains(region, points[0])) == lies_in(region, points[0])


@settings(max_examples=60, deadline=None)
@given(REGIONS, st.integers(0, 2**32 - 1))
@example(Union((Rectangle((0.0, 0.0), (0.0, 0.0)),)), 0)
@example(Union((Rectangle((0.0, 0.0), (0.0, 1e-38)),)), 0)
def test_a_cover_leaves_nothing_out_after_its_way_over_the_air(region, seed):
    points = np.random.default_rng(seed).uniform(-320.0, 320.0, (2000, 2))
    inside = points[contains(region, points)]
    cover = covering(region)
    if cover is None:
        assert len(inside) == 0
        return
    if isinstance(region, Union | Intersection):
        cover = decode_region(encode_region(cover))
    assert contains(cover, inside).all()


def test_a_single_shape_covers_itself():
    circle = Circle((1.0, 2.0), 3.0)
    assert covering(circle) is circle


def test_the_cover_of_two_colliding_groups_is_tight():
    """Two discs of 120 m, 140 m apart along a diagonal: a rectangle askew of 380 m by 240 m."""
    half = 70.0 / math.sqrt(2.0)
    cover = covering(Union((Circle((250 - half, 250 - half), 120.0), Circle((250 + half, 250 + half), 120.0))))
    assert isinstance(cover, Polygon)
    corners = np.array(cover.vertices_m)
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    np.testing.assert_allclose(sorted(sides), [240.0, 240.0, 380.0, 380.0], rtol=1e-3)


def test_covers_are_circles_and_rectangles_where_these_are_smaller():
    ring = Union(tuple(Circle((50 * math.cos(a), 50 * math.sin(a)), 30.0) for a in np.linspace(0, 2 * math.pi, 12)))
    cover = covering(ring)
    assert isinstance(cover, Circle)
    assert cover.radius_m == pytest.approx(80.0, rel=1e-3)
    np.testing.assert_allclose(cover.centre_m, (0.0, 0.0), atol=0.1)
    row = Union((Rectangle((0.0, 0.0), (40.0, 10.0)), Rectangle((60.0, 0.0), (100.0, 10.0))))
    assert isinstance(covering(row), Rectangle)


def test_the_cover_of_an_overlap_is_smaller_than_either():
    lens = Intersection((Circle((0.0, 0.0), 100.0), Circle((160.0, 0.0), 100.0)))
    cover = covering(lens)
    assert isinstance(cover, Rectangle)  # 40 m by 120 m
    np.testing.assert_allclose([cover.low_m, cover.high_m], [(60.0, -60.0), (100.0, 60.0)], atol=0.2)


def test_what_is_empty_has_no_cover():
    apart = Intersection((Circle((0.0, 0.0), 10.0), Circle((100.0, 0.0), 10.0)))
    assert covering(apart) is None
    assert covering(Union(())) is None
    assert not contains(Union(()), [(0.0, 0.0)]).any()
    with pytest.raises(ValueError, match="one or more"):
        Intersection(())


def test_touching_discs_have_a_cover():
    touching = Intersection((Circle((0.0, 0.0), 10.0), Circle((20.0, 0.0), 10.0)))
    cover = covering(touching)
    assert cover is not None
    assert contains(cover, (10.0, 0.0))
