"""The energy of each node on the map, a panel a variant, one scale of colours for all of them."""

import math
from collections.abc import Iterator
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from netsim.study.plots.style import INK, SOFT, Plot, panels, shorten
from netsim.study.reporting.numbers import Scale, number, scale_for
from netsim.study.reporting.view import View

MOST_PANELS = 9
MOST_NAMES = 16
"""So many nodes have their names written beside them."""
SIMILAR = 0.2
"""Below this share of the mean, what matters are the differences between nodes."""
ENERGY = "energy_j"


def node_plots(view: View) -> Iterator[Plot]:
    """The map, if positions and energies are known."""
    nodes = view.results.nodes
    if nodes.empty or not {"x_m", "y_m", ENERGY, "node"} <= set(nodes.columns):
        return
    chosen = _chosen(view)
    maps = {variant: found for variant in chosen if len(found := _means(nodes[nodes["variant"] == variant]))}
    if maps:
        yield _plot(view, maps, moved=_moved(nodes))


def _chosen(view: View) -> list[int]:
    """All variants if they are few, else the Pareto sets and those at the start."""
    if len(view.variants) <= MOST_PANELS:
        return list(view.variants)
    members = [each for cost in view.costs for found in view.settings.values() for each in view.pareto(cost, found)]
    return sorted(list(dict.fromkeys((*members, *view.variants)))[:MOST_PANELS])


def _means(nodes: pd.DataFrame) -> pd.DataFrame:
    """Each node's mean energy and its first position."""
    known = nodes[nodes[ENERGY].notna()].sort_values(["repetition", "node"])
    groups = known.astype({ENERGY: float}).groupby("node")
    firsts = groups[[name for name in ("name", "role", "x_m", "y_m") if name in known.columns]].first()
    return firsts.assign(**{ENERGY: groups[ENERGY].mean()})


def _moved(nodes: pd.DataFrame) -> bool:
    """Whether nodes stand elsewhere in another repetition."""
    spread = nodes.groupby(["variant", "node"])[["x_m", "y_m"]].agg(lambda found: found.max() - found.min())
    return bool((spread.to_numpy() > 1e-9).any())


def _plot(view: View, maps: dict[int, pd.DataFrame], *, moved: bool) -> Plot:
    relative = all(_spread(found) < SIMILAR for found in maps.values())
    values = {variant: found[ENERGY] - (found[ENERGY].min() if relative else 0.0) for variant, found in maps.items()}
    everything = pd.concat(list(values.values())).tolist()
    scale = scale_for("J", everything)
    figure, axes = _grid(maps)
    limits = (min(everything) * scale.factor, max(everything) * scale.factor)
    drawn: Any = None
    for axis, (variant, found) in zip(axes.flat, maps.items(), strict=False):
        drawn = _map(axis, found, values[variant] * scale.factor, limits)
        axis.set_title(shorten(view.name(variant), 36))
        if relative:
            axis.set_xlabel(f"x (m)    least: {_least(found)}")
    for axis in list(axes.flat)[len(maps) :]:
        axis.set_axis_off()
    label = "energy above the variant's least node" if relative else "energy of a node"
    figure.colorbar(drawn, ax=axes, label=f"{label} ({scale.unit})", shrink=0.85, pad=0.02, aspect=30)
    return Plot("energy-by-node", figure, _caption(view, maps, relative, moved), "Maps of the nodes coloured by energy")


def _caption(view: View, maps: dict[int, pd.DataFrame], relative: bool, moved: bool) -> str:
    text = "Energy that each node drew, mean over the trials, one scale of colours for all maps; sinks are squares."
    if relative:
        text += (
            " The nodes of a variant draw almost the same, most of it for listening: colours show what a node draws above "
            "the least of its variant."
        )
    if moved:
        text += " Nodes stand elsewhere in each repetition: positions are those of the first one."
    if len(maps) < len(view.variants):
        text += f" {len(maps)} of {len(view.variants)} variants; all are in nodes.csv."
    return text


def _spread(found: pd.DataFrame) -> float:
    mean = float(found[ENERGY].mean())
    return float(found[ENERGY].max() - found[ENERGY].min()) / mean if mean > 0 else math.inf


def _least(found: pd.DataFrame) -> str:
    least = float(found[ENERGY].min())
    scale = scale_for("J", [least])
    return f"{number(least * scale.factor)} {scale.unit}"


def _grid(maps: dict[int, pd.DataFrame]) -> tuple[Figure, Any]:
    columns = min(3, len(maps))
    rows = math.ceil(len(maps) / columns)
    extents = [
        (found["x_m"].max() - found["x_m"].min(), found["y_m"].max() - found["y_m"].min()) for found in maps.values()
    ]
    aspect = max((float(y) + 1e-9) / (float(x) + 1e-9) for x, y in extents)
    width = (5.4, 8.0, 9.6)[columns - 1]
    panel = (width - 1.2) / columns * min(1.4, max(0.35, aspect))
    return panels(rows, columns, rows * (panel + 0.55) + 0.2, width_in=width, sharex=True, sharey=True)


def _map(axis: Any, found: pd.DataFrame, colours: "pd.Series[float]", limits: tuple[float, float]) -> Any:
    """One variant's map; what a colour bar is made of."""
    low, high = limits
    size = min(170.0, max(12.0, 5200.0 / max(1, len(found))))
    roles = found["role"].tolist() if "role" in found.columns else [""] * len(found)
    sinks = [role == "sink" for role in roles]
    drawn = None
    for is_sink, marker, edge in ((False, "o", 0.6), (True, "s", 1.8)):
        mask = [sink == is_sink for sink in sinks]
        if any(mask):
            drawn = axis.scatter(found["x_m"][mask], found["y_m"][mask], c=colours[mask], cmap="cividis", vmin=low, vmax=high,
                                 s=size * (1.3 if is_sink else 1.0), marker=marker, edgecolors=INK, linewidths=edge,
                                 zorder=3)  # fmt: skip
    if len(found) <= MOST_NAMES and "name" in found.columns:
        for name, x, y in zip(found["name"], found["x_m"], found["y_m"], strict=True):
            axis.annotate(name, (x, y), xytext=(0, -9), textcoords="offset points", ha="center", va="top", fontsize=6.5,
                          color=SOFT)  # fmt: skip
    axis.set_aspect("equal")
    axis.margins(0.14)
    axis.set_xlabel("x (m)")
    axis.set_ylabel("y (m)")
    axis.label_outer(remove_inner_ticks=False)
    return drawn
