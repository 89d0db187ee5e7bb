"""One instant of a track on a map: belief, targets, sensors, leader with its neighbours, trails."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.lines import Line2D

from netsim.flow import look as flow_look
from netsim.snapshots import look
from netsim.snapshots.load import Place, Step, TrackRun
from netsim.snapshots.moment import Moment, Now, in_seconds

CELL_COLOURS = LinearSegmentedColormap.from_list("belief", look.CELLS)
CELL_SCALE = PowerNorm(0.5, 0.0, 1.0)
"""Square root, so that unlikely cells are seen too."""
_PALE = 0.03
_PAPER: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8}

_SQUARE: dict[str, Any] = {"marker": "s", "mfc": "none", "ls": ""}
_SENSOR: dict[str, Any] = {"marker": "D", "ls": "", "mec": look.SENSOR_EDGE, "mew": 0.5, "ms": 4.6, "zorder": 4}

_DOWN: dict[str, Any] = {"marker": "x", "ls": "", "ms": 6, "mew": 1.6, "color": look.DOWN, "zorder": 4}


def draw_panel(axes: Axes, run: TrackRun, moment: Moment) -> None:
    """Draw an instant; the axes are in metres."""
    _draw_beliefs(axes, [now.step for now in moment.tracks.values()])
    _draw_ways(axes, run, moment)
    _draw_sensors(axes, run, moment.down)
    for now in moment.tracks.values():
        _draw_leader(axes, run, now)
    _name_tracks(axes, run, moment)
    for x_m, y_m in moment.targets.values():
        axes.plot(x_m, y_m, marker="+", color="white", ms=15, mew=4.5, zorder=7)
        axes.plot(x_m, y_m, marker="+", color=look.TARGET, ms=13, mew=2.4, zorder=8)
    frame(axes, run)
    axes.set_title(in_seconds(moment.time_ns), loc="left")
    axes.set_title(said(run, moment), loc="right", fontsize=8, fontweight="normal", color=flow_look.SOFT)


def said(run: TrackRun, moment: Moment) -> str:
    """Who leads, and how far the estimate is off."""
    if not moment.tracks:
        return "no belief"
    if len(moment.tracks) > 1:
        return f"{len(moment.tracks)} {'tracks' if len({track for track, _ in moment.tracks}) > 1 else 'threads'}"
    (now,) = moment.tracks.values()
    if run.is_leaderless(moment.time_ns):
        return f"no leader, last {run.names.get(now.step.node, now.step.node)}"
    who = f"{run.names.get(now.step.node, now.step.node)} leads" if now.led_m else "belief at the centre"
    if now.step.is_blank:
        return f"{who}, uniform belief"
    off_m = run.truth.nearest_m(now.step.time_ns, now.trail_m[-1]) if now.trail_m else None
    return who if off_m is None else f"{who}, {off_m:.1f} m off"


def _draw_beliefs(axes: Axes, steps: Sequence[Step]) -> None:
    """Cells coloured by their probability over that of the most probable one; pale if all are equal.

    Where several beliefs have a cell, the one to which it is most probable counts; all are on grids as the first one's.
    """
    if not steps:
        return
    grid, rows = steps[0].belief.grid, max(step.belief.grid.rows for step in steps)
    dense = np.zeros(rows * grid.columns)
    for step in steps:
        cells, probability = step.belief.cells, step.belief.probability
        relative = (_PALE if step.is_blank else 1.0) * probability / probability.max()
        dense[cells] = np.maximum(dense[cells], relative)
    masked = np.ma.masked_less_equal(dense.reshape(rows, grid.columns), 0.0)
    (left_m, low_m), cell_m = grid.origin_m, grid.cell_m
    extent = (left_m, left_m + grid.columns * cell_m, low_m, low_m + rows * cell_m)
    axes.imshow(
        masked, origin="lower", extent=extent, cmap=CELL_COLOURS, norm=CELL_SCALE, interpolation="nearest", zorder=1
    )


def _name_tracks(axes: Axes, run: TrackRun, moment: Moment) -> None:
    """One name a track; threads of one track are close, and told apart by their colours."""
    latest = {line[0]: now for line, now in moment.tracks.items() if now.trail_m}
    for track, now in latest.items() if len(latest) > 1 else ():
        name = f"track {run.ordinal((track, 0))}"
        axes.annotate(name, now.trail_m[-1], (8, -9), textcoords="offset points", fontsize=7.5, zorder=9, bbox=_PAPER)


def _draw_ways(axes: Axes, run: TrackRun, moment: Moment) -> None:
    for way in moment.ways_m.values():
        axes.plot(*columns(way), color=look.TARGET, lw=1.1, alpha=0.55, zorder=2)
    for now in moment.tracks.values():
        axes.plot(*columns(now.led_m), color=look.LEADER, lw=0.9, ls=(0, (3, 2)), alpha=0.75, zorder=3)
        colour = run.lines.index(now.step.line) % len(look.LINES)
        axes.plot(*columns(now.trail_m), color=look.LINES[colour], lw=0.9, marker=".", ms=3.2, mew=0, zorder=5)
        if now.trail_m:
            axes.plot(*now.trail_m[-1], marker="o", ms=5.5, mfc="white", mec=look.LINES[colour], mew=1.4, zorder=8)


def _draw_sensors(axes: Axes, run: TrackRun, down: Iterable[int]) -> None:
    for measures, colour in (("amplitude", look.AMPLITUDE), ("bearing", look.BEARING)):
        places = [run.places_m[node] for node, what in run.measures.items() if what == measures and node not in down]
        axes.plot(*columns(places), mfc=colour, **_SENSOR)
    broken = [run.places_m[node] for node in down if node in run.places_m]
    axes.plot(*columns(broken), **_DOWN)
    sinks = [run.places_m[node] for node in sorted(run.sinks)]
    axes.plot(*columns(sinks), ls="", marker="*", ms=13, mfc=look.CENTRE, mec="white", mew=0.8, zorder=6)


def _draw_leader(axes: Axes, run: TrackRun, now: Now) -> None:
    """The leader in a square, those it chose from in squares of another colour, an arrow to the next one."""
    if not now.led_m:
        return
    here = now.led_m[-1]
    axes.plot(*here, ms=11.5, mec=look.LEADER, mew=2.0, zorder=6, **_SQUARE)
    if now.choice is None:
        return
    others = [run.places_m[int(node)] for node in now.choice.candidate if int(node) in run.places_m]
    axes.plot(*columns(others), ms=10.5, mec=look.NEIGHBOUR, mew=1.5, zorder=6, **_SQUARE)
    following = run.places_m.get(now.choice.destination)
    if following is not None:
        arrow = {"arrowstyle": "-|>", "color": look.LEADER, "lw": 1.4, "shrinkA": 7, "shrinkB": 6, "mutation_scale": 10}
        axes.annotate("", following, here, arrowprops=arrow, zorder=7)


def frame(axes: Axes, run: TrackRun) -> None:
    """Limits of a map that holds the field and all nodes, and a line around the field."""
    if run.box_m is None:
        return
    low_x, low_y, high_x, high_y = run.box_m
    xs, ys = columns([*run.places_m.values(), (low_x, low_y), (high_x, high_y)])
    margin_m = 0.02 * max(max(xs) - min(xs), max(ys) - min(ys))
    axes.set_xlim(min(xs) - margin_m, max(xs) + margin_m)
    axes.set_ylim(min(ys) - margin_m, max(ys) + margin_m)
    axes.set_aspect("equal")
    axes.plot(
        [low_x, high_x, high_x, low_x, low_x], [low_y, low_y, high_y, high_y, low_y], color=flow_look.GRID, lw=1.0, zorder=0
    )  # fmt: skip
    axes.spines[:].set_color(flow_look.GRID)


def columns(places_m: Sequence[Place]) -> tuple[list[float], list[float]]:
    """All x and all y of some places."""
    return [x_m for x_m, _ in places_m], [y_m for _, y_m in places_m]


def legend_handles(run: TrackRun, moments: Sequence[Moment]) -> list[Line2D]:
    """What the signs mean; only those that some panel has."""
    tracks = [now for each in moments for now in each.tracks.values()]
    kinds = set(run.measures.values())
    entries: list[tuple[bool, str, dict[str, Any]]] = [
        (any(each.targets for each in moments), "target and its way", _line(look.TARGET, "+", ms=10, mew=2.2, alpha=1.0)),
        (bool(tracks), "estimate and its trail", _line(look.TRAIL, "o", ms=5.5, mfc="white", mew=1.4)),
        ("amplitude" in kinds, "amplitude sensor", {**_SENSOR, "mfc": look.AMPLITUDE}),
        ("bearing" in kinds, "bearing sensor", {**_SENSOR, "mfc": look.BEARING}),
        (any(now.led_m for now in tracks), "leader", {**_SQUARE, "ms": 10, "mec": look.LEADER, "mew": 2.0}),
        (any(now.choice for now in tracks), "its neighbours", {**_SQUARE, "ms": 10, "mec": look.NEIGHBOUR, "mew": 1.5}),
        (any(now.choice for now in tracks), "hand-off to the next leader", _line(look.LEADER, ">", ms=5, markevery=(1, 2))),
        (any(len(now.led_m) > 1 for now in tracks), "last leaders", {"color": look.LEADER, "lw": 0.9, "ls": (0, (3, 2))}),
        (bool(run.sinks), "sink", {"ls": "", "marker": "*", "ms": 12, "mfc": look.CENTRE, "mec": "white"}),
        (any(each.down for each in moments), "node that is down", _DOWN),
    ]  # fmt: skip
    return [Line2D([0, 1], [0, 0], label=label, **style) for there, label, style in entries if there]


def _line(colour: str, marker: str, **more: Any) -> dict[str, Any]:
    return {"color": colour, "lw": 1.1, "marker": marker, "markevery": (1, 2), **more}
