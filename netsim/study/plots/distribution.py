"""How a metric varies from trial to trial: the share of trials at or below each value, a line a variant."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from netsim.study.plots.style import (
    PALETTE,
    SOFT,
    Plot,
    colours_of,
    grid_of,
    legend_below,
    log_scale,
    panels,
    shorten,
    spans_decades,
    wrap,
)
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import title_with, unit_of
from netsim.study.reporting.numbers import Scale, scale_for
from netsim.study.reporting.view import View

MOST_LINES = 8
MOST_PANELS = 6


def distribution_plots(view: View) -> Iterator[Plot]:
    """A panel for each metric that is compared, where the study asks for it."""
    variants = view.variants[:MOST_LINES]
    metrics = [name for name in view.compared if any(view.single(number, name) for number in variants)][:MOST_PANELS]
    if "distribution" not in view.info.plots or not metrics:
        return
    rows, columns = grid_of(len(metrics))
    figure, axes = panels(rows, columns, 0.8 + 2.6 * rows, sharey=True)
    looks = _looks(view, variants)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        scale = _scale(view, metric, variants)
        for variant in variants:
            _steps(panel, [value * scale.factor for value in view.single(variant, metric)], looks[variant])
        _finish(panel, [value * scale.factor for number in variants for value in view.single(number, metric)])
        panel.set_title(wrap(title_with(metric, scale.unit), 40))
    for panel in axes[:, 0]:
        panel.set_ylabel("share of trials")
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_axis_off()
    handles = [Line2D([], [], lw=1.8, label=shorten(view.name(number), 60), **looks[number]) for number in variants]
    legend_below(figure, [("variant", handles)])
    yield Plot("distribution", figure, _caption(view, variants, metrics), "Distributions of metrics over the trials")


def _looks(view: View, variants: Sequence[int]) -> Mapping[int, Mapping[str, Any]]:
    """A colour each, the same as in other plots where one axis alone tells the variants apart."""
    axes = [axis for axis in view.info.axes if len(axis.levels) > 1]
    if len(axes) == 1:
        colours = list(colours_of(axes[0]).values())
        return {number: {"color": colours[number % len(colours)]} for number in variants}
    return {number: {"color": PALETTE[place % len(PALETTE)]} for place, number in enumerate(variants)}


def _scale(view: View, metric: str, variants: Sequence[int]) -> Scale:
    """By the largest value: of a long outage nobody speaks in milliseconds."""
    largest = max((abs(value) for number in variants for value in view.single(number, metric)), default=0.0)
    return scale_for(unit_of(metric), [largest])


def _steps(panel: Any, values: Sequence[float], look: Mapping[str, Any]) -> None:
    if values:
        ascending = np.sort(values)
        shares = np.arange(1, len(values) + 1) / len(values)
        panel.step(np.append(ascending[0], ascending), np.append(0.0, shares), where="post", lw=1.6, **look)


def _finish(panel: Any, values: Sequence[float]) -> None:
    if spans_decades(values):
        log_scale(panel.xaxis, values)
    panel.axhline(0.5, color=SOFT, lw=0.8, ls=":")
    panel.set_ylim(0.0, 1.02)


def _caption(view: View, variants: Sequence[int], metrics: Sequence[str]) -> str:
    text = "Share of the trials at or below each value; the dotted line is the median"
    counts = {len(view.single(number, metric)) for number in variants for metric in metrics}
    trials = f"{min(counts)} to {max(counts)}" if len(counts) > 1 else str(min(counts))
    text += f". A line stands for {trials} trials: those that have a figure"
    left_out = len(view.variants) - len(variants)
    return plain(text + (f"; {left_out} variants are not shown." if left_out else "."))
