"""Who takes part: nodes with their positions, links and field, in metres, y to the north."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from netsim.replay.check import node_table
from netsim.replay.motion import Motion, Moves, no_moves
from netsim.trace.events import FieldInfo, LinkTable, NodePositions, NodeTable, Problem
from netsim.trace.reader import read_trace

_BEST_LINKS = 3  # of each node, where there are so many that drawing them all gives a cloud of lines
_AROUND = 3.0  # node radii
_CALM_LINKS = 8  # links a node
_STATIC_TOPICS = {event_type.topic for event_type in (LinkTable, FieldInfo, Problem)}

Ints = NDArray[np.int64]
Places = NDArray[np.float64]


@dataclass(frozen=True)
class Cast:
    """What a trace tells at time 0, and where the nodes are later.

    Attributes:
        nodes: The node table.
        motion: Positions of the rows of the node table.
        row_of: Row of each node id; -1 for ids that no node has.
        radius_m: Radius of a node on the map.
        links: The link table, if the trace has one.
        field: The field, if the trace has one.
        measures: What each sensor of a tracking problem measures, by node id.
        has_track_colours: Whether tracks and targets are told apart by colours, as where groups of sensors track them.
    """

    nodes: NodeTable
    motion: Motion
    row_of: Ints
    radius_m: float
    links: LinkTable | None
    field: FieldInfo | None
    measures: Mapping[int, str]
    has_track_colours: bool = False

    @property
    def size(self) -> int:
        """How many nodes there are."""
        return len(self.motion.start)

    def rows(self, nodes: NDArray[np.integer]) -> Ints:
        """Rows of node ids; -1 for unknown ids such as `BROADCAST`."""
        return _rows(self.row_of, nodes)

    def row(self, node: int) -> int:
        """Row of a node id; -1 for an unknown one."""
        return int(self.row_of[node]) if node < len(self.row_of) else -1

    def outline(self) -> tuple[Places, Places]:
        """Opposite corners of what holds the field and every node wherever it goes, with what is drawn around it."""
        low, high = self.motion.corners
        low, high = low - _AROUND * self.radius_m, high + _AROUND * self.radius_m
        if self.field is not None:
            corner = np.array([self.field.x_m, self.field.y_m])
            size = np.array([self.field.width_m, self.field.height_m])
            low, high = np.minimum(low, corner), np.maximum(high, corner + size)
        return low, high

    def lines(self) -> tuple[Ints, NDArray[np.float64]]:
        """Pairs of rows to draw a link between, and the worse of its two reception ratios; only of nodes that stay.

        Of many links those that are among the best of either end.
        """
        if self.links is None or not len(self.links.source):
            return np.empty((0, 2), np.int64), np.empty(0)
        ends = np.column_stack(
            [self.rows(np.asarray(self.links.source)), self.rows(np.asarray(self.links.destination))]
        )
        pairs, where = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        prr, gain_db = np.ones(len(pairs)), np.full(len(pairs), np.inf)
        np.minimum.at(prr, where.ravel(), np.asarray(self.links.prr, np.float64))
        np.minimum.at(gain_db, where.ravel(), np.asarray(self.links.gain_db, np.float64))
        still = ~self.motion.moving[pairs].any(axis=1)
        pairs, prr, gain_db = pairs[still], prr[still], gain_db[still]
        if len(self.links.source) > _CALM_LINKS * self.size:
            best = _best(self.motion.start, pairs, gain_db)
            return pairs[best], prr[best]
        return pairs, prr


def load_cast(path: Path) -> Cast:
    """The cast of a trace.

    Raises:
        TraceError: If the trace names no nodes or cannot be read.
    """
    nodes = node_table(path)
    found = {type(event): event for _, event in read_trace(path, _STATIC_TOPICS, end_ns=1)}
    ids = np.asarray(nodes.node, np.int64)
    row_of = np.full(int(ids.max()) + 1, -1)
    row_of[ids] = np.arange(len(ids))
    start = np.column_stack([np.asarray(nodes.x_m, float), np.asarray(nodes.y_m, float)])
    links, field, problem = found.get(LinkTable), found.get(FieldInfo), found.get(Problem)
    return Cast(
        nodes,
        Motion(start, _moves(path, row_of)),
        row_of,
        _node_radius_m(start),
        links if isinstance(links, LinkTable) else None,
        field if isinstance(field, FieldInfo) else None,
        _measures(problem) if isinstance(problem, Problem) else {},
        isinstance(problem, Problem) and problem.kind == "energy-tracking",
    )


def _rows(row_of: Ints, nodes: NDArray[np.integer]) -> Ints:
    known = nodes < len(row_of)
    return np.where(known, row_of[np.where(known, nodes, 0)], -1)


def _moves(path: Path, row_of: Ints) -> Moves:
    """All announcements of positions, in the order of time."""
    parts: list[Moves] = []
    for time_ns, event in read_trace(path, {NodePositions.topic}):
        if isinstance(event, NodePositions):
            row = _rows(row_of, np.asarray(event.node, np.int64))
            place = np.column_stack([np.asarray(event.x_m, float), np.asarray(event.y_m, float)])[row >= 0]
            parts.append(Moves(np.full(len(place), time_ns, np.int64), row[row >= 0], place))
    if not parts:
        return no_moves()
    return Moves(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("time_ns", "row", "place")))


def _node_radius_m(place: Places) -> float:
    """An eighth of the median distance to the nearest node, but at least 1/250 of the map."""
    extent = float(np.ptp(place, axis=0).max()) or 1.0
    if len(place) < 2:
        return 0.05 * extent
    nearest_m = cKDTree(place).query(place, k=2)[0][:, 1]
    return float(max(np.median(nearest_m) / 8, extent / 250))


def _measures(problem: Problem) -> dict[int, str]:
    if problem.kind != "tracking":
        return {}
    return {int(each["node"]): each["measures"] for each in json.loads(problem.content_json)["sensors"]}


def _best(place: Places, pairs: Ints, gain_db: NDArray[np.float64]) -> Ints:
    """The pairs that are among the best of either end: highest gain first, then nearest."""
    distance_m = np.linalg.norm(place[pairs[:, 0]] - place[pairs[:, 1]], axis=1)
    node, pair = pairs.T.ravel(), np.tile(np.arange(len(pairs)), 2)
    order = np.lexsort((distance_m[pair], -gain_db[pair], node))
    begins = np.searchsorted(node[order], np.arange(len(place)))
    rank = np.arange(len(order)) - begins[node[order]]
    return np.unique(pair[order[rank < _BEST_LINKS]])
