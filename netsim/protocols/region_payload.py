"""Compound regions as bytes: a shape is its kind, how many numbers it takes, and its coordinates as 32-bit floats.

A union or an intersection is its kind, how many parts it has, and the parts. What arrives is the region up to the rounding
of its coordinates, which `regions.covering` allows for.
"""

from typing import Final

from netsim.api import Circle, Polygon, Rectangle, Region
from netsim.codec import Record, decode_floats, encode_floats, size_byte
from netsim.protocols.regions import CompoundRegion, Intersection, Union

_HEAD = Record("BB")  # kind, numbers or parts
_CIRCLE, _RECTANGLE, _POLYGON, _UNION, _INTERSECTION = range(5)
_WIDTH: Final = "float32"
MOST_PARTS: Final = 0xFF


def encode_region(region: CompoundRegion) -> bytes:
    """A region as it goes over the air.

    Raises:
        ValueError: It has a union or an intersection of more than 255 parts.
    """
    if isinstance(region, Union | Intersection):
        if len(region.parts) > MOST_PARTS:
            message = f"a region of {len(region.parts)} parts: expected at most {MOST_PARTS}; nest them"
            raise ValueError(message)
        kind = _UNION if isinstance(region, Union) else _INTERSECTION
        return _HEAD.pack(kind, len(region.parts)) + b"".join(encode_region(part) for part in region.parts)
    kind, numbers = _numbers(region)
    return _HEAD.pack(kind, len(numbers)) + encode_floats(numbers, _WIDTH)


def _numbers(region: Region) -> tuple[int, list[float]]:
    if isinstance(region, Circle):
        return _CIRCLE, [*region.centre_m, region.radius_m]
    if isinstance(region, Rectangle):
        return _RECTANGLE, [*region.low_m, *region.high_m]
    return _POLYGON, [coordinate for vertex in region.vertices_m for coordinate in vertex]


def decode_region(data: bytes, offset: int = 0) -> tuple[CompoundRegion, int]:
    """The inverse of `encode_region`: the region at an offset, and where it ends.

    Raises:
        ValueError: No region is laid out there.
    """
    kind, count = _HEAD.unpack(data, offset)
    offset += _HEAD.size_byte
    if kind in (_UNION, _INTERSECTION):
        parts: list[CompoundRegion] = []
        for _ in range(count):
            part, offset = decode_region(data, offset)
            parts.append(part)
        return (Union(tuple(parts)) if kind == _UNION else Intersection(tuple(parts))), offset
    end = offset + size_byte(count, _WIDTH)
    return _shape(int(kind), decode_floats(data[offset:end], _WIDTH).tolist()), end


def _shape(kind: int, numbers: list[float]) -> Region:
    if kind == _CIRCLE and len(numbers) == 3:
        return Circle((numbers[0], numbers[1]), numbers[2])
    if kind == _RECTANGLE and len(numbers) == 4:
        return Rectangle((numbers[0], numbers[1]), (numbers[2], numbers[3]))
    if kind == _POLYGON and len(numbers) >= 6:
        return Polygon(tuple(zip(numbers[::2], numbers[1::2], strict=True)))
    message = f"a shape of kind {kind} with {len(numbers)} numbers"
    raise ValueError(message)
