"""What stands still: nodes, links, field and model, as the trace tells them at time 0.

Coordinates on the map are metres with y negated, since 2-D views point y down.
"""

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
from netsim.trace.events import FieldInfo, LinkTable, NodeTable, VariablePlacement
from netsim.trace.reader import read_trace

_STATIC_TOPICS = {event_type.topic for event_type in (LinkTable, FieldInfo, VariablePlacement)}
_MARGIN = 0.03
_LABELLED_NODES = 100
_LEGEND_ROW = 0.07  # of the map's extent, as is the size of a mark
_LEGEND_MARK = 0.013
_LEGEND_SHARE = 1.15  # height of a map with a legend to one without, about
_LEGEND_WIDTH = 0.94
_LABEL_DROP = 1.4
_LABEL_HEIGHT = 0.03
_VARIABLE_OFFSET = 1.5  # radii from the host, so that a variable is seen beside its node


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
    """The still parts of a trace.

    Attributes:
        nodes: The node table.
        place: Map position of each row of the node table; shape (n, 2).
        row_of: Row of each node id; -1 for ids that no node has.
        radius_m: Radius of a node on the map.
        links: The link table, if the trace has one.
        field: The field, if the trace has one.
        model: The graphical model's placement, if the trace has one.
    """

    nodes: NodeTable
    place: NDArray[np.float64]
    row_of: NDArray[np.int64]
    radius_m: float
    links: LinkTable | None
    field: FieldInfo | None
    model: VariablePlacement | None

    @property
    def roomy(self) -> bool:
        """Whether there is room for labels; otherwise they are seen by pointing."""
        return len(self.place) <= _LABELLED_NODES

    def rows(self, nodes: NDArray[np.integer]) -> NDArray[np.int64]:
        """Rows of node ids; -1 for unknown ids such as `BROADCAST`."""
        known = nodes < len(self.row_of)
        return np.where(known, self.row_of[np.where(known, nodes, 0)], -1)

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
        lowest = float(self.place[:, 1].max()) + _LABEL_DROP * self.radius_m + _LABEL_HEIGHT * extent
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
    return Scene(
        nodes,
        place,
        row_of,
        _node_radius_m(place),
        links if isinstance(links, LinkTable) else None,
        field if isinstance(field, FieldInfo) else None,
        model if isinstance(model, VariablePlacement) else None,
    )


def _node_radius_m(place: NDArray[np.float64]) -> float:
    """An eighth of the median distance to the nearest node, but at least 1/250 of the map."""
    extent = float(np.ptp(place, axis=0).max()) or 1.0
    if len(place) < 2:
        return 0.05 * extent
    nearest_m = cKDTree(place).query(place, k=2)[0][:, 1]
    return float(max(np.median(nearest_m) / 8, extent / 250))


def _outline(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Opposite corners of the field, or of the nodes' bounding box."""
    low, high = scene.place.min(axis=0), scene.place.max(axis=0)
    field = scene.field
    if field is None:
        return low, high
    corner = np.array([field.x_m, -(field.y_m + field.height_m)])
    return np.minimum(low, corner), np.maximum(high, corner + np.array([field.width_m, field.height_m]))


def scene_chunks(scene: Scene) -> Iterator[Chunk]:
    """The still parts as static data."""
    yield from _field_chunks(scene)
    yield from _model_chunks(scene)
    yield from _node_chunks(scene)


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


def _field_chunks(scene: Scene) -> Iterator[Chunk]:
    if scene.field is None:
        return
    low, high = _outline(scene)
    outline = rr.Boxes2D(
        mins=[low], sizes=[high - low], colors=[style.FIELD], radii=[-1.0], draw_order=style.ORDER["field"]
    )
    yield static("/map/field", outline)


def _model_chunks(scene: Scene) -> Iterator[Chunk]:
    """Variables around their hosts, and the edges between them."""
    model = scene.model
    if model is None or not len(model.variable):
        return
    at = _variable_places(scene, model)
    row = {int(variable): index for index, variable in enumerate(model.variable)}
    ends = [(row[int(a)], row[int(b)]) for a, b in zip(model.edge_a, model.edge_b, strict=True)]
    order = style.ORDER["model"]
    if ends:
        edges = rr.LineStrips2D(list(at[np.array(ends)]), colors=[style.MODEL], radii=[-0.5], draw_order=order)
        yield static("/map/model/edges", edges)
    points = rr.Points2D(
        at,
        colors=[style.VARIABLE],
        radii=[0.2 * scene.radius_m],
        labels=list(model.name),
        show_labels=False,
        draw_order=order + 1,
    )
    yield static("/map/model/variables", points)


def _variable_places(scene: Scene, model: VariablePlacement) -> NDArray[np.float64]:
    """Variables of one host stand in a ring around it."""
    host = scene.rows(np.asarray(model.host))
    turn = np.zeros(len(host))
    for node in np.unique(host):
        mine = np.flatnonzero(host == node)
        turn[mine] = np.arange(len(mine)) / len(mine)
    angle = 2 * np.pi * turn + np.pi / 4
    ring = _VARIABLE_OFFSET * scene.radius_m * np.column_stack([np.cos(angle), -np.sin(angle)])
    return np.asarray(scene.place[host] + ring)


def _node_chunks(scene: Scene) -> Iterator[Chunk]:
    """Rims, labels and the colours of the start; energy recolours the nodes later."""
    sinks = np.array([role == "sink" for role in scene.nodes.role])
    rims = rr.Points2D(
        scene.place,
        colors=np.where(sinks[:, None], style.SINK_RIM, style.RIM),
        radii=np.where(sinks, 1.35, 1.2) * scene.radius_m,
        draw_order=style.ORDER["rims"],
    )
    yield static("/map/nodes/rims", rims)
    nodes = rr.Points2D.from_fields(
        positions=scene.place,
        radii=[scene.radius_m],
        labels=list(scene.nodes.name),
        show_labels=False,
        draw_order=style.ORDER["nodes"],
    )
    yield static("/map/nodes", nodes)
    if not scene.roomy:
        return
    # Rerun writes a label across its point, so the visible ones belong to invisibly small points below the nodes.
    labels = rr.Points2D(
        scene.place + np.array([0.0, _LABEL_DROP * scene.radius_m]),
        colors=[style.LABEL],
        radii=[0.0],
        labels=[f"{name} (sink)" if sink else name for name, sink in zip(scene.nodes.name, sinks, strict=True)],
        show_labels=True,
        draw_order=style.ORDER["nodes"],
    )
    yield static("/map/nodes/labels", labels)
