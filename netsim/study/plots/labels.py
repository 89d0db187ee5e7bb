"""Names beside points, so that none lies on another name or on a point."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from netsim.study.plots.style import INK

GAP_PT = 6.0
PLACES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""Directions in which a name may lie from its point, best first."""
RADII = (1.0, 2.2, 3.6)
ALIGN_X = {1: "left", 0: "center", -1: "right"}
ALIGN_Y = {1: "bottom", 0: "center", -1: "top"}


def label_points(axis: Any, names: Sequence[tuple[float, float, str]], obstacles: Sequence[tuple[float, float]]) -> None:
    """Write names beside points of a panel; the layout of the figure must be settled.

    Args:
        axis: The panel.
        names: x, y and name of each point, in data coordinates.
        obstacles: All points of the panel.
    """
    figure: Figure = axis.figure
    renderer = FigureCanvasAgg(figure).get_renderer()
    points = axis.transData.transform(np.asarray(obstacles, dtype=float))
    taken: list[Bbox] = [Bbox.from_bounds(x - 5, y - 5, 10, 10) for x, y in points]
    frame = axis.get_window_extent(renderer)
    for x, y, name in names:
        text = axis.annotate(name, (x, y), xytext=(0, 0), textcoords="offset points", fontsize=8, color=INK, zorder=9)
        taken.append(_place(text, renderer, taken, frame))


def _place(text: Any, renderer: Any, taken: Sequence[Bbox], frame: Bbox) -> Bbox:
    """Move a name to where it covers least; its box."""
    best: tuple[float, int, Bbox] | None = None
    options = [(radius, place) for radius in RADII for place in PLACES]
    for number, (radius, place) in enumerate(options):
        _move(text, place, radius)
        box = text.get_window_extent(renderer)
        cost = sum(_overlap(box, other) for other in taken) + 3.0 * _outside(box, frame)
        if best is None or cost < best[0] - 1e-9:
            best = (cost, number, box)
        if cost == 0.0:
            break
    _, number, box = best or (0.0, 0, text.get_window_extent(renderer))
    radius, place = options[number]
    _move(text, place, radius)
    return box


def _move(text: Any, place: tuple[int, int], radius: float) -> None:
    text.set_horizontalalignment(ALIGN_X[place[0]])
    text.set_verticalalignment(ALIGN_Y[place[1]])
    text.set_position((place[0] * GAP_PT * radius, place[1] * GAP_PT * radius))


def _overlap(one: Bbox, other: Bbox) -> float:
    width = min(one.x1, other.x1) - max(one.x0, other.x0)
    height = min(one.y1, other.y1) - max(one.y0, other.y0)
    return max(0.0, width) * max(0.0, height)


def _outside(box: Bbox, frame: Bbox) -> float:
    inside = _overlap(box, frame)
    return float(max(0.0, box.width * box.height - inside))
