"""Draws the pictures of a movie one by one, in any order: what stays is drawn once, what moves on a copy of it."""

import math
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from netsim.movie.actors import make_actors
from netsim.movie.cast import Cast
from netsim.movie.ink import Drawn
from netsim.movie.layout import Layout, lay_out
from netsim.movie.legend import draw_legend, entries
from netsim.movie.look import DARK, LIGHT, RC, Look
from netsim.movie.messages import Messages
from netsim.movie.scenery import draw_scenery, draw_title
from netsim.movie.story import Story
from netsim.movie.strip import Strip

_DPI = 72.0  # so that a point is a pixel

Pixels = NDArray[np.uint8]
"""Red, green, blue; shape (height, width, 3), the first row at the top."""


class Painter:
    """The pictures of a story.

    Args:
        story: What happens.
        cast: Who takes part.
        title: The name of the scenario.
        width_px: Width of a picture.
        light: Whether the ground is light.
    """

    def __init__(self, story: Story, cast: Cast, title: str, width_px: int, *, light: bool) -> None:
        self._story = story
        self._look: Look = LIGHT if light else DARK
        legend = entries(story, cast, self._look)
        self.layout: Layout = lay_out(cast, width_px, len(legend))
        with mpl.rc_context():
            mpl.rcdefaults()
            mpl.rcParams.update(dict[Any, Any](RC))
            self._canvas, self._axes = _blank(self.layout, self._look)
            draw_scenery(self._axes, self.layout, self._look, cast)
            draw_title(self._axes, self.layout, self._look, title, story.reel)
            draw_legend(self._axes, self.layout, self._look, legend)
            self._strip = Strip(self._axes, self.layout, self._look, story)
            self._below, self._above = make_actors(self._axes, self.layout, self._look, cast)
            self._messages = Messages(self.layout, self._look, cast, story)
            self._clock = self._make_clock()
            self._bright = self._still(is_dim=False)
            self._still(is_dim=True)
            self._ground = self._canvas.copy_from_bbox(self._canvas.figure.bbox)

    def paint(self, picture: int) -> Pixels:
        """The picture of a number."""
        moment = self._story.moments[picture]
        self._canvas.restore_region(self._ground)
        renderer = self._canvas.get_renderer()
        self._clock.set_text(self._time_text(moment.time_ns))
        artists: list[Drawn] = [artist for actor in self._below for artist in actor.show(moment)]
        artists += self._messages.show(picture)
        artists += [artist for actor in self._above for artist in actor.show(moment)]
        for artist in (*artists, self._clock):
            artist.draw(renderer)
        pixels = self._copy()
        self._draw_cursor(pixels, moment.time_ns)
        return pixels

    def _draw_cursor(self, pixels: Pixels, time_ns: int) -> None:
        """Brighten the strip up to now, and a line there."""
        box = self.layout.strip
        top, bottom = (round(self.layout.height_px - y) for y in (box.high, box.low))
        left, now = round(box.left), round(self._strip.x(time_ns))
        pixels[top:bottom, left:now] = self._bright[top:bottom, left:now]
        width = max(1, round(0.12 * self.layout.font_px))
        begin = min(max(now - width // 2, left), round(box.right) - width)
        pixels[top - 2 : bottom + 2, begin : begin + width] = [round(255 * part) for part in self._look.ink[:3]]

    def _still(self, *, is_dim: bool) -> Pixels:
        self._strip.dim(is_dim)
        self._canvas.draw()
        return self._copy()

    def _copy(self) -> Pixels:
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def _make_clock(self) -> Text:
        layout, look = self.layout, self._look
        at = (layout.width_px - layout.font_px, layout.head_y)
        style: dict[str, Any] = {
            "size": 1.35 * layout.font_px,
            "color": look.ink,
            "ha": "right",
            "va": "center_baseline",
        }
        return self._axes.text(*at, "", animated=True, **style)

    def _time_text(self, time_ns: int) -> str:
        """As many digits as change from picture to picture."""
        digits = min(9, max(0, math.ceil(-math.log10(self._story.reel.step_ns / 1e9) - 1e-9)))
        return f"{time_ns / 1e9:.{digits}f} s"


def _blank(layout: Layout, look: Look) -> tuple[Any, Axes]:
    """The canvas of a figure with one invisible frame, in which a unit is a pixel."""
    figure = Figure(figsize=(layout.width_px / _DPI, layout.height_px / _DPI), dpi=_DPI, facecolor=look.ground)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_autoscale_on(False)
    axes.set_xlim(0.0, layout.width_px)
    axes.set_ylim(0.0, layout.height_px)
    return FigureCanvasAgg(figure), axes
