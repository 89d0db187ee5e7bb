"""Where the energy goes: stacked by device state and by message kind, with and without listening."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from netsim.metrics.energy import STANDING
from netsim.study.plots.rows import kept_rows, label_rows, left_out, row_height_in, row_labels
from netsim.study.plots.style import STACK, Plot, panels
from netsim.study.reporting.numbers import scale_for
from netsim.study.reporting.view import View

STATES, KINDS = "energy_by_state_j.", "energy_by_kind_j."
NO_KIND = "(none)"
OTHER = "other"
MOST_PARTS = 11
OTHER_COLOUR = "#E9EDF1"
KNOWN_STATES = (
    *("radio.overhear", "radio.receive", "radio.transmit", "radio.switch", "radio.retransmit", "radio.ack_receive"),
    *("radio.ack_transmit", "cpu.active", "radio.strobe_transmit", "radio.strobe_receive", "radio.wake"),
    "sensor.sample",
)
"""States of devices with a colour of their own, in the order of `STACK`."""
KNOWN_STANDING = ("radio.listen", "radio.sleep", "cpu.sleep", "radio.idle")
"""Likewise, of those that go on by themselves, in the order of the greys."""


def energy_plots(view: View) -> Iterator[Plot]:
    """A figure by device state and one by message kind, each with a panel of all and one without what goes on anyway."""
    states, kinds = means_by(view, STATES), means_by(view, KINDS)
    if not states.empty:
        standing = [name for name in states.columns if _is_standing(name)]
        caption = (
            "Energy over all nodes by device and state, mean over the trials. Left: all of it; a radio that listens all the "
            "time draws almost everything there. Right: without listening, sleep and idling, on a scale of its own."
        )
        yield _plot(view, states, standing, "energy-by-state", caption)
    if not kinds.empty:
        caption = (
            "The same by kind of the message served: sending, receiving, overhearing and computing. Left: with what serves "
            "no message (listening above all). Right: without it, on a scale of its own."
        )
        yield _plot(view, kinds, [NO_KIND], "energy-by-kind", caption)


def means_by(view: View, prefix: str) -> pd.DataFrame:
    """Mean joules by variant (rows) and entry of a dictionary of metrics (columns), the largest first.

    An entry that a run does not have is 0 there. All variants that ended are there, whatever is shown of them.
    """
    names = [name for name in view.ended.columns if str(name).startswith(prefix)]
    found = view.ended[["variant", *names]].astype(float).fillna(0.0).groupby("variant").mean()
    found.index = found.index.astype(int)
    found.columns = [name.removeprefix(prefix) for name in found.columns]
    found = found.loc[:, found.sum() > 0]
    return found[sorted(found.columns, key=lambda name: (-found[name].sum(), name))]


def _plot(view: View, means: pd.DataFrame, standing: Sequence[str], stem: str, caption: str) -> Plot:
    there = [variant for variant in view.variants if variant in means.index]
    levels = [view.levels(variant) for variant in there]
    kept = kept_rows(view.info.axes, levels)
    caption += left_out(view.info.axes, levels, kept)
    chosen = [there[place] for place in kept]
    labels = row_labels([view.name(variant) for variant in chosen])
    means = _folded(means.loc[chosen], standing)
    colours = _colours(means, standing)
    without = means.drop(columns=[name for name in standing if name in means.columns])
    shown = [table for table in (means, without) if table.to_numpy().sum() > 0]
    height_in = row_height_in(labels, 0.27) * len(chosen)
    figure, axes = panels(1, len(shown), 1.5 + height_in + 0.2 * len(colours) / 4, sharey=True)
    titles = ("all", "without what serves no message" if NO_KIND in standing else "without listening, sleep and idling")
    for axis, table, title in zip(axes.flat, shown, titles, strict=False):
        _stack(axis, table, colours)
        axis.set_title(title)
    label_rows(axes[0][0], labels)
    handles, parts = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, parts, loc="outside lower center", ncols=min(4, len(parts)))
    return Plot(stem, figure, caption, f"Stacked bars of energy by variant, {stem.replace('-', ' ')}")


def _folded(means: pd.DataFrame, standing: Sequence[str]) -> pd.DataFrame:
    """The largest parts; the others, if there are too many, as one."""
    moving = [name for name in means.columns if name not in standing]
    kept = [name for name in means.columns if name in standing or name in moving[:MOST_PARTS]]
    left = means.drop(columns=kept)
    return means[kept].assign(**{OTHER: left.sum(axis=1)}) if len(left.columns) else means[kept]


def _colours(means: pd.DataFrame, standing: Sequence[str]) -> dict[str, str]:
    """Of each part, those of what goes on anyway first; a known state of a device has one colour in all studies."""
    moving = [name for name in means.columns if name not in standing and name != OTHER]
    rest = [name for name in means.columns if name in standing]
    greys = [f"#{level:02X}{level + 6:02X}{level + 12:02X}" for level in range(0xCB, 0x6B, -0x18)]
    return {
        **_dealt(rest, greys, KNOWN_STANDING),
        **_dealt(moving, STACK, KNOWN_STATES),
        **({OTHER: OTHER_COLOUR} if OTHER in means.columns else {}),
    }


def _dealt(names: Sequence[str], colours: Sequence[str], known: Sequence[str]) -> dict[str, str]:
    """A colour for each name: the known ones their own, the others what is left, in their order."""
    own = {name: colours[known.index(name) % len(colours)] for name in names if name in known}
    free = [colour for colour in colours if colour not in own.values()] or list(colours)
    others = [name for name in names if name not in own]
    dealt = {name: free[place % len(free)] for place, name in enumerate(others)}
    return {name: (own | dealt)[name] for name in names}


def _stack(axis: Any, means: pd.DataFrame, colours: dict[str, str]) -> None:
    scale = scale_for("J", [float(means.sum(axis=1).max())])
    left = [0.0] * len(means)
    for name in (each for each in colours if each in means.columns):
        widths = [value * scale.factor for value in means[name].tolist()]
        axis.barh(range(len(means)), widths, left=left, height=0.72, color=colours[name], label=name, linewidth=0)
        left = [start + width for start, width in zip(left, widths, strict=True)]
    axis.set_xlabel(f"energy ({scale.unit})")
    axis.set_xlim(0, max(left) * 1.02)
    axis.grid(visible=False, axis="y")


def _is_standing(name: str) -> bool:
    device, _, state = name.partition(".")
    return state in STANDING.get(device, frozenset())
