"""Error against each cost, with intervals both ways, and the Pareto set drawn and named."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from netsim.study.levels import label_of
from netsim.study.plots.labels import Mark, label_points
from netsim.study.plots.style import (
    INK,
    LEGEND_LETTERS,
    SOFT,
    WIDTH_IN,
    Plot,
    colours_of,
    grid_of,
    keep_near,
    legend_below,
    log_scale,
    markers_of,
    panels,
    plain_tick,
    settle,
    shorten,
    spans_decades,
    wrap,
)
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import better_of, is_ordered, title_of, title_with
from netsim.study.reporting.phrases import and_list, bracketed, pareto_chain
from netsim.study.reporting.view import View

MOST_SETTINGS = 9
"""So many settings of the circumstances get a panel."""
MOST_NAMES = 7
"""So many points of a panel get their names: all of them if one choice tells them apart, else the Pareto set."""
MOST_TOLD = 12
"""So many levels of an axis are told by the legend; of more numbers only some."""
SOME_TOLD = 6
LONG_TITLE = 30
"""Letters of a cost on one line below a panel."""
FACTORS = 5.0
"""Costs so many times apart are told by factors, on a log axis."""
MOST_TICKS = 5
"""Of costs that span decades, below a panel of a third of the page."""
NAME_MARGIN = 0.2
"""Room beside the outermost points for their names, in widths of their range."""


def tradeoff_plots(view: View) -> Iterator[Plot]:
    """Without circumstances or with few, all costs in one figure; else a figure a cost with a panel a setting."""
    if view.error is None or len(view.variants) < 2:
        return
    settings = {where: found for where, found in list(view.settings.items())[:MOST_SETTINGS]}
    costs = [cost for cost in view.costs if any(_point(view, number, cost) for number in view.variants)]
    if not costs:
        return
    if len(settings) == 1:
        yield _plot(view, [(cost, where, found) for cost in costs for where, found in settings.items()], "tradeoff")
        return
    for cost in costs:
        yield _plot(view, [(cost, where, found) for where, found in settings.items()], f"tradeoff-{cost}")


Panel = tuple[str, str, Sequence[int]]
"""A cost, a setting in words, its variants."""


def _plot(view: View, wanted: Sequence[Panel], stem: str) -> Plot:
    rows, columns = grid_of(len(wanted))
    one_cost = len({cost for cost, _, _ in wanted}) == 1 and not _apart(view, wanted)
    width = WIDTH_IN if columns > 1 else 0.66 * WIDTH_IN
    figure, axes = panels(rows, columns, 0.5 + 2.9 * rows, width_in=width, sharey=True, sharex=one_cost)
    for place, axis in enumerate(axes.flat):
        if place >= len(wanted):
            axis.set_axis_off()
            continue
        _scatter(view, axis, wanted[place])
        axis.tick_params(labelbottom=True)
        if place % columns == 0:
            axis.set_ylabel(wrap(title_with(str(view.error), view.scale(str(view.error)).unit), LONG_TITLE))
    _scale_axes(view, axes, wanted)
    _legend(view, figure)
    _names(view, figure, axes, wanted)
    costs = dict.fromkeys(title_of(cost) for cost, _, _ in wanted)
    return Plot(
        stem, figure, _caption(view, wanted), f"Scatter plot of {title_of(str(view.error))} against {', '.join(costs)}"
    )


def _caption(view: View, wanted: Sequence[Panel]) -> str:
    error = str(view.error)
    sets: dict[str, list[str]] = {}
    for cost, where, variants in wanted:
        sets.setdefault(pareto_chain(view, cost, variants), []).append(bracketed(plain(where)) or title_of(cost))
    pareto = "; ".join(f"{' / '.join(where)}: {names}" for names, where in sets.items())
    costs = list(dict.fromkeys(cost for cost, _, _ in wanted))
    count = len(view.settings)
    more = f" The first {MOST_SETTINGS} of {count} settings." if len(costs) == 1 and count > MOST_SETTINGS else ""
    bars = (
        " Bars are 95 % intervals of the means, cut where they are far wider than the means are apart."
        if len(view.info.repetitions) > 1
        else ""
    )
    bars += " Costs lie decades apart: each panel has a scale of its own." if _apart(view, wanted) else ""
    side = "above" if better_of(error) == "higher" else "below"
    title, against = title_of(error), " / ".join(map(title_of, costs))
    return (
        f"{title[0].upper()}{title[1:]} against {against}; better is {side} and {_towards(costs)}.{bars} Ringed and joined "
        f"by the grey line: the Pareto set of the means ({pareto}).{more}"
    )


def _towards(costs: Sequence[str]) -> str:
    """On which side the better costs are."""
    higher = [cost for cost in costs if better_of(cost) == "higher"]
    if len(higher) in (0, len(costs)):
        return f"to the {'right' if higher else 'left'}"
    return f"to the left, of {and_list(list(map(title_of, higher)))} to the right"


def _point(view: View, variant: int, cost: str) -> tuple[float, float] | None:
    x, y = (view.drawn(variant, metric)[0] for metric in (cost, str(view.error)))
    return None if math.isnan(x) or math.isnan(y) else (x, y)


def _scatter(view: View, axis: Any, panel: Panel) -> None:
    cost, where, variants = panel
    colours, markers = colours_of(_axis(view, 0)), markers_of(_axis(view, 1))
    members = view.pareto(cost, variants)
    for variant in variants:
        point = _point(view, variant, cost)
        if point is None:
            continue
        colour = colours.get(_label(view, variant, 0), SOFT)
        bars = _bars(view, variant, cost)
        axis.errorbar(*point, xerr=_lengths(point[0], bars[0]), yerr=_lengths(point[1], bars[1]), color=colour,
                      fmt=markers.get(_label(view, variant, 1), "o"), ms=5.5, elinewidth=1, capsize=2,
                      zorder=5)  # fmt: skip
    line = [point for variant in members if (point := _point(view, variant, cost)) is not None]
    axis.plot(*zip(*line, strict=True), "-", color=SOFT, lw=1, zorder=3)
    axis.plot(*zip(*line, strict=True), "o", mfc="none", mec=INK, ms=10, mew=1, zorder=6)
    axis.set_xlabel(wrap(title_with(cost, view.scale(cost).unit), LONG_TITLE))
    if len(view.choices) != 2:
        axis.margins(x=NAME_MARGIN)
    if where:
        axis.set_title(wrap(where, 34))


def _scale_axes(view: View, axes: Any, wanted: Sequence[Panel]) -> None:
    """The same errors in all panels, by factors where they span decades; costs likewise, unless settings lie far apart."""
    marks = [_marks(view, cost, found) for cost, _, found in wanted]
    for place, axis in enumerate(axes.flat[: len(wanted)]):
        alike = (
            [place]
            if _apart(view, wanted)
            else [other for other, one in enumerate(wanted) if one[0] == wanted[place][0]]
        )
        shown = [mark for other in alike for mark in marks[other]]
        if shown:
            _scale_cost(axis, shown)
    everywhere = [mark for found in marks for mark in found]
    if everywhere:
        errors = [mark.y for mark in everywhere]
        if spans_decades(errors):
            log_scale(axes.flat[0].yaxis, errors)
        keep_near(axes.flat[0].yaxis, errors, [end for mark in everywhere for end in mark.ends_y])


def _apart(view: View, wanted: Sequence[Panel]) -> bool:
    """Whether all panels show one cost, at settings that lie decades apart."""
    if len({cost for cost, _, _ in wanted}) > 1 or len(wanted) < 2:
        return False
    return spans_decades([mark.x for cost, _, found in wanted for mark in _marks(view, cost, found)])


def _scale_cost(axis: Any, marks: Sequence[Mark]) -> None:
    values = [mark.x for mark in marks]
    is_log = spans_decades(values, FACTORS)
    if is_log:
        log_scale(axis.xaxis, values, MOST_TICKS)
    keep_near(axis.xaxis, values, [end for mark in marks for end in mark.ends_x])
    if is_log:
        return
    axis.xaxis.set_major_locator(MaxNLocator(4))  # figures that differ late have long labels
    axis.xaxis.set_major_formatter(FuncFormatter(plain_tick))


def _marks(view: View, cost: str, variants: Sequence[int]) -> list[Mark]:
    """The points of a panel with their bars."""
    marks = [_mark(view, variant, cost, is_named=False) for variant in variants]
    return [mark for mark in marks if mark is not None]


def _legend(view: View, figure: Figure) -> None:
    """Below all panels: colours of the first choice, markers of the second."""
    if all(_all_named(view, variants) for variants in view.settings.values()):
        return
    groups: list[tuple[str, list[Line2D]]] = []
    first, second = _axis(view, 0), _axis(view, 1)
    for axis, looks in ((first, "colour"), (second, "marker")):
        if axis is None or len(axis.levels) < 2 or (len(axis.levels) > MOST_TOLD and not is_ordered(axis)):
            continue
        handles = []
        for label, look in _some(colours_of(axis) if looks == "colour" else markers_of(axis)):
            colour, marker = (look, "o") if looks == "colour" else (SOFT, look)
            handles.append(Line2D([], [], ls="", marker=marker, color=colour, label=shorten(label, LEGEND_LETTERS)))
        groups.append((axis.name, handles))
    legend_below(figure, groups, handletextpad=0.2)


def _some(looks: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """All levels with their looks, or some evenly spread ones of too many, the last among them."""
    told = list(looks.items())
    step = -(-(len(told) - 1) // (SOME_TOLD - 1))
    return told if len(told) <= MOST_TOLD else [*told[:-1:step], told[-1]]


def _names(view: View, figure: Figure, axes: Any, wanted: Sequence[Panel]) -> None:
    """Names beside the points, where colour and marker do not tell them already."""
    if len(view.choices) == 2:
        return
    settle(figure)
    for axis, (cost, _, variants) in zip(axes.flat, wanted, strict=False):
        there = {variant: point for variant in variants if (point := _point(view, variant, cost)) is not None}
        members = [variant for variant in view.pareto(cost, variants) if variant in there]
        named = set(there if _all_named(view, variants) else members if len(members) <= MOST_NAMES else ())
        marks = [_mark(view, variant, cost, is_named=variant in named) for variant in there]
        label_points(axis, [mark for mark in marks if mark is not None])


def _mark(view: View, variant: int, cost: str, is_named: bool) -> Mark | None:
    """A variant's point with its bars, its colour, and its name if it is to have one."""
    point = _point(view, variant, cost)
    if point is None:
        return None
    name = shorten(view.name(variant, [axis.name for axis in view.conditions]), 26) if is_named else ""
    colour = colours_of(_axis(view, 0)).get(_label(view, variant, 0), SOFT)
    return Mark(*point, name, colour, *_bars(view, variant, cost))


def _all_named(view: View, variants: Sequence[int]) -> bool:
    return len(view.choices) < 2 and len(variants) <= MOST_NAMES


def _bars(view: View, variant: int, cost: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """The ends of a point's bars, along the cost and along the error."""
    return view.drawn(variant, cost)[1:], view.drawn(variant, str(view.error))[1:]


def _lengths(middle: float, ends: tuple[float, float]) -> list[list[float]]:
    """How far a bar reaches down and up, as matplotlib wants it."""
    return [[max(0.0, middle - ends[0])], [max(0.0, ends[1] - middle)]]


def _axis(view: View, place: int) -> Any:
    return view.choices[place] if place < len(view.choices) else None


def _label(view: View, variant: int, place: int) -> str:
    axis = _axis(view, place)
    return "" if axis is None else label_of(view.levels(variant)[axis.name])
