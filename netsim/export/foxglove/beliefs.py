"""Beliefs: a grid of coloured cells a track, and one cloud of points for all particles."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from numpy.typing import NDArray

from netsim.export.foxglove.shapes import FRAME_ID, pose, stamp
from netsim.export.foxglove.stage import Stage
from netsim.replay import style
from netsim.trace.events import Belief, Event, Particles
from netsim.trace.recorder import Handler
from netsim.units import s_to_ns

CLOUD_TOPIC = "/particles"
HOLD_NS = s_to_ns(5.0)
"""How long particles are shown when nothing follows."""

_NUMBERS = {"u1": PackedElementField.UINT8, "f4": PackedElementField.FLOAT32}
_COLOURS = [(name, "u1") for name in ("red", "green", "blue", "alpha")]
_CELL = np.dtype([*_COLOURS, ("probability", "<f4")])
_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), *_COLOURS, ("weight", "<f4"), ("track", "<f4")])

Packed = NDArray[np.void]


class Beliefs:
    """Shows the latest belief of each track, whoever holds it."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._clouds: dict[int, tuple[int, Packed]] = {}

    def handlers(self) -> Mapping[type[Event], Handler]:
        """Beliefs of both kinds."""
        return {Belief: self._on_belief, Particles: self._on_particles}

    def _on_belief(self, event: Belief, time_ns: int) -> None:
        if not self._stage.job.selection.has_node(event.node):
            return
        cells = _cells(event)
        corner = (event.origin_x_m, event.origin_y_m)
        grid = Grid(
            timestamp=stamp(time_ns),
            frame_id=FRAME_ID,
            pose=pose(corner, -1.8 * self._stage.unit_m),
            column_count=event.columns,
            cell_size=Vector2(x=event.cell_m, y=event.cell_m),
            row_stride=event.columns * _CELL.itemsize,
            cell_stride=_CELL.itemsize,
            fields=_fields(_CELL),
            data=cells.tobytes(),
        )
        thread = f"/thread_{event.thread + 1}" if event.thread else ""
        self._stage.show(f"/beliefs/{event.target}{thread}", grid, time_ns)

    def _on_particles(self, event: Particles, time_ns: int) -> None:
        if not self._stage.job.selection.has_node(event.node):
            return
        count = len(event.weight)
        for place, track in enumerate(map(int, event.target)):
            part = slice(place * count, (place + 1) * count)
            self._clouds[track] = time_ns, _points(event, track, part)
        clouds = [cloud for told_ns, cloud in self._clouds.values() if told_ns + HOLD_NS > time_ns]
        points = PointCloud(
            timestamp=stamp(time_ns),
            frame_id=FRAME_ID,
            pose=pose((0.0, 0.0)),
            point_stride=_POINT.itemsize,
            fields=_fields(_POINT),
            data=np.concatenate(clouds).tobytes(),
        )
        self._stage.show(CLOUD_TOPIC, points, time_ns)


def _cells(event: Belief) -> Packed:
    """Every cell of the rows that have any probability, and those below them; those of no probability are clear."""
    numbers, chances = np.asarray(event.cell, np.int64), np.asarray(event.probability, float)
    rows = int(numbers.max(initial=0)) // event.columns + 1
    cells = np.zeros(rows * event.columns, _CELL)
    cells["probability"][numbers] = chances
    share = chances / max(float(chances.max(initial=0.0)), 1e-300)
    if len(share) > 1 and float(np.ptp(share)) == 0.0:
        share = share * style.UNIFORM_BELIEF
    for name, values in zip(("red", "green", "blue", "alpha"), style.belief_colours(share).T, strict=True):
        cells[name][numbers] = values
    return cells


def _points(event: Particles, track: int, part: slice) -> Packed:
    """The particles of one track, the more opaque the heavier."""
    weights = np.asarray(event.weight, float)
    points = np.zeros(len(weights), _POINT)
    points["x"], points["y"] = np.asarray(event.x_m)[part], np.asarray(event.y_m)[part]
    points["weight"], points["track"] = weights, track
    red, green, blue, _ = style.kind_colour(track)
    points["red"], points["green"], points["blue"] = red, green, blue
    points["alpha"] = (80 + 175 * np.sqrt(weights / max(float(weights.max(initial=0.0)), 1e-300))).astype(np.uint8)
    return points


def _fields(layout: np.dtype[np.void]) -> list[PackedElementField]:
    """The layout of a record, for a viewer."""
    places: Mapping[str, tuple[Any, ...]] = layout.fields or {}
    return [
        PackedElementField(name=name, offset=place[1], type=_NUMBERS[place[0].str[1:]])
        for name, place in places.items()
    ]
