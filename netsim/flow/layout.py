"""A place for every vertex of a graphical model: sensors where their nodes stand, the others near what they are about.

Vertices of sensors keep their places; a target's vertex is near the target's true position, a subregion's or a factor's
between its neighbours. Those that would cover each other are pushed apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from netsim.errors import TraceError
from netsim.trace.events import NodeTable, TruthTargets, VariablePlacement

Floats = NDArray[np.float64]

SQUARES = ("target", "subregion", "region", "cell", "factor")
"""First words of the names of vertices that are no sensor's and no plain variable's."""

_LETTER = {"subregion": "r"}
_GAP = 0.6  # of the spacing that the vertices would have if they were spread evenly
_ASIDE = 0.14  # of a vertex's diameter: messages the two ways along an edge go beside each other
_PUSHES = 300
_PULL = 0.05  # back to where a vertex belongs, at the first push; fades to nothing
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True)
class GraphLayout:
    """The vertices in the order of the placement.

    Attributes:
        place_m: Position of each vertex, shape (n, 2), metres.
        label: A short name, such as `s7` for `sensor 7`.
        is_square: Whether the vertex is a target's, a subregion's or a factor's.
        row_of: Row of each vertex id.
        edges: Rows at the ends of each edge, shape (m, 2).
        gap_m: How far apart any two vertices are, but for a few per cent.
    """

    place_m: Floats
    label: tuple[str, ...]
    is_square: NDArray[np.bool_]
    row_of: Mapping[int, int]
    edges: NDArray[np.int64]
    gap_m: float

    def rows(self, pairs: Sequence[tuple[int, int]]) -> NDArray[np.int64]:
        """Rows of senders and receivers, shape (k, 2), each pair once."""
        unique = sorted(set(pairs))
        return np.array([[self.row_of[a], self.row_of[b]] for a, b in unique], np.int64).reshape(-1, 2)

    def arrows(self, messages: Sequence[tuple[int, int]], mark_m: float) -> tuple[Floats, Floats]:
        """Where the arrows of messages begin and how far they go: from rim to rim, to the right as the sender sees it.

        Args:
            messages: Sender and receiver, by id.
            mark_m: Diameter of a vertex.

        Returns:
            Two arrays of shape (k, 2), k the number of different messages.
        """
        ends = self.place_m[self.rows(messages)]
        way = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(way, axis=1, keepdims=True)
        along = way / np.maximum(length, np.finfo(float).tiny)
        aside = _ASIDE * mark_m * np.column_stack([along[:, 1], -along[:, 0]])
        rim = np.minimum(0.55 * mark_m, 0.4 * length)
        return ends[:, 0] + aside + rim * along, way - 2 * rim * along


def lay_out(model: VariablePlacement, nodes: NodeTable, truth: TruthTargets | None) -> GraphLayout:
    """Find the places.

    Args:
        model: Vertices, their names and hosts, and edges.
        nodes: Where the hosts stand.
        truth: Where the targets are, for vertices named `target N`.

    Raises:
        TraceError: If a vertex is on a node that the table lacks, or an edge ends at a vertex that the model lacks.
    """
    row_of = {int(vertex): row for row, vertex in enumerate(model.variable)}
    edges = _edges(model, row_of)
    is_square = np.array([name.partition(" ")[0] in SQUARES for name in model.name], bool)
    anchors = _anchors(model, _host_places(model, nodes), _truth_places(truth), is_square, edges)
    gap_m = _gap_m(anchors)
    place_m = _apart(anchors, _is_alone(anchors, ~is_square, gap_m), gap_m)
    return GraphLayout(place_m, tuple(map(short_name, model.name)), is_square, row_of, edges, gap_m)


def short_name(name: str) -> str:
    """`s7` for `sensor 7`, `r7` for `subregion 7`; other names as they are."""
    word, _, number = name.partition(" ")
    return f"{_LETTER.get(word, word[:1])}{number}" if number.isdigit() else name


def _edges(model: VariablePlacement, row_of: Mapping[int, int]) -> NDArray[np.int64]:
    try:
        pairs = [(row_of[int(a)], row_of[int(b)]) for a, b in zip(model.edge_a, model.edge_b, strict=True)]
    except KeyError as error:
        message = f"the model has an edge to vertex {error.args[0]}, which is none of its {len(row_of)} vertices"
        raise TraceError(message) from error
    return np.array(pairs, np.int64).reshape(-1, 2)


def _host_places(model: VariablePlacement, nodes: NodeTable) -> Floats:
    where = {int(node): (x, y) for node, x, y in zip(nodes.node, nodes.x_m, nodes.y_m, strict=True)}
    try:
        return np.array([where[int(host)] for host in model.host], float).reshape(-1, 2)
    except KeyError as error:
        message = f"the model has vertices on node {error.args[0]}, which the table of nodes lacks"
        raise TraceError(message) from error


def _truth_places(truth: TruthTargets | None) -> dict[str, tuple[float, float]]:
    if truth is None:
        return {}
    return {f"target {int(number)}": (x, y) for number, x, y in zip(truth.target, truth.x_m, truth.y_m, strict=True)}


def _anchors(
    model: VariablePlacement,
    hosts_m: Floats,
    truth_m: Mapping[str, tuple[float, float]],
    is_square: NDArray[np.bool_],
    edges: NDArray[np.int64],
) -> Floats:
    """Where each vertex belongs; a square without a place of its own belongs between its neighbours that have one."""
    anchors = hosts_m.copy()
    known = ~is_square
    for row, name in enumerate(model.name):
        if name in truth_m:
            anchors[row], known[row] = truth_m[name], True
    both = np.concatenate([edges, edges[:, ::-1]])
    for square in np.flatnonzero(~known):
        neighbours = both[both[:, 0] == square, 1]
        placed = neighbours[known[neighbours]]
        if len(placed):
            anchors[square] = anchors[placed].mean(axis=0)
    return anchors


def _gap_m(anchors: Floats) -> float:
    size = np.ptp(anchors, axis=0) if len(anchors) > 1 else np.zeros(2)
    even_m = max(float(np.sqrt(size[0] * size[1] / len(anchors))), float(size.max(initial=0.0)) / max(1, len(anchors)))
    return _GAP * even_m if even_m > 0 else 1.0


def _is_alone(anchors: Floats, candidates: NDArray[np.bool_], gap_m: float) -> NDArray[np.bool_]:
    """Candidates that no other candidate is too near to: they can stay where they belong."""
    rows = np.flatnonzero(candidates)
    alone = candidates.copy()
    if len(rows) > 1:
        nearest_m = cKDTree(anchors[rows]).query(anchors[rows], k=2)[0][:, 1]
        alone[rows] = nearest_m >= gap_m
    return alone


def _apart(anchors: Floats, is_fixed: NDArray[np.bool_], gap_m: float) -> Floats:
    """Push vertices apart until no two are nearer than the gap, while they are pulled to where they belong."""
    place = anchors.copy()
    for push in range(_PUSHES):
        pairs = cKDTree(place).query_pairs(0.999 * gap_m, output_type="ndarray")
        pairs = pairs[~is_fixed[pairs].all(axis=1)] if len(pairs) else pairs
        if not len(pairs):
            break
        pull = _PULL * (1.0 - push / _PUSHES) * (anchors - place)
        step = _push(place, np.sort(pairs, axis=1), is_fixed, gap_m) + pull
        place = np.where(is_fixed[:, None], place, place + step)
    return place


def _push(place: Floats, pairs: NDArray[np.int64], is_fixed: NDArray[np.bool_], gap_m: float) -> Floats:
    """How each vertex moves away from those too near; what cannot move leaves the whole way to the other."""
    first, second = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
    away = place[second] - place[first]
    distance = np.linalg.norm(away, axis=1)
    angle = _GOLDEN * (second + 1)  # any direction serves for two at one place, if it is another for each
    away = np.where(distance[:, None] > 0, away, np.column_stack([np.cos(angle), np.sin(angle)]))
    away /= np.linalg.norm(away, axis=1)[:, None]
    missing = (gap_m - distance)[:, None] * away
    step = np.zeros_like(place)
    np.add.at(step, first, -missing * np.where(is_fixed[second], 1.0, 0.5)[:, None])
    np.add.at(step, second, missing * np.where(is_fixed[first], 1.0, 0.5)[:, None])
    return step
