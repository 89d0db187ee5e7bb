"""Many lines or areas of one colour drawn as one path: far quicker than a path each."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform

from netsim.movie.cast import Places
from netsim.movie.look import Colour

Outlines = Sequence[Places] | Places
"""Each of shape (n, 2), in pixels; as one array where all have as many corners."""
_AT_ONCE = 400  # outlines a path: Agg refuses paths that are too long


class Drawn(Protocol):
    """What draws itself: artists of matplotlib, and the classes below."""

    def draw(self, renderer: Any) -> None:
        """Draw it."""
        ...


class Strokes:
    """Lines of one colour and width.

    Args:
        colour: Of the lines.
        width_px: Of the lines.
        cap: How they end: `round` or `butt`.
    """

    def __init__(self, colour: Colour, width_px: float, cap: str = "round") -> None:
        self._colour, self._width_px, self._cap = colour, width_px, cap
        self._outlines: Outlines = ()

    def having(self, outlines: Outlines) -> "Strokes":
        """These lines from now on, each of shape (n, 2), in pixels."""
        self._outlines = outlines
        return self

    def draw(self, renderer: Any) -> None:
        """Draw them."""
        context = renderer.new_gc()
        context.set_foreground(self._colour, isRGBA=True)
        context.set_linewidth(self._width_px)
        context.set_capstyle(self._cap)
        context.set_joinstyle("round")
        for path in _paths(self._outlines):
            renderer.draw_path(context, path, IdentityTransform())
        context.restore()


class Areas:
    """Filled outlines of one colour."""

    def __init__(self, colour: Colour) -> None:
        self._colour = colour
        self._outlines: Outlines = ()

    def having(self, outlines: Outlines) -> "Areas":
        """These outlines from now on, each of shape (n, 2), in pixels."""
        self._outlines = outlines
        return self

    def draw(self, renderer: Any) -> None:
        """Draw them."""
        context = renderer.new_gc()
        context.set_foreground(self._colour, isRGBA=True)
        context.set_linewidth(0.0)
        for path in _paths(self._outlines):
            renderer.draw_path(context, path, IdentityTransform(), self._colour)
        context.restore()


def dots(axes: Axes) -> Any:
    """An empty collection of discs to be filled, not drawn with the rest."""
    return axes.scatter([], [], animated=True, linewidths=0)


def _paths(outlines: Outlines) -> list[Path]:
    return [_path(outlines[first : first + _AT_ONCE]) for first in range(0, len(outlines), _AT_ONCE)]


def _path(outlines: Outlines) -> Path:
    if isinstance(outlines, np.ndarray):
        count, corners, _ = outlines.shape
        vertices, begins = outlines.reshape(-1, 2), np.arange(count) * corners
    else:
        vertices = np.concatenate(outlines)
        begins = np.cumsum([0, *(len(outline) for outline in outlines[:-1])])
    codes = np.full(len(vertices), Path.LINETO, Path.code_type)
    codes[begins] = Path.MOVETO
    return Path(vertices, codes)
