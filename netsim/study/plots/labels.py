"""Names beside points, so that none lies on another name or on a point."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from netsim.study.plots.style import INK

GAP_PT = 6.0
PLACES = ((1, 1), (-1, 1), (1, -1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
"""Directions in which a name may lie from its point, best first."""
RADII = (1.0, 2.2, 3.4)
SAME_PX = 4.0
"""Points no further apart share a name."""
ALIGN_X = {1: "left", 0: "center", -1: "right"}
ALIGN_Y = {1: "bottom", 0: "center", -1: "top"}


@dataclass(frozen=True, slots=True)
class Mark:
    """A point of a panel with its bars, and its name if it is to have one; in data coordinates.

    Attributes:
        x: Where it is.
        y: Likewise.
        half_x: Half the length of its horizontal bar.
        half_y: Half the length of its vertical bar.
        name: What to write beside it; empty for nothing.
    """

    x: float
    y: float
    half_x: float = 0.0
    half_y: float = 0.0
    name: str = ""


def label_points(axis: Any, marks: Sequence[Mark]) -> None:
    """Write names beside points of a panel; the layout of the figure must be settled."""
    figure: Figure = axis.figure
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    taken = [box for mark in marks for box in _boxes(axis, mark)]
    frame = axis.get_window_extent(renderer)
    for mark in _together(axis, marks):
        if mark.name:
            text = axis.annotate(mark.name, (mark.x, mark.y), xytext=(0, 0), textcoords="offset points", fontsize=8,
                                 color=INK, zorder=9)  # fmt: skip
            text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
            taken.append(_place(text, renderer, taken, frame))


def _together(axis: Any, marks: Sequence[Mark]) -> list[Mark]:
    """The marks with a name, those at one place with their names on one mark, a line each."""
    groups: list[list[Mark]] = []
    for mark in (each for each in marks if each.name):
        here = axis.transData.transform((mark.x, mark.y))
        for group in groups:
            if np.hypot(*(axis.transData.transform((group[0].x, group[0].y)) - here)) <= SAME_PX:
                group.append(mark)
                break
        else:
            groups.append([mark])
    return [replace(group[0], name="\n".join(mark.name for mark in group)) for group in groups]


def _boxes(axis: Any, mark: Mark) -> list[Bbox]:
    """What a point and its bars cover, in pixels."""
    low_x = mark.x - mark.half_x if axis.get_xscale() == "linear" else max(mark.x - mark.half_x, mark.x * 1e-3)
    ends = [
        (low_x, mark.y),
        (mark.x + mark.half_x, mark.y),
        (mark.x, mark.y - mark.half_y),
        (mark.x, mark.y + mark.half_y),
    ]
    (left, y), (right, _), (x, below), (_, above) = axis.transData.transform(np.asarray(ends, dtype=float))
    return [
        Bbox.from_extents(x - 6, y - 6, x + 6, y + 6),
        Bbox.from_extents(left, y - 2, right, y + 2),
        Bbox.from_extents(x - 2, below, x + 2, above),
    ]


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
    return float(max(0.0, width) * max(0.0, height))


def _outside(box: Bbox, frame: Bbox) -> float:
    inside = _overlap(box, frame)
    return float(max(0.0, box.width * box.height - inside))
