"""Plane geometry of geographic routing: planar subgraphs by local tests, the right-hand rule, crossings."""

import math
import struct
from collections.abc import Mapping
from typing import Literal

Point = tuple[float, float]
Planarisation = Literal["gabriel", "rng"]
_ROUNDING = 1e-6
"""Two points nearer than this part of their coordinates are one: positions travel as 32-bit floats."""


def as_sent(point_m: Point) -> Point:
    """A position with the precision that it has in packets, so that all nodes compute with the same."""
    x, y = struct.unpack("2f", struct.pack("2f", *point_m))
    return x, y


def planar_neighbours(me: Point, near: Mapping[int, Point], rule: Planarisation) -> dict[int, Point]:
    """The neighbours whose edge stays in the planar subgraph (Karp and Kung 2000, section 2.2).

    `gabriel` leaves out an edge with another neighbour in the disk of which it is a diameter (or on its rim, as on a
    grid); `rng`, the relative neighbourhood graph, one with another neighbour nearer to both ends than they are to each
    other. On a unit-disk graph both keep connected what is connected, and both ends decide alike.
    """
    keeps = _in_gabriel if rule == "gabriel" else _in_rng
    return {node: there for node, there in near.items() if all(keeps(me, there, other) for other in near.values())}


def _in_gabriel(u: Point, v: Point, w: Point) -> bool:
    if w in (u, v):
        return True
    return (u[0] - w[0]) * (v[0] - w[0]) + (u[1] - w[1]) * (v[1] - w[1]) > 0.0


def _in_rng(u: Point, v: Point, w: Point) -> bool:
    return max(_square(u, w), _square(v, w)) >= _square(u, v)


def _square(a: Point, b: Point) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


def distance(a: Point, b: Point) -> float:
    """In metres."""
    return math.sqrt(_square(a, b))


def bearing(a: Point, b: Point) -> float:
    """Direction from a to b in radians."""
    return math.atan2(b[1] - a[1], b[0] - a[0])


def next_counterclockwise(me: Point, from_bearing: float, near: Mapping[int, Point], but: int | None) -> int | None:
    """The right-hand rule: the first edge counterclockwise from a direction, `but` (whence it came) only if alone."""
    others = [node for node in near if node != but]
    if not others:
        return but if but in near else None

    def turn(node: int) -> float:
        return (bearing(me, near[node]) - from_bearing) % (2 * math.pi)

    return min(others, key=lambda node: (turn(node), node))


def crossing(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """Where the segments ab and cd meet; None if they do not, or run side by side."""
    abx, aby, cdx, cdy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    area = abx * cdy - aby * cdx
    if area == 0.0:
        return None
    along_ab = ((c[0] - a[0]) * cdy - (c[1] - a[1]) * cdx) / area
    along_cd = ((c[0] - a[0]) * aby - (c[1] - a[1]) * abx) / area
    if not (0.0 <= along_ab <= 1.0 and 0.0 <= along_cd <= 1.0):
        return None
    return a[0] + along_ab * abx, a[1] + along_ab * aby


def is_nearer(a: Point, b: Point, target: Point) -> bool:
    """Whether a is nearer to a target than b, by more than positions are rounded."""
    scale = max(abs(number) for point in (a, b, target) for number in point)
    return distance(a, target) < distance(b, target) - _ROUNDING * (1.0 + scale)
