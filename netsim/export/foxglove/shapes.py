"""Foxglove's shapes, from metres and colours: all lie in the plane of the map, z is only what is above what."""

import math
from collections.abc import Iterable, Mapping, Sequence

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

from netsim.units import NS_PER_S

FRAME_ID = "map"
Rgba = Sequence[int]
"""Red, green, blue, opacity: 0 to 255."""
Place = tuple[float, float]
"""Metres to the east and to the north."""


def stamp(time_ns: int) -> Timestamp:
    """An instant."""
    return Timestamp(seconds=time_ns // NS_PER_S, nanos=time_ns % NS_PER_S)


def colour(rgba: Rgba) -> Color:
    """A colour."""
    red, green, blue, alpha = (int(part) / 255.0 for part in rgba)
    return Color(r=red, g=green, b=blue, a=alpha)


def pose(place: Place, z_m: float = 0.0, yaw_rad: float = 0.0) -> Pose:
    """A place on the map, turned to the left of the east."""
    turned = Quaternion(x=0.0, y=0.0, z=math.sin(yaw_rad / 2.0), w=math.cos(yaw_rad / 2.0))
    return Pose(position=Vector3(x=place[0], y=place[1], z=z_m), orientation=turned)


def entity(name: str, time_ns: int, *, lifetime_ns: int = 0, notes: Mapping[str, str] | None = None) -> SceneEntity:
    """An entity without shapes; without a lifetime it stays until it is replaced."""
    return SceneEntity(
        timestamp=stamp(time_ns),
        frame_id=FRAME_ID,
        id=name,
        lifetime=Duration(seconds=lifetime_ns // NS_PER_S, nanos=lifetime_ns % NS_PER_S),
        metadata=[KeyValuePair(key=key, value=value) for key, value in (notes or {}).items()],
    )


def sphere(place: Place, z_m: float, diameter_m: float, rgba: Rgba) -> SpherePrimitive:
    """A ball."""
    size = Vector3(x=diameter_m, y=diameter_m, z=diameter_m)
    return SpherePrimitive(pose=pose(place, z_m), size=size, color=colour(rgba))


def disk(place: Place, z_m: float, size_m: Sequence[float], rgba: Rgba, yaw_rad: float = 0.0) -> CylinderPrimitive:
    """A flat ellipse, `size_m` long, wide and high."""
    long_m, wide_m, high_m = size_m
    size = Vector3(x=long_m, y=wide_m, z=high_m)
    centre = pose(place, z_m, yaw_rad)
    return CylinderPrimitive(pose=centre, size=size, bottom_scale=1.0, top_scale=1.0, color=colour(rgba))


def text(place: Place, z_m: float, size_m: float, rgba: Rgba, words: str) -> TextPrimitive:
    """A label that faces the eye."""
    return TextPrimitive(pose=pose(place, z_m), billboard=True, font_size=size_m, color=colour(rgba), text=words)


def arrow(tail: Place, head: Place, z_m: float, width_m: float, rgba: Rgba) -> ArrowPrimitive:
    """An arrow; its head is four shafts wide and eight long, or less where it is short."""
    east_m, north_m = head[0] - tail[0], head[1] - tail[1]
    length_m = math.hypot(east_m, north_m)
    head_m = min(8.0 * width_m, length_m / 2.0)
    return ArrowPrimitive(
        pose=pose(tail, z_m, math.atan2(north_m, east_m)),
        shaft_length=length_m - head_m,
        shaft_diameter=width_m,
        head_length=head_m,
        head_diameter=4.0 * width_m,
        color=colour(rgba),
    )


def lines(points: Iterable[Place], z_m: float, width_m: float, colours: Iterable[Rgba]) -> LinePrimitive:
    """Separate lines between points taken two by two, with a colour a point."""
    return LinePrimitive(
        type=LinePrimitive.LINE_LIST,
        pose=pose((0.0, 0.0)),
        thickness=width_m,
        points=[Point3(x=x_m, y=y_m, z=z_m) for x_m, y_m in points],
        colors=[colour(rgba) for rgba in colours],
    )


def loop(points: Iterable[Place], z_m: float, width_m: float, rgba: Rgba) -> LinePrimitive:
    """A closed line."""
    return LinePrimitive(
        type=LinePrimitive.LINE_LOOP,
        pose=pose((0.0, 0.0)),
        thickness=width_m,
        points=[Point3(x=x_m, y=y_m, z=z_m) for x_m, y_m in points],
        color=colour(rgba),
    )
