"""What stays in a picture: field, scale, links, the kinds of sensors, title."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.text import Text

from netsim.movie.cast import Cast
from netsim.movie.layout import Layout
from netsim.movie.look import Colour, Look
from netsim.movie.options import Reel
from netsim.replay import style
from netsim.replay.options import nice

_CLOCK_FONTS = 22.0  # beside the title for pace and time
NAME_DROP = 1.6
"""Node radii from a node to its name."""
_MOST_NAMES = 64
_RADII_APART = 8.0  # node radii between neighbours
_RADIUS_FONTS = (0.22, 0.95)  # least and greatest radius of a node, in heights of the font
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
    _draw_sensors(axes, layout, cast)
    if cast.motion.is_still:
        draw_names(axes, layout, look, cast)
    _draw_scale(axes, layout, look)


def draw_title(axes: Axes, layout: Layout, look: Look, title: str, reel: Reel) -> None:
    """The name of the scenario and the pace; the time itself is drawn anew in each picture."""
    font = layout.font_px
    name = axes.text(
        font, layout.head_y, title, size=1.35 * font, color=look.ink, weight="bold", va="center_baseline"
    )  # fmt: skip
    shorten(name, layout.width_px - _CLOCK_FONTS * font)
    x = name.get_window_extent().x1 + 1.1 * font
    axes.text(x, layout.head_y, pace_text(reel.speed), size=0.92 * font, color=look.soft, va="center_baseline")


def shorten(text: Text, room_px: float) -> None:
    """End a text that is too wide in an ellipsis."""
    words = text.get_text()
    while words and text.get_window_extent().width > room_px:
        words = words[:-1]
        text.set_text(f"{words.rstrip()}…")


def pace_text(speed: float) -> str:
    """How fast a movie runs: `2.1 times real time`, `1/20 of real time`."""
    if 0.995 <= speed < 1.005:
        return "real time"
    if speed > 1.0:
        return f"{speed:.2g} times real time" if speed < 10.0 else f"{speed:.0f} times real time"
    slow = 1.0 / speed
    return f"1/{round(slow)} of real time" if slow > 9.5 else f"{speed:.2g} of real time"


def node_radius_px(layout: Layout, cast: Cast) -> float:
    """Radius of a node in pixels."""
    least, most = _RADIUS_FONTS
    return float(np.clip(cast.radius_m * layout.px_per_m, least * layout.font_px, most * layout.font_px))


def draw_names(axes: Axes, layout: Layout, look: Look, cast: Cast) -> list[Text]:
    """The nodes' names below them, if there is room."""
    size, radius = 0.8 * layout.font_px, node_radius_px(layout, cast)
    apart = _RADII_APART * cast.radius_m * layout.px_per_m
    longest = max(len(name) for name in cast.nodes.name)
    if cast.size > _MOST_NAMES or apart < (0.62 * longest + 1.0) * size:
        return []
    named: dict[str, Any] = {"size": size, "color": look.soft, "ha": "center", "va": "top"}
    places = layout.px(cast.motion.start)
    return [
        axes.text(x, y - NAME_DROP * radius, name, **named)
        for name, (x, y) in zip(cast.nodes.name, places, strict=True)
    ]


def sensor_kinds(cast: Cast) -> list[str]:
    """What sensors measure, where they do not move."""
    return [kind for kind in style.SENSOR_COLOURS if cast.motion.is_still and kind in cast.measures.values()]


def sensor_colour(kind: str) -> Colour:
    """The colour of the rim of sensors that measure this."""
    red, green, blue, _ = style.SENSOR_COLOURS[kind]
    return red / 255, green / 255, blue / 255, 1.0


def _draw_sensors(axes: Axes, layout: Layout, cast: Cast) -> None:
    for kind in sensor_kinds(cast):
        rows = cast.rows(np.array([node for node, what in cast.measures.items() if what == kind], np.int64))
        places = layout.px(cast.motion.start[rows[rows >= 0]])
        diameter = 2 * _SENSOR_RIM * node_radius_px(layout, cast)
        axes.scatter(places[:, 0], places[:, 1], s=diameter**2, color=[sensor_colour(kind)], linewidths=0)


def _draw_scale(axes: Axes, layout: Layout, look: Look) -> None:
    """A bar of a round length below the lower right corner."""
    box, font = layout.field, layout.font_px
    length_m = nice(_SCALE_SHARE * box.width / layout.px_per_m)
    length = length_m * layout.px_per_m
    x, y = box.right, box.low - 0.75 * font
    bar = [[(x - length, y + 0.3 * font), (x - length, y), (x, y), (x, y + 0.3 * font)]]
    axes.add_collection(LineCollection(bar, colors=[look.soft], linewidths=1.0))
    text: dict[str, Any] = {"size": 0.85 * font, "color": look.soft, "ha": "right", "va": "center_baseline"}
    axes.text(x - length - 0.5 * font, y, f"{length_m:g} m", **text)
