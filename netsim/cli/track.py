"""`netsim track`."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from netsim.cli.console import counted, say, show
from netsim.cli.pictures import check_picture
from netsim.cli.replay import trace_file
from netsim.cli.tables import plain_table
from netsim.cli.track_groups import show_groups
from netsim.cli.track_times import chosen_times_ns, draw
from netsim.snapshots.load import Step, TrackRun, load_track
from netsim.snapshots.moment import moment, usual_times_ns
from netsim.units import NS_PER_S


def track_command(given: Path, out: Path | None, at_s: Sequence[float] | None, *, as_json: bool) -> None:
    """Print the steps of a track, and draw some instants if a picture is asked for."""
    check_picture(out)
    run = load_track(trace_file(given))
    if run.clouds:
        show_groups(run, out, at_s, as_json=as_json)
        return
    times_ns = chosen_times_ns([step.time_ns for step in run.steps], at_s) if at_s else None
    drawn_ns = times_ns or usual_times_ns(run)
    steps = run.steps if times_ns is None and out is None else _steps_at(run, drawn_ns)
    if as_json:
        say(json.dumps([plain_step(run, step) for step in steps], indent=1))
    else:
        _print(run, steps)
    if out is not None:
        from netsim.snapshots.picture import write_picture

        draw(lambda: write_picture(run, drawn_ns, out), drawn_ns, out, quiet=as_json)


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
