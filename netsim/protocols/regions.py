"""Regions made of circles, rectangles and polygons by union and intersection (Liu et al. 2004, section 5).

A message can be sent to a single shape. To send one to a compound region, send it to its `covering` shape with the region in
the payload, and let the nodes there decide by `contains` whether they are meant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from netsim.api import Circle, Polygon, Rectangle, Region

if TYPE_CHECKING:
    from shapely import Geometry

SEGMENTS: Final = 64
"""Sides, in each quarter, of the polygon that stands for a circle where covers are computed; it encloses the circle."""

MARGIN: Final = 1e-6
"""Covers are larger by this share of their extent, their coordinates and a metre: coordinates travel as 32-bit floats."""


@dataclass(frozen=True, slots=True)
class Union:
    """What lies in one of several regions at least; nothing if there are none.

    Attributes:
        parts: The regions.
    """

    parts: tuple["CompoundRegion", ...]


@dataclass(frozen=True, slots=True)
class Intersection:
    """What lies in all of several regions.

    Attributes:
        parts: The regions, one or more.
    """

    parts: tuple["CompoundRegion", ...]

    def __post_init__(self) -> None:
        """Refuse the intersection of nothing, which would be everywhere.

        Raises:
            ValueError: There are no parts.
        """
        if not self.parts:
            message = "an intersection of no regions: expected one or more"
            raise ValueError(message)


CompoundRegion = Region | Union | Intersection


def contains(region: CompoundRegion, points_m: ArrayLike) -> NDArray[np.bool_]:
    """Which points lie in a region; the edge of circles and rectangles belongs to it.

    Args:
        region: The region.
        points_m: Shape (..., 2).

    Returns:
        Shape (...).
    """
    points = np.asarray(points_m, dtype=float)
    if isinstance(region, Union):
        empty = np.zeros(points.shape[:-1], dtype=bool)
        return np.asarray(np.logical_or.reduce([empty, *(contains(part, points) for part in region.parts)]))
    if isinstance(region, Intersection):
        return np.asarray(np.logical_and.reduce([contains(part, points) for part in region.parts]))
    if isinstance(region, Circle):
        away = points - region.centre_m
        return np.asarray(np.hypot(away[..., 0], away[..., 1]) <= region.radius_m)
    if isinstance(region, Rectangle):
        return np.asarray(((points >= region.low_m) & (points <= region.high_m)).all(axis=-1))
    return _in_polygon(region.vertices_m, points[..., 0], points[..., 1])


def _in_polygon(
    vertices_m: Sequence[tuple[float, float]], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """By how often a ray to the right crosses the border."""
    inside = np.zeros(x.shape, dtype=bool)
    for (ax, ay), (bx, by) in zip(vertices_m, [*vertices_m[1:], vertices_m[0]], strict=True):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def covering(region: CompoundRegion) -> Region | None:
    """The smallest circle, rectangle along the axes or rectangle askew that encloses a region, whichever has the least area.

    A single shape covers itself. Others get a margin for the rounding of coordinates on the air.

    Returns:
        The shape; None where nothing lies in the region.
    """
    if not isinstance(region, Union | Intersection):
        return region
    import shapely

    geometry = _geometry(region)
    if geometry.is_empty:
        return None
    low_x, low_y, high_x, high_y = geometry.bounds
    margin_m = MARGIN * (1.0 + max(high_x - low_x, high_y - low_y) + max(abs(edge) for edge in geometry.bounds))
    corners = shapely.MultiPoint(shapely.get_coordinates(geometry.convex_hull))
    return _least_cover(corners.buffer(margin_m).convex_hull, margin_m)


def _least_cover(geometry: "Geometry", margin_m: float) -> Region:
    import shapely

    low_x, low_y, high_x, high_y = geometry.bounds
    radius_m = float(shapely.minimum_bounding_radius(geometry)) + margin_m
    middle = shapely.minimum_bounding_circle(geometry).centroid
    askew = geometry.minimum_rotated_rectangle
    covers: list[tuple[float, Region]] = [
        (np.pi * radius_m**2, Circle((middle.x, middle.y), radius_m)),
        ((high_x - low_x) * (high_y - low_y), Rectangle((low_x, low_y), (high_x, high_y))),
    ]
    if askew.geom_type == "Polygon":
        corners = tuple((x, y) for x, y in askew.exterior.coords[:-1])
        covers.append((1.001 * askew.area, Polygon(corners)))  # it is the dearest to send: not for next to nothing
    return min(covers, key=lambda cover: cover[0])[1]


def _geometry(region: CompoundRegion) -> "Geometry":
    """The region as shapely's polygons, circles by polygons around them."""
    import shapely

    if isinstance(region, Union):
        return shapely.union_all([_geometry(part) for part in region.parts])
    if isinstance(region, Intersection):
        return shapely.intersection_all([_geometry(part) for part in region.parts])
    if isinstance(region, Circle):
        around_m = region.radius_m / float(np.cos(np.pi / (4 * SEGMENTS)))
        return shapely.Point(region.centre_m).buffer(around_m, quad_segs=SEGMENTS)
    if isinstance(region, Rectangle):
        return shapely.box(*region.low_m, *region.high_m)
    return shapely.make_valid(shapely.Polygon(region.vertices_m))
