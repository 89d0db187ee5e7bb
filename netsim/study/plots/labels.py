"""Names beside points: none lies on another name or on a point, and none is nearer to another point than to its own.

A name has the colour of its point; one that had to go further away is joined to it by a line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from netsim.study.plots.style import INK, legible

GAP_PT = 6.0
PLACES = (
    *((1, 1, 1), (-1, 1, -1), (1, -1, 1), (-1, -1, -1)),
    *((1, 0, 1), (-1, 0, -1), (0, 1, 0), (0, -1, 0)),
    *((0, 1, 1), (0, 1, -1), (0, -1, 1), (0, -1, -1)),
    *((-0.5, 1, 1), (0.5, 1, -1), (-0.5, -1, 1), (0.5, -1, -1)),
)
"""Where a name may lie, best first: a direction from its point, and to which side it runs from there."""
Place = tuple[float, int, int]
RADII = (1.0, 2.2, 3.4, 5.0)
STRAY_PX = 1.5
"""By so much at least a name is nearer to its own point than to any other."""
NAME_WEIGHT = 10.0
"""Covering another name is so much worse than covering a point or a bar."""
STRAYED = 1e5
"""What it costs a name to be nearer by less, a pixel, in square pixels of overlap: more than any name covers."""
NEAR_PT = 1.5 * GAP_PT
"""A name further away is joined to its point by a line."""
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
        name: What to write beside it; empty for nothing.
        colour: Of the point.
        bar_x: Where its horizontal bar begins and ends; None without one.
        bar_y: Likewise, its vertical one.
    """

    x: float
    y: float
    name: str = ""
    colour: str = INK
    bar_x: tuple[float, float] | None = None
    bar_y: tuple[float, float] | None = None

    @property
    def ends_x(self) -> tuple[float, float]:
        """The ends of its horizontal bar; the point itself without one."""
        return self.bar_x or (self.x, self.x)

    @property
    def ends_y(self) -> tuple[float, float]:
        """Likewise, of its vertical one."""
        return self.bar_y or (self.y, self.y)


@dataclass(frozen=True, slots=True)
class Panel:
    """What names must keep clear of, in pixels.

    Attributes:
        taken: Boxes of points and bars.
        names: Boxes of the names written already.
        points: (N, 2) where the points are.
        frame: Within which names stay.
    """

    taken: list[Bbox]
    names: list[Bbox]
    points: Any
    frame: Bbox


def label_points(axis: Any, marks: Sequence[Mark]) -> None:
    """Write names beside points of a panel; the layout of the figure must be settled."""
    figure: Figure = axis.figure
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    taken = [box for mark in marks for box in _boxes(axis, mark)]
    points = np.asarray([_pixels(axis, mark) for mark in marks], dtype=float).reshape(-1, 2)
    panel = Panel(taken, [], points, axis.get_window_extent(renderer))
    for mark in sorted(_together(axis, marks), key=lambda mark: _room(panel, _pixels(axis, mark))):
        text = axis.annotate(mark.name, (mark.x, mark.y), xytext=(0, 0), textcoords="offset points", fontsize=8,
                             color=legible(mark.colour), zorder=9)  # fmt: skip
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
        box = _place(text, renderer, panel, _pixels(axis, mark))
        panel.names.append(box)
        _join(axis, mark, box)


def _room(panel: Panel, own: Any) -> float:
    """How far the next point is: where there is least room, a name is written first."""
    apart = np.hypot(*(panel.points - own).T)
    return float(np.min(apart[apart > SAME_PX], initial=np.inf))


def _pixels(axis: Any, mark: Mark) -> Any:
    return axis.transData.transform((mark.x, mark.y))


def _together(axis: Any, marks: Sequence[Mark]) -> list[Mark]:
    """The marks with a name, those at one place with their names on one mark, a line each."""
    groups: list[list[Mark]] = []
    for mark in (each for each in marks if each.name):
        here = _pixels(axis, mark)
        for group in groups:
            if np.hypot(*(_pixels(axis, group[0]) - here)) <= SAME_PX:
                group.append(mark)
                break
        else:
            groups.append([mark])
    return [
        replace(
            group[0],
            name="\n".join(mark.name for mark in group),
            colour=group[0].colour if len({mark.colour for mark in group}) == 1 else INK,
        )
        for group in groups
    ]


def _boxes(axis: Any, mark: Mark) -> list[Bbox]:
    """What a point and its bars cover, in pixels."""
    (low_x, high_x), (low_y, high_y) = mark.ends_x, mark.ends_y
    if axis.get_xscale() == "log":
        low_x = max(low_x, mark.x * 1e-3)
    ends = [(low_x, mark.y), (high_x, mark.y), (mark.x, low_y), (mark.x, high_y)]
    (left, y), (right, _), (x, below), (_, above) = axis.transData.transform(np.asarray(ends, dtype=float))
    return [
        Bbox.from_extents(x - 6, y - 6, x + 6, y + 6),
        Bbox.from_extents(left, y - 2, right, y + 2),
        Bbox.from_extents(x - 2, below, x + 2, above),
    ]


def _place(text: Any, renderer: Any, panel: Panel, own: Any) -> Bbox:
    """Move a name to where it covers least and is nearest to its own point; its box."""
    apart = np.hypot(*(panel.points - own).T)
    others = panel.points[apart > SAME_PX]
    best: tuple[float, float, Place, Bbox] = (np.inf, RADII[0], PLACES[0], Bbox.null())
    for radius, place in product(RADII, PLACES):
        _move(text, place, radius)
        box = text.get_window_extent(renderer)
        cost = sum(_overlap(box, other) for other in panel.taken) + 3.0 * _outside(box, panel.frame)
        cost += NAME_WEIGHT * sum(_overlap(box, other) for other in panel.names)
        nearest = np.min(_distances(box, others), initial=np.inf)
        cost += STRAYED * max(0.0, float(_distances(box, own[None])[0] + STRAY_PX - nearest))
        if cost < best[0] - 1e-9:
            best = (cost, radius, place, box)
        if cost == 0.0:
            break
    _, radius, place, box = best
    _move(text, place, radius)
    return box


def _distances(box: Bbox, points: Any) -> Any:
    """(N,) how far points lie from a box; 0 within."""
    x, y = points.T
    return np.hypot(
        np.maximum(np.maximum(box.x0 - x, x - box.x1), 0.0), np.maximum(np.maximum(box.y0 - y, y - box.y1), 0.0)
    )


def _join(axis: Any, mark: Mark, box: Bbox) -> None:
    """A line from a point to its name, unless that is right beside it."""
    x, y = _pixels(axis, mark)
    end = min(max(x, box.x0), box.x1), min(max(y, box.y0), box.y1)
    if np.hypot(end[0] - x, end[1] - y) > NEAR_PT * axis.figure.dpi / 72:
        (x0, y0), (x1, y1) = (mark.x, mark.y), axis.transData.inverted().transform(end)
        axis.add_artist(Line2D([x0, x1], [y0, y1], color=legible(mark.colour), lw=0.7, zorder=4))


def _move(text: Any, place: Place, radius: float) -> None:
    x, y, side = place
    text.set_horizontalalignment(ALIGN_X[side])
    text.set_verticalalignment(ALIGN_Y[y])
    text.set_position((x * GAP_PT * radius, y * GAP_PT * radius))


def _overlap(one: Bbox, other: Bbox) -> float:
    width = min(one.x1, other.x1) - max(one.x0, other.x0)
    height = min(one.y1, other.y1) - max(one.y0, other.y0)
    return float(max(0.0, width) * max(0.0, height))


def _outside(box: Bbox, frame: Bbox) -> float:
    inside = _overlap(box, frame)
    return float(max(0.0, box.width * box.height - inside))
