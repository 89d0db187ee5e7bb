"""The picture of a track: one panel an instant, and below them the error over time."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure, SubFigure

from netsim.flow import look as flow_look
from netsim.flow.drawing import save, styled
from netsim.snapshots import look
from netsim.snapshots.load import Line, TrackRun
from netsim.snapshots.moment import HOLD_S, Moment, in_seconds, moment
from netsim.snapshots.panel import CELL_COLOURS, CELL_SCALE, draw_panel, legend_handles
from netsim.units import NS_PER_S

_WIDE_IN = 3.0
_TALL_IN = 5.4  # a panel is at most so high
_TEXT_IN = 0.65
_STRIP_IN = 1.9
HEAD_IN = 0.4
"""Height of the title."""
_LEGEND_IN = 0.62
_LEAST_IN = 7.6
_COLUMNS = 4
_APART = 0.06  # of the time shown: instants closer than this share a label


def write_picture(run: TrackRun, times_ns: Sequence[int], path: Path) -> None:
    """Draw some instants and write the picture.

    Args:
        run: What to draw.
        times_ns: The instants that get a panel, in order.
        path: Where to write; a name that ends in `.png` or `.svg`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    with styled():
        save(draw(run, times_ns), path)


def draw(run: TrackRun, times_ns: Sequence[int]) -> Figure:
    """The picture as a figure."""
    moments = [moment(run, time_ns) for time_ns in times_ns]
    rows, across = shape_of(len(moments))
    wide_in, tall_in = panel_in(run)
    panels_in = HEAD_IN + rows * (tall_in + _TEXT_IN)
    figure, above, middle, below = parted(f"Track: {run.title}", across * (wide_in + 0.25) + 0.9, panels_in)
    _draw_panels(above, run, moments, (rows, across))
    handles = legend_handles(run, moments)
    across = -(-len(handles) // 2)
    middle.legend(handles=handles, loc="center", ncols=across, fontsize=8, columnspacing=1.4, handletextpad=0.6)
    _draw_error(below.subplots(), run, moments)
    return figure


def shape_of(panels: int) -> tuple[int, int]:
    """Rows of panels, and how many of them stand beside each other."""
    rows = -(-panels // _COLUMNS)
    return rows, -(-panels // rows)


def parted(title: str, wide_in: float, panels_in: float) -> tuple[Figure, SubFigure, SubFigure, SubFigure]:
    """A figure with its title, and its parts: for panels of a height in inches, their legend, and a curve over time."""
    figure = Figure(figsize=(max(_LEAST_IN, wide_in), panels_in + _LEGEND_IN + _STRIP_IN), layout="constrained")
    grid = figure.add_gridspec(3, 1, height_ratios=[panels_in, _LEGEND_IN, _STRIP_IN])
    above, middle, below = (figure.add_subfigure(grid[row]) for row in range(3))
    above.suptitle(title, x=0.01, ha="left", fontsize=11, color=flow_look.INK)
    return figure, above, middle, below


def panel_in(run: TrackRun) -> tuple[float, float]:
    """Width and height of a panel in inches, in the field's proportions."""
    low_x, low_y, high_x, high_y = run.box_m or (0.0, 0.0, 1.0, 1.0)
    tall = (high_y - low_y) / (high_x - low_x)
    wide_in = min(_WIDE_IN, _TALL_IN / tall)
    return wide_in, wide_in * tall


def _draw_panels(figure: SubFigure, run: TrackRun, moments: Sequence[Moment], shape: tuple[int, int]) -> None:
    axes = figure.subplots(*shape, squeeze=False, sharex=True, sharey=True)
    for panel, each in zip(axes.flat, moments, strict=False):
        draw_panel(panel, run, each)
    for panel in axes.flat[len(moments) :]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("x (m)")
    for panel in axes[:, 0]:
        panel.set_ylabel("y (m)")
    bar = figure.colorbar(
        ScalarMappable(CELL_SCALE, CELL_COLOURS), ax=axes, shrink=0.55, aspect=28, pad=0.015, ticks=[0, 0.1, 0.5, 1]
    )
    bar.set_label("belief: probability of a cell,\nover that of the most probable one", fontsize=8)
    bar.outline.set_visible(False)


def _draw_error(axes: Axes, run: TrackRun, moments: Sequence[Moment]) -> None:
    """Distance of every estimate from the nearest target, and how far off its belief expects it to be.

    What is beyond the scale is marked at its upper end.
    """
    top_m = _top_m(run)
    several = 1 < len(run.lines) <= len(look.LINES)
    for number, line in enumerate(run.lines):
        colour = look.LINES[number % len(look.LINES)]
        said = f"error, {run.line_name(line)}" if several else "error"
        label = said if several or not number else None
        times_s, errors_m = errors_of(run, line)
        axes.plot(times_s, errors_m, color=colour, lw=1.1, marker=".", ms=3.5, label=label)
        beyond = [time_s for time_s, off_m in zip(times_s, errors_m, strict=True) if off_m > top_m]
        axes.plot(beyond, [0.97 * top_m] * len(beyond), color=colour, marker="^", ms=4, ls="", mew=0)
    for number, line in enumerate(run.lines):
        label = "belief: root of its variance" if not number else None
        axes.fill_between(*_spread(run, line), color=look.SPREAD, alpha=0.45, lw=0, label=label, zorder=1)
    for number, (begin_ns, end_ns) in enumerate(run.outages_ns):
        label = "no leader" if not number else None
        axes.axvspan(begin_ns / NS_PER_S, end_ns / NS_PER_S, color=look.OUTAGE, alpha=0.35, lw=0, label=label)
    span_ns = run.steps[0].time_ns, run.steps[-1].time_ns
    mark_instants(axes, span_ns, [each.time_ns for each in moments])
    finish_curve(axes, top_m)


def finish_curve(axes: Axes, top_m: float) -> None:
    """Scale, names and legend of a curve of distances from targets over time."""
    axes.set_ylim(0.0, top_m)
    axes.margins(x=0.01)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("distance from target (m)")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 1.22), fontsize=8, ncols=6, borderaxespad=0.0)


def mark_instants(axes: Axes, span_ns: tuple[int, int], times_ns: Sequence[int]) -> None:
    """Mark the instants of panels on a curve over time; of those that are close together the first is named."""
    apart_ns = _APART * (span_ns[1] - span_ns[0])
    named_ns = -math.inf
    for time_ns in times_ns:
        axes.axvline(time_ns / NS_PER_S, color=look.LEADER, lw=0.9, ls=(0, (3, 2)))
        if time_ns - named_ns >= apart_ns:
            named_ns = time_ns
            axes.annotate(
                in_seconds(time_ns), (time_ns / NS_PER_S, 1.0), (3, -2), xycoords=("data", "axes fraction"),
                textcoords="offset points", va="top", fontsize=7.5, color=look.LEADER,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
            )  # fmt: skip


def errors_of(run: TrackRun, line: Line) -> tuple[list[float], list[float]]:
    """Times in seconds, and distances in metres of a line's estimates from the nearest target.

    There is a gap, so that no line bridges it, where nothing is said for long. Tracks of groups follow no target beyond
    the cut-off, as one that has left; that is left out.
    """
    pairs = [
        (each.time_ns / NS_PER_S, run.truth.nearest_m(each.time_ns, each.place_m))
        for each in run.guesses
        if each.line == line
    ]
    return _with_gaps([(time_s, off_m) for time_s, off_m in pairs if off_m is not None and off_m < run.cut_off_m])


def _spread(run: TrackRun, line: Line) -> tuple[list[float], list[float]]:
    steps = [each for each in run.steps if each.line == line]
    return _with_gaps([(each.time_ns / NS_PER_S, math.sqrt(each.belief.variance_m2)) for each in steps])


def _with_gaps(pairs: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    times_s, values = [], []
    for number, (time_s, value) in enumerate(pairs):
        if number and time_s - pairs[number - 1][0] > HOLD_S:
            times_s.append(time_s)
            values.append(math.nan)
        times_s.append(time_s)
        values.append(value)
    return times_s, values


def _top_m(run: TrackRun) -> float:
    """Upper end of the scale: the first beliefs, which know nothing, may leave it."""
    errors = sorted(off for each in run.guesses if (off := run.truth.nearest_m(each.time_ns, each.place_m)) is not None)
    spreads = sorted(math.sqrt(each.belief.variance_m2) for each in run.steps)
    usual = [values[int(0.95 * (len(values) - 1))] for values in (errors, spreads) if values]
    return 1.35 * max([*usual, 1.0])
