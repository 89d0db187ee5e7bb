"""What stands still: nodes, links, field and model, as the trace tells them at time 0.

Coordinates on the map are metres with y negated, since 2-D views point y down.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk
from scipy.spatial import cKDTree

from netsim.errors import TraceError
from netsim.replay import style
from netsim.trace.events import FieldInfo, LinkTable, NodeTable, VariablePlacement
from netsim.trace.reader import read_trace

_STATIC_TOPICS = {event_type.topic for event_type in (NodeTable, LinkTable, FieldInfo, VariablePlacement)}
_MARGIN = 0.03
_LABELLED_NODES = 100
_LEGEND_HEIGHT = 0.04
_LABEL_DROP = 1.4
_VARIABLE_OFFSET = 1.5  # radii from the host, so that a variable is seen beside its node


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

    def bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges of x and y that show the whole map with a margin."""
        low, high = _outline(self)
        extent = float(max(high - low))
        margin = _MARGIN * extent + (0.0 if self.field else 4 * self.radius_m)
        bottom = high[1] + margin + _LEGEND_HEIGHT * extent
        return (float(low[0] - margin), float(high[0] + margin)), (float(low[1] - margin), float(bottom))


def load_scene(path: Path) -> Scene:
    """The scene of a trace.

    Raises:
        TraceError: If the trace names no nodes or cannot be read.
    """
    found = {type(event): event for _, event in read_trace(path, _STATIC_TOPICS, end_ns=1)}
    nodes = found.get(NodeTable)
    if not isinstance(nodes, NodeTable) or not len(nodes.node):
        msg = f"{path}: the trace names no nodes, so there is nothing to show"
        raise TraceError(msg)
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
    yield from _link_chunks(scene)
    yield from _model_chunks(scene)
    yield from _node_chunks(scene)


def legend(scene: Scene, names: Sequence[str], colours: Sequence[style.Rgba]) -> Chunk:
    """Names in their colours in a row below the map."""
    (left, right), (_, bottom) = scene.bounds()
    places = left + (right - left) * (np.arange(len(names)) + 0.5) / len(names)
    drop = bottom - _LEGEND_HEIGHT * (right - left)
    points = rr.Points2D(
        np.column_stack([places, np.full(len(names), drop)]),
        colors=list(colours),
        radii=[0.0],
        labels=list(names),
        show_labels=True,
    )
    return static("/map/legend", points)


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


def _link_chunks(scene: Scene) -> Iterator[Chunk]:
    """One line a pair, coloured by its worse direction."""
    if scene.links is None or not len(scene.links.source):
        return
    a, b = scene.rows(np.asarray(scene.links.source)), scene.rows(np.asarray(scene.links.destination))
    pairs, where = np.unique(np.sort(np.column_stack([a, b]), axis=1), axis=0, return_inverse=True)
    prr = np.ones(len(pairs))
    np.minimum.at(prr, where.ravel(), np.asarray(scene.links.prr, np.float64))
    lines = rr.LineStrips2D(
        list(scene.place[pairs]),
        colors=style.prr_colours(prr, 2 * len(pairs) / len(scene.place)),
        radii=[-0.5],
        draw_order=style.ORDER["links"],
    )
    yield static("/map/links", lines)


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
        labels=list(scene.nodes.name),
        show_labels=True,
        draw_order=style.ORDER["nodes"],
    )
    yield static("/map/nodes/labels", labels)
