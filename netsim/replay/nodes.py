"""The nodes on the map, with their names and the variables that they host; they and all that is theirs follow a move."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.options import Pace
from netsim.replay.scene import LABEL_DROP, Scene, static
from netsim.replay.track import timed
from netsim.trace.events import VariablePlacement

_VARIABLE_OFFSET = 1.5  # radii from the host, so that a variable is seen beside its node
_MOST_POINTS = 500_000  # of points (or lines) that move no more than about so many are written
_MOST_LINES = 50_000


def node_chunks(scene: Scene, pace: Pace) -> Iterator[Chunk]:
    """Nodes, names, ways and variables; energy recolours the nodes later."""
    yield from _node_chunks(scene, pace)
    yield from _trail_chunks(scene)
    if scene.model is not None and len(scene.model.variable):
        yield from _model_chunks(scene, scene.model, pace)


def _node_chunks(scene: Scene, pace: Pace) -> Iterator[Chunk]:
    sinks = np.array([role == "sink" for role in scene.nodes.role])
    rows, none = np.arange(len(scene.place)), np.zeros(2)
    rims: dict[str, Any] = {
        "colors": np.where(sinks[:, None], style.SINK_RIM, style.RIM),
        "radii": np.where(sinks, 1.35, 1.2) * scene.radius_m,
        "draw_order": style.ORDER["rims"],
    }
    yield from _points("/map/nodes/rims", scene, pace, rows, none, rims)
    discs: dict[str, Any] = {
        "radii": [scene.radius_m],
        "labels": list(scene.nodes.name),
        "show_labels": False,
        "draw_order": style.ORDER["nodes"],
    }
    yield from _points("/map/nodes", scene, pace, rows, none, discs)
    if not scene.roomy:
        return
    # Rerun writes a label across its point, so the visible ones belong to invisibly small points below the nodes.
    names: dict[str, Any] = {
        "colors": [style.LABEL],
        "radii": [0.0],
        "labels": [f"{name} (sink)" if sink else name for name, sink in zip(scene.nodes.name, sinks, strict=True)],
        "show_labels": True,
        "draw_order": style.ORDER["nodes"],
    }
    yield from _points("/map/nodes/labels", scene, pace, rows, np.array([0.0, LABEL_DROP * scene.radius_m]), names)


def _points(
    path: str, scene: Scene, pace: Pace, rows: NDArray[np.int64], offset: NDArray[np.float64], look: dict[str, Any]
) -> Iterator[Chunk]:
    """Points that stand at these rows of the node table, a little aside, wherever those go."""
    motion = scene.motion
    if motion.is_still:
        yield static(path, rr.Points2D.from_fields(positions=motion.start[rows] + offset, **look))
        return
    yield static(path, rr.Points2D.from_fields(**look))
    instants = motion.instants(pace, _MOST_POINTS // len(rows))
    positions = np.concatenate([motion.snapshot(int(time_ns))[rows] + offset for time_ns in instants])
    yield timed(path, instants, rr.Points2D.columns(positions=positions).partition([len(rows)] * len(instants)))


def _trail_chunks(scene: Scene) -> Iterator[Chunk]:
    """The whole way of each node that moves."""
    moves = scene.motion.moves
    moving = np.flatnonzero(scene.motion.moving)
    ways = [np.concatenate([scene.place[row][None], moves.place[moves.row == row]]) for row in moving]
    if ways:
        yield static(
            "/map/ways", rr.LineStrips2D(ways, colors=[style.WAY], radii=[-0.8], draw_order=style.ORDER["ways"])
        )


def _model_chunks(scene: Scene, model: VariablePlacement, pace: Pace) -> Iterator[Chunk]:
    """Variables around their hosts, and the edges between them."""
    host, offset = _variable_places(scene, model)
    row = {int(variable): index for index, variable in enumerate(model.variable)}
    pairs = [(row[int(a)], row[int(b)]) for a, b in zip(model.edge_a, model.edge_b, strict=True)]
    order = style.ORDER["model"]
    if pairs:
        yield from _edges(scene, pace, host, offset, np.array(pairs))
    look: dict[str, Any] = {
        "colors": [style.VARIABLE],
        "radii": [0.2 * scene.radius_m],
        "labels": list(model.name),
        "show_labels": False,
        "draw_order": order + 1,
    }
    yield from _points("/map/model/variables", scene, pace, host, offset, look)


def _edges(
    scene: Scene, pace: Pace, host: NDArray[np.int64], offset: NDArray[np.float64], pairs: NDArray[np.int64]
) -> Iterator[Chunk]:
    path, motion = "/map/model/edges", scene.motion
    look: dict[str, Any] = {"colors": [style.MODEL], "radii": [-0.5], "draw_order": style.ORDER["model"]}
    if motion.is_still:
        yield static(path, rr.LineStrips2D.from_fields(strips=list((motion.start[host] + offset)[pairs]), **look))
        return
    yield static(path, rr.LineStrips2D.from_fields(**look))
    instants = motion.instants(pace, max(1, _MOST_LINES // len(pairs)))
    strips = [strip for time_ns in instants for strip in (motion.snapshot(int(time_ns))[host] + offset)[pairs]]
    yield timed(path, instants, rr.LineStrips2D.columns(strips=strips).partition([len(pairs)] * len(instants)))


def _variable_places(scene: Scene, model: VariablePlacement) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Row of each variable's host, and how far from it the variable stands: those of one host form a ring."""
    host = scene.rows(np.asarray(model.host))
    turn = np.zeros(len(host))
    for node in np.unique(host):
        mine = np.flatnonzero(host == node)
        turn[mine] = np.arange(len(mine)) / len(mine)
    angle = 2 * np.pi * turn + np.pi / 4
    return host, _VARIABLE_OFFSET * scene.radius_m * np.column_stack([np.cos(angle), -np.sin(angle)])
