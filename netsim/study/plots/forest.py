"""Estimates with their intervals, a row each: paired differences, lifetimes, published beside measured figures."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from netsim.study.differences import EQUAL, HIGHER, LOWER
from netsim.study.levels import label_of
from netsim.study.plots.rows import kept_rows, label_rows, left_out, row_height_in, row_labels
from netsim.study.plots.style import (
    INK,
    PALETTE,
    SOFT,
    WIDTH_IN,
    Plot,
    colours_of,
    grid_of,
    keep_near,
    log_scale,
    panels,
    plain_tick,
    spans_decades,
    wrap,
)
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import bounds_of, level_name, title_of
from netsim.study.reporting.phrases import Row, decided
from netsim.study.reporting.view import View
from netsim.study.statistics import published_table

DOTS: Mapping[str, Any] = {"lw": 0, "elinewidth": 1.2, "capsize": 2, "ms": 6}
MOST_PUBLISHED = 20
"""So many published figures of a metric are drawn."""
LEAST_PUBLISHED = 3
"""Fewer published figures are told by the table alone."""


def difference_plots(view: View) -> Iterator[Plot]:
    """Paired differences against the baseline: a panel a metric, a row a level and setting."""
    axis = view.info.compare_axis
    if view.differences is None or axis is None or len(view.info.repetitions) < 2:
        return
    metrics = [name for name in view.compared if _known(view, name)][:6]
    if not metrics:
        return
    every = {_key(view, row): row for metric in metrics for row in _known(view, metric)}
    names = list(every)
    kept = kept_rows(view.info.axes, list(every.values()))
    keys = [names[place] for place in kept]
    labels = row_labels(keys)
    rows, columns = grid_of(len(metrics))
    figure, axes = panels(rows, columns, rows * (1.0 + row_height_in(labels, 0.21) * len(keys)) + 0.2, sharey=True)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        _differences(view, panel, metric, keys)
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_axis_off()
    for panel in axes[:, 0]:
        label_rows(panel, labels)
    base = plain(level_name(axis, view.info.baseline))
    levels = _levels(view)
    what = f"Mean difference of {plain(levels[0])}" if len(levels) == 1 else "Mean difference"
    caption = (
        f"{what} from {base} within repetitions, relative to the baseline's mean, with its 95 % interval. Filled: other "
        "than 0 (or equal in every pair), even after Holm's adjustment for all comparisons of the metric; hollow: undecided."
    )
    without = sum(_is_without(row) for metric in metrics for row in _known(view, metric) if _key(view, row) in keys)
    if without:
        caption += (
            f" Not drawn: {without} difference{'s' if without > 1 else ''} from a baseline of 0, which have no "
            "relative size (see the table)."
        )
    caption += left_out(view.info.axes, list(every.values()), kept, "rows")
    yield Plot("differences", figure, caption, f"Paired differences against {base}")


def lifetime_plots(view: View) -> Iterator[Plot]:
    """Days by variant, a colour a milestone."""
    there = [name for name in view.lifetimes if any(view.estimate(number, name).n for number in view.variants)]
    every = [number for number in view.variants if any(view.estimate(number, name).n for name in there)]
    if not every:
        return
    levels = [view.levels(number) for number in every]
    kept = kept_rows(view.info.axes, levels)
    variants = [every[place] for place in kept]
    labels = row_labels([view.name(number) for number in variants])
    figure, axes = panels(1, 1, 1.3 + 0.34 * len(variants), width_in=0.85 * WIDTH_IN)
    panel = axes[0][0]
    values = [view.estimate(number, name).mean for number in variants for name in there]
    for place, name in enumerate(there):
        found = [view.drawn(number, name) for number in variants]
        y = np.arange(len(variants)) + 0.16 * (place - (len(there) - 1) / 2)
        panel.errorbar([mean for mean, *_ in found], y, xerr=_lengths(found), fmt="osD^"[place], color=PALETTE[place],
                       label=title_of(name).removeprefix("lifetime to "), **{**DOTS, "ms": 4.5})  # fmt: skip
    if spans_decades([value for value in values if not math.isnan(value)]):
        log_scale(panel.xaxis, [value for value in values if not math.isnan(value)])
    else:
        panel.set_xlim(left=0)
    label_rows(panel, labels)
    panel.set_xlabel("days until")
    figure.legend(loc="outside lower center", ncols=2)
    caption = "Days until each milestone under the scenario's duty plan: means, bars are 95 % intervals. None: never."
    caption += left_out(view.info.axes, levels, kept)
    yield Plot("lifetime", figure, caption, "Lifetime in days by variant")


def published_plots(view: View) -> Iterator[Plot]:
    """Published and measured figures side by side, a panel a metric."""
    rows = [row for row in published_table(view.info, view.summary).to_dict("records") if row["n"] > 0]
    metrics = list(dict.fromkeys(row["metric"] for row in rows))
    if len(rows) < LEAST_PUBLISHED:
        return
    columns = min(2, len(metrics))
    lines = math.ceil(len(metrics) / columns)
    most = max(sum(row["metric"] == metric for row in rows) for metric in metrics)
    figure, axes = panels(lines, columns, lines * (0.9 + 0.4 * min(most, MOST_PUBLISHED)) + 0.4)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        _published(view, panel, [row for row in rows if row["metric"] == metric][:MOST_PUBLISHED])
        panel.set_title(wrap(title_of(metric), 34))
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_axis_off()
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    caption = (
        "Measured and published figures with 95 % intervals (published: ± 1.96 standard errors, where they are known), "
        "cut where they are far wider than the figures are apart; a log scale where these span decades."
    )
    yield Plot("published", figure, caption, "Published beside measured figures")


def _published(view: View, panel: Any, rows: Sequence[Row]) -> None:
    y = np.arange(len(rows))
    least, most = bounds_of(rows[0]["metric"])
    measured = [_triple(row["measured"], row["low"], row["high"], least, most) for row in rows]
    known = [1.96 * row["published_se"] for row in rows]
    published = [
        _triple(row["published"], row["published"] - half, row["published"] + half, least, most)
        for row, half in zip(rows, known, strict=True)
    ]
    for place, (found, marker, label) in enumerate(((measured, "o", "measured"), (published, "D", "published"))):
        panel.errorbar([mean for mean, *_ in found], y + 0.24 * place - 0.12, xerr=_lengths(found), fmt=marker,
                       color=PALETTE[place], label=label, **DOTS)  # fmt: skip
    label_rows(panel, row_labels([view.name(int(row["variant"])) for row in rows], 30))
    _scale_figures(panel, [*measured, *published])


def _triple(mean: float, low: float, high: float, least: float, most: float) -> tuple[float, float, float]:
    """A mean with the ends of its interval, within what the metric can be; without an interval, the mean itself."""
    low, high = (mean if math.isnan(end) else min(max(end, least), most) for end in (low, high))
    return mean, low, high


def _lengths(found: Sequence[tuple[float, float, float]]) -> list[list[float]]:
    """How far the bars of means reach down and up, as matplotlib wants it."""
    return [[max(0.0, mean - low) for mean, low, _ in found], [max(0.0, high - mean) for mean, _, high in found]]


def _scale_figures(panel: Any, found: Sequence[tuple[float, float, float]]) -> None:
    """A log axis where figures span decades; the figures apart where intervals are far wider."""
    means = [mean for mean, *_ in found]
    is_log = spans_decades(means)
    if is_log:
        log_scale(panel.xaxis, means)
    else:
        panel.xaxis.set_major_locator(MaxNLocator(5))
    keep_near(panel.xaxis, means, [end for _, *ends in found for end in ends], 1.0 if is_log else 3.0)


def _known(view: View, metric: str) -> list[Row]:
    """The paired differences of a metric that have pairs."""
    table = view.differences
    return (
        [] if table is None else [row for row in table.to_dict("records") if row["metric"] == metric and row["n"] > 1]
    )


def _is_without(row: Row) -> bool:
    """Whether a difference has no size relative to the baseline."""
    return math.isnan(row["relative"])


def _key(view: View, row: Row) -> str:
    """A row's setting and level in words."""
    axis = str(view.info.compare_axis)
    others = [each.name for each in view.info.axes if each.name != axis and len(each.levels) > 1]
    told = [axis] if len(_levels(view)) > 1 or not others else []
    return ", ".join(
        [*(level_name(name, row[name]) for name in others), *(level_name(name, row[name]) for name in told)]
    )


def _levels(view: View) -> list[str]:
    """The levels that are compared with the baseline, in words."""
    axis = next(each for each in view.info.axes if each.name == view.info.compare_axis)
    return [level_name(axis.name, each) for each in axis.levels if label_of(each) != label_of(view.info.baseline)]


def _differences(view: View, panel: Any, metric: str, keys: Sequence[str]) -> None:
    axis = next(axis for axis in view.info.axes if axis.name == view.info.compare_axis)
    colours = colours_of(axis)
    panel.axvline(0, color=INK, lw=1)
    for row in _known(view, metric):
        key, base = _key(view, row), abs(float(row["baseline_mean"]))
        if key not in keys or _is_without(row):
            continue
        colour = colours.get(label_of(row[axis.name]), SOFT)
        sure = decided(row) in (LOWER, HIGHER, EQUAL)
        half = 100 * (float(row["high"]) - float(row["low"])) / 2 / base
        panel.errorbar(100 * float(row["difference"]) / base, keys.index(key), xerr=half, fmt="o", ms=5, color=colour,
                       mfc=colour if sure else "white", elinewidth=1.2, capsize=2, zorder=4)  # fmt: skip
    low, high = panel.get_xlim()
    if high - low < 1e-9 or all(row["verdict"] == EQUAL for row in _known(view, metric)):
        panel.set_xlim(-1, 1)
    panel.xaxis.set_major_locator(MaxNLocator(5))
    panel.xaxis.set_major_formatter(FuncFormatter(plain_tick))
    panel.set_title(wrap(title_of(metric), 26))
    panel.set_xlabel("difference (%)")
