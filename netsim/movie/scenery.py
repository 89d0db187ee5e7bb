"""What stays in a picture: field, scale, links, the kinds of sensors, title."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from netsim.movie.cast import Cast
from netsim.movie.layout import Layout
from netsim.movie.look import Look
from netsim.movie.options import Reel
from netsim.replay import style
from netsim.replay.options import nice

_SENSOR_RIM = 1.5  # node radii
_SCALE_SHARE = 0.25  # of the map's width, at most


def draw_scenery(axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
    """Draw what is under everything else on the map."""
    if cast.field is not None:
        low = np.array([cast.field.x_m, cast.field.y_m])
        size = np.array([cast.field.width_m, cast.field.height_m])
        corners = layout.px(low + size * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))
        axes.add_collection(PolyCollection([corners], facecolors="none", edgecolors=[look.field], linewidths=1.0))
    pairs, prr = cast.lines()
    if len(pairs):
        segments = list(layout.px(cast.motion.start)[pairs])
        axes.add_collection(LineCollection(segments, colors=look.links(prr), linewidths=0.09 * layout.font_px))
    if cast.motion.is_still:
        _draw_sensors(axes, layout, cast)
    _draw_scale(axes, layout, look)


def draw_title(axes: Axes, layout: Layout, look: Look, title: str, reel: Reel) -> None:
    """The name of the scenario and the pace; the time itself is drawn anew in each picture."""
    font = layout.font_px
    name = axes.text(
        font, layout.head_y, title, size=1.35 * font, color=look.ink, weight="bold", va="center_baseline"
    )  # fmt: skip
    x = name.get_window_extent().x1 + 1.1 * font
    axes.text(x, layout.head_y, pace_text(reel.speed), size=0.92 * font, color=look.soft, va="center_baseline")


def pace_text(speed: float) -> str:
    """How fast a movie runs: `2.1 times real time`, `1/20 of real time`."""
    if 0.995 <= speed < 1.005:
        return "real time"
    if speed > 1.0:
        return f"{speed:.3g} times real time"
    slow = 1.0 / speed
    return f"1/{round(slow)} of real time" if slow > 9.5 else f"{speed:.2g} of real time"


def _draw_sensors(axes: Axes, layout: Layout, cast: Cast) -> None:
    for kind, colour in style.SENSOR_COLOURS.items():
        rows = cast.rows(np.array([node for node, what in cast.measures.items() if what == kind], np.int64))
        places = layout.px(cast.motion.start[rows[rows >= 0]])
        diameter = 2 * _SENSOR_RIM * cast.radius_m * layout.px_per_m
        axes.scatter(*places.T, s=diameter**2, c=[tuple(part / 255 for part in colour)], linewidths=0)


def _draw_scale(axes: Axes, layout: Layout, look: Look) -> None:
    """A bar of a round length in the lower left corner, outside the field."""
    box, font = layout.field, layout.font_px
    length_m = nice(_SCALE_SHARE * box.width / layout.px_per_m)
    length = length_m * layout.px_per_m
    x, y = box.left, box.low - 0.15 * font
    bar = [[(x, y + 0.3 * font), (x, y), (x + length, y), (x + length, y + 0.3 * font)]]
    axes.add_collection(LineCollection(bar, colors=[look.soft], linewidths=1.0))
    axes.text(x + length + 0.5 * font, y, f"{length_m:g} m", size=0.85 * font, color=look.soft, va="center_baseline")
