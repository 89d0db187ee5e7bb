"""Who and what takes part: nodes with their positions, links, field and model.

Coordinates on the map are metres with y negated, since 2-D views point y down.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk
from scipy.spatial import cKDTree

from netsim.replay import style
from netsim.replay.check import node_table
from netsim.replay.motion import Motion, Moves, no_moves
from netsim.replay.source import batches
from netsim.trace.events import FieldInfo, LinkTable, NodePositions, NodeTable, Problem, VariablePlacement
from netsim.trace.reader import last_time_ns, read_trace

_STATIC_TOPICS = {event_type.topic for event_type in (LinkTable, FieldInfo, VariablePlacement, Problem)}
_MARGIN = 0.03
_LABELLED_NODES = 100
_LEGEND_ROW = 0.07  # of the map's extent, as is the size of a mark
_LEGEND_MARK = 0.013
_LEGEND_SHARE = 1.15  # height of a map with a legend to one without, about
_LEGEND_WIDTH = 0.94
_CALM_LINKS = 8  # links a node
LABEL_DROP = 1.4  # radii that a label hangs below its node
_LABEL_HEIGHT = 0.03


@dataclass(frozen=True)
class LegendBox:
    """Where the legend hangs, in the map's coordinates: its upper edge, the height of a row, the size of a mark."""

    left_m: float
    width_m: float
    top_m: float
    row_m: float
    mark_m: float


@dataclass(frozen=True)
class Scene:
    """What a trace tells at time 0, and where the nodes are later.

    Attributes:
        nodes: The node table.
        motion: Map positions of the rows of the node table.
        row_of: Row of each node id; -1 for ids that no node has.
        radius_m: Radius of a node on the map.
        links: The link table, if the trace has one.
        field: The field, if the trace has one.
        model: The graphical model's placement, if the trace has one.
        group_range_m: Within which of a track's place sensors are of its group; None where there are no groups.
    """

    nodes: NodeTable
    motion: Motion
    row_of: NDArray[np.int64]
    radius_m: float
    links: LinkTable | None
    field: FieldInfo | None
    model: VariablePlacement | None
    group_range_m: float | None = None

    @property
    def place(self) -> NDArray[np.float64]:
        """Map position of each row of the node table at time 0; shape (n, 2)."""
        return self.motion.start

    @property
    def roomy(self) -> bool:
        """Whether there is room for labels; otherwise they are seen by pointing."""
        return len(self.place) <= _LABELLED_NODES

    @property
    def crowded(self) -> bool:
        """Whether nodes have so many links that drawing them all gives a cloud of lines."""
        return self.links is not None and len(self.links.source) > _CALM_LINKS * len(self.place)

    def rows(self, nodes: NDArray[np.integer]) -> NDArray[np.int64]:
        """Rows of node ids; -1 for unknown ids such as `BROADCAST`."""
        return _rows(self.row_of, nodes)

    def bounds(self, legend_rows: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges of x and y that show the whole map and its legend with a margin."""
        low, high = _outline(self)
        box = self.legend_box()
        margin = _MARGIN * self._extent_m() + (0.0 if self.field else 4 * self.radius_m)
        left, right = min(low[0], box.left_m), max(high[0], box.left_m + box.width_m)
        bottom = box.top_m + (legend_rows + 0.1) * box.row_m
        return (float(left - margin), float(right + margin)), (float(low[1] - margin), float(bottom))

    def legend_box(self) -> LegendBox:
        """Where the legend hangs: below the field and the lowest node's label."""
        low, high = _outline(self)
        extent = self._extent_m()
        width = max(float(high[0] - low[0]), _LEGEND_WIDTH * extent)
        lowest = float(self.motion.corners[1][1]) + LABEL_DROP * self.radius_m + _LABEL_HEIGHT * extent
        return LegendBox(
            left_m=float(low[0] + high[0] - width) / 2,
            width_m=width,
            top_m=max(float(high[1]) + 0.5 * _MARGIN * extent, lowest),
            row_m=_LEGEND_ROW * extent,
            mark_m=_LEGEND_MARK * extent,
        )

    def _extent_m(self) -> float:
        """The longer side of the map, legend included: what a nearly square view is filled with."""
        low, high = _outline(self)
        return float(max(high[0] - low[0], _LEGEND_SHARE * (high[1] - low[1]))) or 1.0


def _rows(row_of: NDArray[np.int64], nodes: NDArray[np.integer]) -> NDArray[np.int64]:
    known = nodes < len(row_of)
    return np.where(known, row_of[np.where(known, nodes, 0)], -1)


def load_scene(path: Path) -> Scene:
    """The scene of a trace.

    Raises:
        TraceError: If the trace names no nodes or cannot be read.
    """
    found = {type(event): event for _, event in read_trace(path, _STATIC_TOPICS, end_ns=1)}
    nodes = node_table(path)
    place = np.column_stack([np.asarray(nodes.x_m), -np.asarray(nodes.y_m)])
    ids = np.asarray(nodes.node, np.int64)
    row_of = np.full(int(ids.max()) + 1, -1)
    row_of[ids] = np.arange(len(ids))
    links, field, model = found.get(LinkTable), found.get(FieldInfo), found.get(VariablePlacement)
    problem = found.get(Problem)
    return Scene(
        nodes,
        Motion(place, _moves(path, row_of)),
        row_of,
        _node_radius_m(place),
        links if isinstance(links, LinkTable) else None,
        field if isinstance(field, FieldInfo) else None,
        model if isinstance(model, VariablePlacement) else None,
        _group_range_m(problem) if isinstance(problem, Problem) else None,
    )


def _group_range_m(problem: Problem) -> float | None:
    """The sensing range, where groups of sensors around targets track them."""
    if problem.kind != "energy-tracking":
        return None
    return float(json.loads(problem.content_json)["sensing_range_m"])


def _moves(path: Path, row_of: NDArray[np.int64]) -> Moves:
    """All announcements of positions, in the order of time."""
    parts: list[Moves] = []
    for batch in batches(path, [NodePositions.topic], 0, last_time_ns(path) + 1):
        node, lengths = batch.rows("node")
        place = np.column_stack([batch.rows("x_m")[0], -batch.rows("y_m")[0]])
        row = _rows(row_of, node)
        parts.append(Moves(np.repeat(batch.time_ns, lengths)[row >= 0], row[row >= 0], place[row >= 0]))
    if not parts:
        return no_moves()
    return Moves(
        np.concatenate([part.time_ns for part in parts]),
        np.concatenate([part.row for part in parts]),
        np.concatenate([part.place for part in parts]),
    )


def _node_radius_m(place: NDArray[np.float64]) -> float:
    """An eighth of the median distance to the nearest node, but at least 1/250 of the map."""
    extent = float(np.ptp(place, axis=0).max()) or 1.0
    if len(place) < 2:
        return 0.05 * extent
    nearest_m = cKDTree(place).query(place, k=2)[0][:, 1]
    return float(max(np.median(nearest_m) / 8, extent / 250))


def _outline(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Opposite corners of what holds the field and every position of a node."""
    low, high = scene.motion.corners
    if scene.field is None:
        return low, high
    corner, size = _corner_and_size(scene.field)
    return np.minimum(low, corner), np.maximum(high, corner + size)


def _corner_and_size(field: FieldInfo) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The upper left corner on the map, and the size."""
    return np.array([field.x_m, -(field.y_m + field.height_m)]), np.array([field.width_m, field.height_m])


def diamond(middles: NDArray[np.float64], half_m: float) -> NDArray[np.float32]:
    """Closed outlines of squares that stand on a corner; shape (n, 5, 2)."""
    corners = half_m * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    return np.asarray(middles[:, None] + corners, np.float32)


def static(entity: str, archetype: rr.AsComponents) -> Chunk:
    """A chunk with one static row."""
    columns = [
        rr.ComponentColumn(batch.component_descriptor(), batch).partition([len(batch.as_arrow_array())])
        for batch in archetype.as_component_batches()
    ]
    return Chunk.from_columns(entity, [], columns)


def field_chunks(scene: Scene) -> Iterator[Chunk]:
    """The field as static data."""
    if scene.field is None:
        return
    corner, size = _corner_and_size(scene.field)
    outline = rr.Boxes2D(
        mins=[corner], sizes=[size], colors=[style.FIELD], radii=[-1.0], draw_order=style.ORDER["field"]
    )
    yield static("/map/field", outline)
