"""The strip of messages per second by kind: bright up to the cursor, dim beyond."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.ticker import MaxNLocator

from netsim.movie.layout import Layout
from netsim.movie.look import Colour, Look
from netsim.movie.story import Story

_DIM = 0.34
_HEADROOM = 1.08


class Strip:
    """Bars stacked by kind in a box; `dim` before the movie is drawn to tell which parts are faint."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, story: Story) -> None:
        self._box, self._font = layout.strip, layout.font_px
        self._look, self._story = look, story
        self._most = _HEADROOM * float(story.rates.sum(axis=0).max(initial=0.0)) or 1.0
        self._draw_frame(axes)
        self._bars = [self._bar(number) for number in range(len(story.kinds))]
        for bars in self._bars:
            axes.add_collection(bars)

    def dim(self, is_dim: bool) -> None:
        """Have the bars dim, or bright."""
        for number, bars in enumerate(self._bars):
            colour = self._look.kind(self._story.places[number])
            bars.set_facecolor(_mixed(colour, self._look.strip, _DIM) if is_dim else colour)

    def x(self, time_ns: int) -> float:
        """Where an instant is, in pixels."""
        reel = self._story.reel
        return self._box.left + self._box.width * (time_ns - reel.start_ns) / max(1, reel.end_ns - reel.start_ns)

    def _bar(self, number: int) -> PolyCollection:
        """The bars of a kind on those of the kinds before it, as rectangles that touch."""
        rates, reel, box = self._story.rates, self._story.reel, self._box
        low = rates[:number].sum(axis=0)
        used = np.flatnonzero(rates[number] > 0.0)
        edges = np.array([self.x(reel.start_ns + slot * reel.bin_ns) for slot in range(rates.shape[1] + 1)])
        edges = np.minimum(edges, box.right)
        gap = min(1.0, 0.15 * float(edges[1] - edges[0]))
        scale = box.height / self._most
        lower, upper = box.low + scale * low[used], box.low + scale * (low + rates[number])[used]
        left, right = edges[used], np.maximum(edges[used + 1] - gap, edges[used] + 0.5)
        corners = [(left, lower), (right, lower), (right, upper), (left, upper)]
        outlines = np.stack([np.column_stack(corner) for corner in corners], axis=1)
        colour = self._look.kind(self._story.places[number])
        return PolyCollection(list(outlines), facecolors=[colour], edgecolors="none", antialiased=True)

    def _draw_frame(self, axes: Axes) -> None:
        box, font, look = self._box, self._font, self._look
        corners = [(box.left, box.low), (box.right, box.low), (box.right, box.high), (box.left, box.high)]
        axes.add_collection(PolyCollection([corners], facecolors=[look.strip], edgecolors="none"))
        axes.text(
            box.left, box.high + 0.35 * font, "messages per second", size=0.85 * font, color=look.soft, va="bottom"
        )
        reel = self._story.reel
        for time_s in _ticks(reel.start_ns / 1e9, reel.end_ns / 1e9, max(2, int(box.width / (7 * font)))):
            x = self.x(round(time_s * 1e9))
            label = f"{time_s:g} s"
            side = "right" if x > box.right - font else "center"
            axes.text(x, box.low - 0.35 * font, label, size=0.85 * font, color=look.soft, va="top", ha=side)
        for rate in _ticks(0.0, self._most, 2)[1:]:
            y = box.low + box.height * rate / self._most
            line = LineCollection([[(box.left, y), (box.right, y)]], colors=[look.field], linewidths=0.6)
            axes.add_collection(line)
            axes.text(
                box.left - 0.4 * font, y, f"{rate:g}", size=0.85 * font, color=look.soft, va="center", ha="right"
            )  # fmt: skip


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers inside a range."""
    ticks = MaxNLocator(nbins=most, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [float(tick) for tick in ticks if low - 1e-9 <= tick <= high + 1e-9 and math.isfinite(tick)]


def _mixed(colour: Colour, ground: Colour, share: float) -> Colour:
    red, green, blue = (share * a + (1 - share) * b for a, b in zip(colour[:3], ground[:3], strict=True))
    return red, green, blue, 1.0
