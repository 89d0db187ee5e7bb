"""`netsim track`."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from netsim.cli.console import counted, say, show
from netsim.cli.pictures import check_picture
from netsim.cli.replay import trace_file
from netsim.cli.tables import plain_table
from netsim.errors import ScenarioError
from netsim.snapshots.load import Step, TrackRun, load_track
from netsim.snapshots.moment import HOLD_S, SOON_S, moment, usual_times_ns
from netsim.units import NS_PER_S, s_to_ns


def track_command(given: Path, out: Path | None, at_s: Sequence[float] | None, *, as_json: bool) -> None:
    """Print the steps of a track, and draw some instants if a picture is asked for."""
    check_picture(out)
    run = load_track(trace_file(given))
    times_ns = chosen_times_ns(run, at_s) if at_s else None
    drawn_ns = times_ns or usual_times_ns(run)
    steps = run.steps if times_ns is None and out is None else _steps_at(run, drawn_ns)
    if as_json:
        say(json.dumps([plain_step(run, step) for step in steps], indent=1))
    else:
        _print(run, steps)
    if out is not None:
        _draw(run, drawn_ns, out, quiet=as_json)


def chosen_times_ns(run: TrackRun, at_s: Sequence[float]) -> list[int]:
    """The instants asked for, in order, each once; if a belief is told right after one, because it took time, that of it.

    Raises:
        ScenarioError: For one at which there is no belief yet, or none any more.
    """
    first_s, last_s = run.steps[0].time_ns / NS_PER_S, run.steps[-1].time_ns / NS_PER_S
    for time_s in at_s:
        if not first_s <= time_s <= last_s + HOLD_S:
            message = (
                f"--at: expected instants from {first_s:g} s, that of the first belief, to {last_s + HOLD_S:g} s, "
                f"{HOLD_S:g} s after the last one, got {time_s:g} s"
            )
            raise ScenarioError(message)
    told_ns = np.array(sorted({step.time_ns for step in run.steps}))
    asked_ns = np.array([s_to_ns(time_s) for time_s in at_s])
    following_ns = told_ns[np.minimum(np.searchsorted(told_ns, asked_ns), len(told_ns) - 1)]
    soon = (following_ns >= asked_ns) & (following_ns <= asked_ns + s_to_ns(SOON_S))
    return [int(time_ns) for time_ns in np.unique(np.where(soon, following_ns, asked_ns))]


def plain_step(run: TrackRun, step: Step) -> dict[str, Any]:
    """A step for JSON, nodes by name."""
    choice = run.choice(step)
    x_m, y_m = step.belief.mean_m.tolist()
    return {
        "time_s": step.time_ns / NS_PER_S,
        "track": step.line[0],
        "thread": step.line[1],
        "step": step.number,
        "node": _name(run, step.node),
        "leads": step.node in run.leaders,
        "estimate_m": [x_m, y_m],
        "error_m": run.truth.nearest_m(step.time_ns, (x_m, y_m)),
        "variance_m2": step.belief.variance_m2,
        "cells": len(step.belief.cells),
        "neighbours": [] if choice is None else [_name(run, int(node)) for node in choice.candidate],
        "utility": [] if choice is None else [float(value) for value in choice.utility],
        "next": None if choice is None else _name(run, choice.destination),
        "form": None if choice is None else choice.form,
        "payload_byte": None if choice is None else int(choice.payload_byte),
    }


def _name(run: TrackRun, node: int) -> str:
    return run.names.get(node, str(node))


def _steps_at(run: TrackRun, times_ns: Sequence[int]) -> list[Step]:
    """The last belief of each track at these instants."""
    found = [now.step for time_ns in times_ns for now in moment(run, time_ns).tracks.values()]
    return list({(step.time_ns, step.line): step for step in found}.values())


def _print(run: TrackRun, steps: Sequence[Step]) -> None:
    hands_over = bool(run.choices)
    last = ("chose", "neighbours", "byte") if hands_over else ()
    heads = (*(("track", "thread") if run.has_threads else ("track",)), "error m", "spread m", "cells")
    table = plain_table(f"Track: {run.title}", ("s", "leader" if hands_over else "node"), (*heads, *last))
    for step in steps:
        table.add_row(*_cells(run, step), *(_chosen(run, step) if hands_over else ()))
    show(table)
    spread = "spread: root of the belief's variance"
    say(f"{counted(len(run.steps), 'belief')}, {counted(len(run.choices), 'choice')} of a next leader; {spread}")


def _cells(run: TrackRun, step: Step) -> tuple[str, ...]:
    x_m, y_m = step.belief.mean_m.tolist()
    off_m = run.truth.nearest_m(step.time_ns, (x_m, y_m))
    sizes = "-" if off_m is None else f"{off_m:.2f}", f"{math.sqrt(step.belief.variance_m2):.2f}"
    line = str(run.ordinal(step.line)), *((str(step.line[1] + 1),) if run.has_threads else ())
    who = f"{step.time_ns / NS_PER_S:.3f}", _name(run, step.node), *line
    return *who, *sizes, f"{len(step.belief.cells)}"


def _chosen(run: TrackRun, step: Step) -> tuple[str, str, str]:
    choice = run.choice(step)
    if choice is None:
        return "-", "-", "-"
    return _name(run, choice.destination), f"{len(choice.candidate)}", f"{choice.payload_byte:,}"


def _draw(run: TrackRun, times_ns: Sequence[int], out: Path, *, quiet: bool) -> None:
    from netsim.snapshots.picture import MOST_PANELS, write_picture

    if len(times_ns) > MOST_PANELS:
        message = f"--at: expected at most {MOST_PANELS} instants in one picture, got {len(times_ns)}; draw several"
        raise ScenarioError(message)
    write_picture(run, times_ns, out)
    if not quiet:
        say(f"wrote {out}")
