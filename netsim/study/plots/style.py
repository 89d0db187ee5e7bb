"""How plots look: fonts, colours, markers; and how a figure becomes a file, the same bytes each time."""

import io
import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.layout_engine import PlaceHolderLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from netsim.study.info import AxisInfo
from netsim.study.levels import label_of
from netsim.study.reporting.names import is_ordered
from netsim.study.reporting.numbers import MINUS

PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A4FBF", "#4D4D4D")
"""Told apart by most colour-blind eyes (after Okabe and Ito 2008)."""
STACK = (*PALETTE, "#A6761D", "#B7C94B", "#F0A6A0", "#9AA5B1")
MARKERS = "osD^vPX*<>"
INK, SOFT, GRID = "#1c2430", "#5a6675", "#dde2e8"
WIDTH_IN = 9.0
"""Width of a plot across the page."""
LEGEND_LETTERS = 44
"""Of an entry of a legend: longer ones are cut, and seen to be."""
MOST_ROOM = 1.0
"""Beyond the outermost means a panel shows intervals as far as this, in ranges of the means: these fill a third of it."""

RC: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": SOFT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "svg.hashsalt": "netsim",
    "svg.fonttype": "path",
    "figure.dpi": 144,  # as saved: letters are not equally wide at another, and those at the edge would be cut
    "savefig.dpi": 144,
}
"""Settings of matplotlib while a plot is drawn or written."""


@dataclass(frozen=True)
class Plot:
    """A figure with its file's stem, what it shows, and the same in words for those who cannot see it."""

    stem: str
    figure: Figure
    caption: str
    alt: str


@contextmanager
def styled() -> Iterator[None]:
    """Matplotlib with these settings and otherwise its own, whatever the user's are; afterwards as it was."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(dict[Any, Any](RC))
        yield


def settle(figure: Figure) -> None:
    """Lay a figure out once and for all, instead of anew for each file; what is drawn from then on moves nothing."""
    if isinstance(figure.get_layout_engine(), PlaceHolderLayoutEngine):
        return
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def render(figure: Figure, kind: str) -> bytes:
    """A figure as PNG or SVG, without a date in it."""
    stream = io.BytesIO()
    metadata = {"Date": None, "Creator": "netsim"} if kind == "svg" else {"Software": "netsim"}
    with styled():
        figure.savefig(stream, format=kind, metadata=metadata)
    return stream.getvalue()


def panels(
    rows: int, columns: int, height_in: float, *, width_in: float = WIDTH_IN, **kwargs: Any
) -> tuple[Figure, Any]:
    """A figure with a grid of axes, and these as a two-dimensional array.

    Args:
        rows: Of panels.
        columns: Of panels.
        height_in: Of the whole figure.
        width_in: Likewise.
        kwargs: For `Figure.subplots`.
    """
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **kwargs)


def colours_of(axis: AxisInfo | None) -> dict[str, Any]:
    """A colour for each level of an axis, by its label, the same in all plots: in order of hue for numbers."""
    levels = [] if axis is None else [label_of(level) for level in axis.levels]
    if axis is not None and is_ordered(axis):
        ramp = mpl.colormaps["viridis"]
        place = {label: 0.88 * index / (len(levels) - 1) for index, label in enumerate(levels)}
        return {label: mpl.colors.to_hex(ramp(where)) for label, where in place.items()}
    colours = PALETTE if len(levels) <= len(PALETTE) else STACK
    return {label: colours[index % len(colours)] for index, label in enumerate(levels)}


_LETTER_IN, _HANDLE_IN = 0.075, 0.5
"""Mean width of a letter of a legend, and of a handle with the space around it."""
_LINE_IN, _LINES = 0.18, 4
"""Height of a line of a legend, and for how many a figure has room as it is: for more it is made higher."""


def legend_below(figure: Figure, groups: Sequence[tuple[str, Sequence[Artist]]], **look: Any) -> None:
    """A legend below all panels, each group on lines of its own, with as many columns as the figure has room for.

    Args:
        figure: Of panels.
        groups: A title and handles with labels.
        look: For `Figure.legend`.
    """
    room_in = figure.get_size_inches()[0] - 0.3
    for columns in range(min(7, max((len(handles) for _, handles in groups), default=0)), 0, -1):
        lines = [line for title, handles in groups for line in _lines_of(title, handles, columns)]
        widths = [max(len(str(line[place].get_label())) for line in lines) for place in range(columns + 1)]
        if columns == 1 or sum(_LETTER_IN * width + _HANDLE_IN for width in widths) <= room_in:
            by_column = [line[place] for place in range(columns + 1) for line in lines]  # as legends are filled
            figure.legend(handles=by_column, loc="outside lower center", ncols=columns + 1, **look)
            width_in, height_in = figure.get_size_inches()
            figure.set_size_inches(width_in, height_in + _LINE_IN * max(0, len(lines) - _LINES))
            return


def _lines_of(title: str, handles: Sequence[Artist], columns: int) -> list[list[Artist]]:
    """A group cut into lines: its title, then equally many handles, the last ones empty."""
    starts = range(0, len(handles), columns)
    lines = [[_words(f"{title}:" if start == 0 else " "), *handles[start : start + columns]] for start in starts]
    return [line + [_words(" ") for _ in range(columns + 1 - len(line))] for line in lines]


def _words(text: str) -> Artist:
    """An entry of a legend without a mark."""
    return Line2D([], [], ls="", label=text)


def markers_of(axis: AxisInfo | None) -> dict[str, str]:
    """A marker for each level of an axis, by its label."""
    levels = [] if axis is None else [label_of(level) for level in axis.levels]
    return {label: MARKERS[index % len(MARKERS)] for index, label in enumerate(levels)}


def legible(colour: Any) -> str:
    """A colour for letters on white: the same, as far towards the ink as it takes.

    Contrast of 4.5 after WCAG 2.1, success criterion 1.4.3.
    """
    given, ink = mpl.colors.to_rgb(colour), mpl.colors.to_rgb(INK)
    for share in (0.0, 0.15, 0.3, 0.45, 0.6, 0.75):
        red, green, blue = ((1 - share) * one + share * other for one, other in zip(given, ink, strict=True))
        mixed = (red, green, blue)
        if 1.05 / (_luminance(mixed) + 0.05) >= 4.5:
            return mpl.colors.to_hex(mixed)
    return INK


def _luminance(colour: Sequence[float]) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.1)."""
    linear = [each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4 for each in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def spans_decades(values: Sequence[float], ratio: float = 20.0) -> bool:
    """Whether positive values are better shown on a log axis."""
    return bool(values) and min(values) > 0 and max(values) / min(values) >= ratio


def log_scale(axis: Any, values: Sequence[float], most_ticks: int = 7) -> None:
    """Make an axis logarithmic, with numbers as one writes them.

    Args:
        axis: `panel.xaxis` or `panel.yaxis`.
        values: Positive, what is to be shown.
        most_ticks: So many labels fit beside each other, where decades are told.
    """
    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
    narrow = max(values) / min(values) < 200
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if narrow else (1.0,), numticks=12 if narrow else most_ticks))
    axis.set_major_formatter(FuncFormatter(plain_tick))
    axis.set_minor_formatter(NullFormatter())


def keep_near(axis: Any, means: Sequence[float], ends: Sequence[float], most_room: float = MOST_ROOM) -> None:
    """Keep the points of an axis apart where intervals are far wider than they: bars run out of the panel then.

    Args:
        axis: `panel.xaxis` or `panel.yaxis`, linear or logarithmic.
        means: Where the points are; positive on a logarithmic axis.
        ends: Ends of their intervals.
        most_room: How far beyond the points intervals are shown, in ranges of the points.
    """
    set_limits = axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim
    if axis.get_scale() == "log":
        positive = [math.log(end) for end in ends if end > 0]
        set_limits(*np.exp(_limits(np.log(means).tolist(), positive, most_room)))
    elif _reach_far(means, ends, most_room):
        set_limits(*_limits(means, ends, most_room))


def _room(means: Sequence[float], most_room: float) -> float:
    return most_room * ((max(means) - min(means)) or abs(max(means)) or 1.0)


def _reach_far(means: Sequence[float], ends: Sequence[float], most_room: float) -> bool:
    room = _room(means, most_room)
    return min(ends) < min(means) - room or max(ends) > max(means) + room


def _limits(means: Sequence[float], ends: Sequence[float], most_room: float) -> tuple[float, float]:
    """Of a panel: as far as the intervals reach, but not too far from the points."""
    low, high, room = min(means), max(means), _room(means, most_room)
    margin = 0.08 * (high - low + 2 * room)
    return max(min([*ends, low]) - margin, low - room), min(max([*ends, high]) + margin, high + room)


def plain_tick(value: float, _: int | None = None) -> str:
    """A tick as one writes it: `0.03`, `30`, `30 000`."""
    text = f"{value:.8g}" if abs(value) < 1e4 else f"{value:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    return text.replace("-", MINUS)


def grid_of(count: int) -> tuple[int, int]:
    """Rows and columns for so many panels: three abreast, two where that leaves fewer places empty."""
    columns = 2 if count in (2, 4) else min(3, count)
    return math.ceil(count / columns), columns


def wrap(text: str, width: int = 26) -> str:
    """A title on at most two lines; what does not fit on them is cut off, and seen to be."""
    lines = textwrap.wrap(text, width)
    return "\n".join(lines if len(lines) <= 2 else [lines[0], shorten(f"{lines[1]} {lines[2]}", width)])


def shorten(text: str, most: int = 34) -> str:
    """A text of at most so many characters."""
    return text if len(text) <= most else text[: most - 1] + "…"
