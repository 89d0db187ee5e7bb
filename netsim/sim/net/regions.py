"""Regions that messages can be sent to: their bytes on the air, and what lies in them."""

import math
import struct
from collections.abc import Sequence

from netsim.api import Circle, Polygon, Rectangle, Region

Point = tuple[float, float]
_CIRCLE, _RECTANGLE, _POLYGON = 0, 1, 2
MOST_VERTICES = 8
"""A polygon of eight vertices takes 66 bytes of every packet."""


MOST_M = 1e9
"""Coordinates travel as 32-bit floats, which are too coarse long before this."""


def what_is_wrong(region: Region) -> str | None:
    """Why a region cannot be sent to, in words; None if it can."""
    if isinstance(region, Circle):
        numbers: Sequence[float] = (*region.centre_m, region.radius_m)
        if region.radius_m < 0.0:
            return f"a circle with the radius {region.radius_m:g} m: it is at least 0"
    elif isinstance(region, Rectangle):
        numbers = (*region.low_m, *region.high_m)
    else:
        numbers = [number for vertex in region.vertices_m for number in vertex]
        if not 3 <= len(region.vertices_m) <= MOST_VERTICES:
            return f"a polygon of {len(region.vertices_m)} vertices: it has 3 to {MOST_VERTICES}"
    if any(not abs(number) <= MOST_M for number in numbers):
        return f"{region}: its numbers are metres, finite and of at most {MOST_M:g}"
    return None


def encode_region(region: Region) -> bytes:
    """A region as 32-bit floats: 13 bytes for a circle, 17 for a rectangle, 2 + 8 for each vertex of a polygon."""
    if isinstance(region, Circle):
        return struct.pack(">B3f", _CIRCLE, *region.centre_m, region.radius_m)
    if isinstance(region, Rectangle):
        return struct.pack(">B4f", _RECTANGLE, *region.low_m, *region.high_m)
    numbers = [number for vertex in region.vertices_m for number in vertex]
    return struct.pack(f">BB{len(numbers)}f", _POLYGON, len(region.vertices_m), *numbers)


def region_byte(data: bytes) -> int | None:
    """Size of the region that these bytes begin with; None if they do not begin with one."""
    if len(data) < 2:
        return None
    size_byte = {_CIRCLE: 13, _RECTANGLE: 17, _POLYGON: 2 + 8 * data[1]}.get(data[0])
    if size_byte is None or len(data) < size_byte or (data[0] == _POLYGON and not 3 <= data[1] <= MOST_VERTICES):
        return None
    numbers = _numbers(data, size_byte)
    return size_byte if all(math.isfinite(number) for number in numbers) else None


def _numbers(data: bytes, size_byte: int) -> tuple[float, ...]:
    start = 2 if data[0] == _POLYGON else 1
    return struct.unpack_from(f">{(size_byte - start) // 4}f", data, start)


def decode_region(data: bytes) -> Region:
    """The region that `encode_region` gave these bytes, which `region_byte` has approved of."""
    numbers = _numbers(data, region_byte(data) or 0)
    if data[0] == _CIRCLE:
        return Circle((numbers[0], numbers[1]), numbers[2])
    points = tuple(zip(numbers[::2], numbers[1::2], strict=True))
    return Rectangle(*points) if data[0] == _RECTANGLE else Polygon(points)


def contains(region: Region, point_m: Point) -> bool:
    """Whether a point lies in a region; the edge of circles and rectangles belongs to it."""
    x, y = point_m
    if isinstance(region, Circle):
        return math.hypot(x - region.centre_m[0], y - region.centre_m[1]) <= region.radius_m
    if isinstance(region, Rectangle):
        return region.low_m[0] <= x <= region.high_m[0] and region.low_m[1] <= y <= region.high_m[1]
    return _crossings(region.vertices_m, x, y) % 2 == 1


def _crossings(vertices_m: Sequence[Point], x: float, y: float) -> int:
    """How often a ray to the right leaves or enters the polygon."""
    count = 0
    for (ax, ay), (bx, by) in zip(vertices_m, [*vertices_m[1:], vertices_m[0]], strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            count += 1
    return count


def centre(region: Region) -> Point:
    """Where a message to a region is headed: the middle; of a polygon the mean of its vertices."""
    if isinstance(region, Circle):
        return region.centre_m
    if isinstance(region, Rectangle):
        return (region.low_m[0] + region.high_m[0]) / 2, (region.low_m[1] + region.high_m[1]) / 2
    count = len(region.vertices_m)
    return sum(x for x, _ in region.vertices_m) / count, sum(y for _, y in region.vertices_m) / count
