"""The energy of each node on the map, a panel a variant, one scale of colours for all of them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import pandas as pd
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from netsim.study.levels import label_of
from netsim.study.plots.style import INK, SOFT, Plot, panels, plain_tick, spans_decades, wrap
from netsim.study.reporting.names import title_of
from netsim.study.reporting.numbers import scale_for
from netsim.study.reporting.view import View

MOST_PANELS = 12
MOST_NAMES = 16
"""So many nodes have their names written beside them."""
ENERGIES = ("energy_beyond_listening_j", "energy_j")
"""Columns of the table of nodes; the first one that is not the same everywhere tells more."""


@dataclass(frozen=True)
class Maps:
    """What is drawn.

    Attributes:
        energy: The column shown.
        by_variant: Each node's mean energy, and where it stands.
        moved: Whether nodes stand elsewhere in another repetition.
    """

    energy: str
    by_variant: Mapping[int, pd.DataFrame]
    moved: bool


def node_plots(view: View) -> Iterator[Plot]:
    """The map, if positions and energies are known, and of more than one node."""
    nodes = view.results.nodes
    energy = next((name for name in ENERGIES if name in nodes.columns and nodes[name].fillna(0.0).max() > 0), None)
    if energy is None or not {"x_m", "y_m", "node", "repetition"} <= set(nodes.columns):
        return
    found = {variant: _means(nodes[nodes["variant"] == variant], energy) for variant in _chosen(view)}
    there = {variant: table for variant, table in found.items() if len(table)}
    if any(len(table) > 1 for table in there.values()):
        yield _plot(view, Maps(energy, there, _moved(nodes)))


def _chosen(view: View) -> list[int]:
    """All variants if they are few; else some of each setting, the baseline and the Pareto sets before others."""
    if len(view.variants) <= MOST_PANELS:
        return list(view.variants)
    rows = zip_longest(*(_by_weight(view, variants) for variants in view.settings.values()))
    order = [number for row in rows for number in row if number is not None]
    return sorted(order[:MOST_PANELS])


def _by_weight(view: View, variants: Sequence[int]) -> list[int]:
    axis, base = view.info.compare_axis, label_of(view.info.baseline)
    first = [number for number in variants if axis is not None and label_of(view.levels(number)[axis]) == base]
    members = [number for cost in view.costs for number in view.pareto(cost, variants)]
    return list(dict.fromkeys((*first[:1], *members, *first, *variants)))


def _means(nodes: pd.DataFrame, energy: str) -> pd.DataFrame:
    """Each node's mean energy and its first position."""
    known = nodes[nodes[energy].notna()].sort_values(["repetition", "node"])
    groups = known.astype({energy: float}).groupby("node")
    firsts = groups[[name for name in ("name", "role", "x_m", "y_m") if name in known.columns]].first()
    return firsts.assign(**{energy: groups[energy].mean()})


def _moved(nodes: pd.DataFrame) -> bool:
    places = nodes.groupby(["variant", "node"])[["x_m", "y_m"]]
    return bool(((places.max() - places.min()).to_numpy() > 1e-9).any())


def _plot(view: View, maps: Maps) -> Plot:
    everything = pd.concat([found[maps.energy] for found in maps.by_variant.values()])
    scale = scale_for("J", [float(everything.max())])
    low, high = (float(found) * scale.factor for found in (everything.min(), everything.max()))
    norm = LogNorm(low, high) if spans_decades([low, high]) else Normalize(low, high)
    figure, axes = _grid(maps.by_variant)
    drawn: Any = None
    for axis, (variant, found) in zip(axes.flat, maps.by_variant.items(), strict=False):
        drawn = _map(axis, found, found[maps.energy] * scale.factor, norm)
        axis.set_title(wrap(view.name(variant), 26 if axes.shape[1] < 4 else 20))
    for axis in list(axes.flat)[len(maps.by_variant) :]:
        axis.set_axis_off()
    axis_format = FuncFormatter(plain_tick) if isinstance(norm, LogNorm) else None
    label = f"{title_of(maps.energy)} of a node ({scale.unit})"
    figure.colorbar(drawn, ax=axes, label=label, shrink=0.85, pad=0.02, aspect=30, format=axis_format)
    return Plot("energy-by-node", figure, _caption(view, maps), "Maps of the nodes coloured by their energy")


def _caption(view: View, maps: Maps) -> str:
    what = "without listening, sleep and idling" if maps.energy == ENERGIES[0] else "all in all"
    text = f"What each node drew, {what}: mean over the trials, one scale of colours for all maps; sinks are squares."
    if maps.moved:
        text += " Nodes stand elsewhere in each repetition: positions are those of the first one."
    if len(maps.by_variant) < len(view.variants):
        text += f" {len(maps.by_variant)} of {len(view.variants)} variants; all are in nodes.csv."
    return text


def _grid(maps: Mapping[int, pd.DataFrame]) -> tuple[Figure, Any]:
    """Panels that have about the shape of the field."""
    columns = min(3 if len(maps) <= 9 else 4, len(maps))
    rows = math.ceil(len(maps) / columns)
    sizes = [(float(found["x_m"].max() - found["x_m"].min()), float(found["y_m"].max() - found["y_m"].min()))
             for found in maps.values()]  # fmt: skip
    aspect = max((height + 1e-9) / (width + 1e-9) for width, height in sizes)
    width_in = (5.0, 7.6, 9.0, 10.0)[columns - 1]
    panel_in = (width_in - 1.7) / columns * min(1.4, max(0.35, aspect))
    return panels(rows, columns, rows * (panel_in + 0.4) + 0.35, width_in=width_in, sharex=True, sharey=True)


def _map(axis: Any, found: pd.DataFrame, colours: "pd.Series[float]", norm: Normalize) -> Any:
    """One variant's map; what a colour bar is made of."""
    size = min(150.0, max(10.0, 4800.0 / len(found)))
    sinks = found["role"] == "sink" if "role" in found.columns else pd.Series(data=False, index=found.index)
    drawn = None
    for which, marker, edge in ((~sinks, "o", 0.6), (sinks, "s", 1.8)):
        if which.any():
            place = found[which]
            drawn = axis.scatter(place["x_m"], place["y_m"], c=colours[which], cmap="cividis", norm=norm, s=size,
                                 marker=marker, edgecolors=INK, zorder=3,
                                 linewidths=edge)  # fmt: skip
    if len(found) <= MOST_NAMES and "name" in found.columns:
        for name, x, y in zip(found["name"], found["x_m"], found["y_m"], strict=True):
            axis.annotate(name, (x, y), xytext=(0, -8), textcoords="offset points", ha="center", va="top", fontsize=6.5,
                          color=SOFT)  # fmt: skip
    axis.set_aspect("equal")
    axis.margins(0.14)
    axis.set_xlabel("x (m)")
    axis.set_ylabel("y (m)")
    axis.label_outer(remove_inner_ticks=False)
    return drawn
