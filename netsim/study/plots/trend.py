"""Metrics along an axis of numbers: means with the band of their 95 % intervals, a line a level of the other axes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from netsim.study.info import AxisInfo, PublishedInfo
from netsim.study.levels import label_of
from netsim.study.plots.style import (
    INK,
    LEGEND_LETTERS,
    PALETTE,
    SOFT,
    Plot,
    colours_of,
    grid_of,
    keep_near,
    legend_below,
    log_scale,
    panels,
    shorten,
    spans_decades,
    wrap,
)
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import is_ordered, title_with
from netsim.study.reporting.view import View

MOST_AXES = 2
MOST_PANELS = 6
MOST_ROOM = 3.0
"""Bands are shown so far beyond the lines, in ranges of the means: what is flat is to be seen within its band."""
DASHES = ("-", "--", ":", "-.")
PUBLISHED_LOOK: Mapping[str, Any] = {"ls": "", "marker": "D", "ms": 5, "color": INK, "mfc": "white", "zorder": 4}


def trend_plots(view: View) -> Iterator[Plot]:
    """A figure for each axis of three or more numbers, that of the comparison first."""
    ordered = [axis for axis in (*view.choices, *view.conditions) if is_ordered(axis)]
    for axis in ordered[:MOST_AXES]:
        metrics = [name for name in view.compared if any(view.estimate(number, name).n for number in view.variants)]
        if metrics:
            yield _plot(view, axis, metrics[:MOST_PANELS])


def _plot(view: View, axis: AxisInfo, metrics: Sequence[str]) -> Plot:
    others = [each for each in view.info.axes if each != axis and len(each.levels) > 1]
    told, fixed = others[:2], {each.name: each.levels[0] for each in others[2:]}
    lines = _lines(view, axis, told, fixed)
    rows, columns = grid_of(len(metrics))
    figure, axes = panels(rows, columns, 0.6 + 2.5 * rows, sharex=True)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        for levels, variants in lines.items():
            _line(view, panel, metric, axis, variants, _look(told, levels))
        _published(view, panel, metric, axis, fixed)
        _finish(view, panel, metric, axis)
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_axis_off()
    _legend(figure, told, any(_figures(view, axis, metric, fixed) for metric in metrics))
    return Plot(
        f"trend-{_stem(axis)}", figure, _caption(view, axis, told, fixed), f"Lines of metrics along {axis.name}"
    )


def _caption(view: View, axis: AxisInfo, told: Sequence[AxisInfo], fixed: Mapping[str, Any]) -> str:
    text = f"Means along {plain(axis.name)}"
    text += ", bands are 95 % intervals" if len(view.info.repetitions) > 1 else ""
    text += ", dots are single trials" if _shows_trials(view) else ""
    if told:
        text += f"; a line for each level of {' and '.join(plain(each.name) for each in told)}"
    if fixed:
        text += f", at {plain(', '.join(f'{name} {label_of(level)}' for name, level in fixed.items()))}"
    return text + ". Bands hold what all variants share of chance: differences are sharper than their overlap suggests."


def _lines(
    view: View, axis: AxisInfo, told: Sequence[AxisInfo], fixed: Mapping[str, Any]
) -> dict[tuple[str, ...], list[int]]:
    """The variants of each line, in the order of the axis."""
    lines: dict[tuple[str, ...], list[int]] = {}
    for variant in view.variants:
        levels = view.levels(variant)
        if all(label_of(levels[name]) == label_of(level) for name, level in fixed.items()):
            lines.setdefault(tuple(label_of(levels[each.name]) for each in told), []).append(variant)
    return {key: sorted(found, key=lambda number: view.levels(number)[axis.name]) for key, found in lines.items()}


def _look(told: Sequence[AxisInfo], levels: tuple[str, ...]) -> dict[str, Any]:
    colour = colours_of(told[0])[levels[0]] if told else PALETTE[0]
    dash = (
        DASHES[[label_of(level) for level in told[1].levels].index(levels[1]) % len(DASHES)] if len(told) > 1 else "-"
    )
    return {"color": colour, "ls": dash}


def _line(
    view: View, panel: Any, metric: str, axis: AxisInfo, variants: Sequence[int], look: Mapping[str, Any]
) -> None:
    factor = view.scale(metric).factor
    known = [variant for variant in variants if view.estimate(variant, metric).n]
    x = [float(view.levels(variant)[axis.name]) for variant in known]
    found = [view.drawn(variant, metric) for variant in known]
    low, high = [low for _, low, _ in found], [high for *_, high in found]
    if all(mean > 0 for mean, *_ in found):  # a log axis knows no zero
        low = [max(value, 1e-3 * mean) for value, (mean, *_) in zip(low, found, strict=True)]
    panel.fill_between(x, low, high, color=look["color"], alpha=0.14, linewidth=0)
    panel.plot(x, [mean for mean, *_ in found], marker="o", ms=4, lw=1.6, **look)
    if _shows_trials(view):
        dots = [
            (place, each * factor)
            for variant, place in zip(known, x, strict=True)
            for each in view.single(variant, metric)
        ]
        panel.plot(*zip(*dots, strict=True), ls="", marker=".", ms=4, mew=0, alpha=0.35, color=look["color"])


def _shows_trials(view: View) -> bool:
    return "trials" in view.info.plots


def _figures(view: View, axis: AxisInfo, metric: str, fixed: Mapping[str, Any]) -> list[tuple[float, PublishedInfo]]:
    """The published figures of a metric that stand on an axis, with their places on it."""
    return [
        (float(each.at[axis.name] or 0), each)
        for each in view.info.published
        if each.metric == metric
        and axis.name in each.at
        and all(label_of(each.at.get(name, level)) == label_of(level) for name, level in fixed.items())
    ]


def _published(view: View, panel: Any, metric: str, axis: AxisInfo, fixed: Mapping[str, Any]) -> None:
    factor = view.scale(metric).factor
    for place, figure in _figures(view, axis, metric, fixed):
        half = 1.96 * (figure.standard_error or 0.0) * factor
        panel.errorbar([place], [figure.value * factor], yerr=half or None, **PUBLISHED_LOOK)


def _finish(view: View, panel: Any, metric: str, axis: AxisInfo) -> None:
    """Scales and labels."""
    x = [float(level) for level in axis.levels if isinstance(level, int | float)]
    positive = [value for value in x if value > 0]
    if spans_decades(x, 50.0):
        log_scale(panel.xaxis, x)
    elif min(x) == 0 and spans_decades(positive, 200.0):
        panel.set_xscale("symlog", linthresh=min(positive))
    drawn = [each for number in view.variants if not math.isnan((each := view.drawn(number, metric))[0])]
    known = [mean for mean, *_ in drawn]
    if spans_decades(known):
        log_scale(panel.yaxis, known)
        panel.set_ylim(bottom=min(known) / 2)
    elif known:
        keep_near(panel.yaxis, known, [end for _, *ends in drawn for end in ends], MOST_ROOM)
    panel.set_title(wrap(title_with(metric, view.scale(metric).unit), 34))
    panel.set_xlabel(axis.name)
    panel.tick_params(labelbottom=True)


def _legend(figure: Figure, told: Sequence[AxisInfo], has_published: bool) -> None:
    groups: list[tuple[str, list[Line2D]]] = []
    for place, axis in enumerate(told):
        handles = []
        for index, level in enumerate(axis.levels):
            label = label_of(level)
            look = (
                {"color": colours_of(axis)[label]} if place == 0 else {"color": SOFT, "ls": DASHES[index % len(DASHES)]}
            )
            handles.append(Line2D([], [], lw=1.8, label=shorten(label, LEGEND_LETTERS), **look))
        groups.append((axis.name, handles))
    if has_published:
        groups.append(("paper", [Line2D([], [], label="published", **PUBLISHED_LOOK)]))
    legend_below(figure, groups)


def _stem(axis: AxisInfo) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in axis.name)
