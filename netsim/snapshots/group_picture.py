"""The picture of several tracks: a map an instant, who is who below each, and the errors over time."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from netsim.flow.drawing import save, styled
from netsim.snapshots import look
from netsim.snapshots.group_moment import GroupMoment, group_moment, joint_spans_ns
from netsim.snapshots.group_panel import draw_bars, draw_map, group_handles
from netsim.snapshots.load import TrackRun
from netsim.snapshots.picture import HEAD_IN, errors_of, finish_curve, mark_instants, panel_in, parted, shape_of
from netsim.units import NS_PER_S

_TEXT_IN = 0.5
_BAR_IN = 0.21
_USUAL = 0.9
"""Share of the errors that the scale is made for."""


def write_group_picture(run: TrackRun, times_ns: Sequence[int], path: Path) -> None:
    """Draw some instants and write the picture.

    Args:
        run: What to draw.
        times_ns: The instants that get a panel, in order.
        path: Where to write; a name that ends in `.png` or `.svg`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    with styled():
        save(draw_groups(run, times_ns), path)


def draw_groups(run: TrackRun, times_ns: Sequence[int]) -> Figure:
    """The picture as a figure."""
    moments = [group_moment(run, time_ns) for time_ns in times_ns]
    rows, across = shape_of(len(moments))
    wide_in, tall_in = panel_in(run)
    bars_in = _BAR_IN * max(len(each.tracks) for each in moments) + 0.1
    panels_in = HEAD_IN + rows * (tall_in + _TEXT_IN + bars_in)
    figure, above, middle, below = parted(f"Tracks: {run.title}", across * (wide_in + 0.3) + 0.5, panels_in)
    _draw_panels(above, run, moments, (rows, across), (tall_in, bars_in))
    handles = group_handles(run, moments)
    middle.legend(handles=handles, loc="center", ncols=-(-len(handles) // 2), fontsize=8, columnspacing=1.4)
    _draw_errors(below.subplots(), run, moments)
    return figure


def _draw_panels(
    figure: SubFigure,
    run: TrackRun,
    moments: Sequence[GroupMoment],
    shape: tuple[int, int],
    heights_in: tuple[float, float],
) -> None:
    rows, across = shape
    axes = figure.subplots(2 * rows, across, squeeze=False, gridspec_kw={"height_ratios": heights_in * rows})
    for number in range(rows * across):
        row, column = divmod(number, across)
        above, below = axes[2 * row, column], axes[2 * row + 1, column]
        if number >= len(moments):
            above.set_axis_off()
            below.set_axis_off()
            continue
        draw_map(above, run, moments[number])
        draw_bars(below, moments[number])
        if column:
            above.set_yticklabels([])
        else:
            above.set_ylabel("y (m)")


def _draw_errors(axes: Axes, run: TrackRun, moments: Sequence[GroupMoment]) -> None:
    """Distance of every estimate from the nearest target, and when groups were joint."""
    for number, (begin_ns, end_ns) in enumerate(joint_spans_ns(run)):
        label = "a joint group" if not number else None
        axes.axvspan(begin_ns / NS_PER_S, end_ns / NS_PER_S, color=look.JOINT, alpha=0.16, lw=0, label=label)
    for track in sorted({each.line[0] for each in run.guesses}):
        colour = look.track_colour(track)
        axes.plot(*errors_of(run, (track, 0)), color=colour, lw=1.1, marker=".", ms=3.5, label=f"track {track}")
    span_ns = run.clouds[0].time_ns, run.clouds[-1].time_ns
    mark_instants(axes, span_ns, [each.time_ns for each in moments])
    finish_curve(axes, _top_m(run))


def _top_m(run: TrackRun) -> float:
    """Upper end of the scale: tracks whose target has left may leave it."""
    errors = sorted(off for each in run.guesses if (off := run.truth.nearest_m(each.time_ns, each.place_m)) is not None)
    return max(1.0, 2.0 * errors[int(_USUAL * (len(errors) - 1))]) if errors else 1.0
