"""`netsim replay`."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from netsim.cli.console import say, tell
from netsim.cli.live import live_command
from netsim.errors import ScenarioError, TraceError
from netsim.flow.load import load_flow
from netsim.replay import ReplayOptions, check_instant, check_window, node_ids, save, screenshot, serve, view
from netsim.scenario.folder import METRICS_FILE, SCENARIO_FILE, TRACE_FILE
from netsim.study.info import INFO_FILE
from netsim.trace.reader import has_events, is_complete, trace_metadata
from netsim.trace.writer import partial_path


@dataclass(frozen=True, slots=True)
class Sinks:
    """Where a replay goes; the viewer if nowhere else.

    Attributes:
        save: A recording to write.
        serve: Serve to a browser.
        screenshot: A picture to write.
        at_s: The picture's instant.
        graph: Have the graphical model in front, not the map.
        live: Watch a run that is still going.
    """

    save: Path | None
    serve: bool
    screenshot: Path | None
    at_s: float | None
    graph: bool = False
    live: bool = False


def trace_file(given: Path, *, with_events: bool = True) -> Path:
    """The trace itself, where the folder of a run was given; what a killed run left if there is nothing else.

    Args:
        given: A trace, or the folder of a run.
        with_events: Whether one that was cut short before its first events is refused.

    Raises:
        ScenarioError: If there is no trace, or it cannot be read.
    """
    path = given / TRACE_FILE if given.is_dir() else given
    partial = partial_path(path)
    if not path.exists() and partial.exists():
        tell(f"warning: the run was not finished; showing what it left, {partial}")
        path = partial
    if given.is_dir() and not path.exists():
        raise ScenarioError(_nothing_in(given))
    try:
        trace_metadata(path)
        is_empty = with_events and not has_events(path) and not is_complete(path)
    except TraceError as error:
        raise ScenarioError(str(error)) from error
    if is_empty:
        message = (
            f"{path}: expected a trace with events, got one that is cut short before its first ones; copy the file "
            "again, or run the scenario again"
        )
        raise ScenarioError(message)
    return path


def _nothing_in(folder: Path) -> str:
    """Why there is no trace in a folder, and what to do."""
    expected = f"{folder}: expected the folder of a run with its {TRACE_FILE}, got"
    if (folder / INFO_FILE).exists():
        return f"{expected} that of a study, whose trials keep no traces; run one by its command in results.csv"
    if (folder / METRICS_FILE).exists():
        return f"{expected} a run that wrote none; run it again without --no-trace: netsim run {folder / SCENARIO_FILE}"
    return f"{expected} one without any; give the folder that `netsim run` wrote"


def replay_command(
    given: Path,
    start_s: float,
    end_s: float | None,
    kinds: str | None,
    nodes: str | None,
    speed: float | None,
    hold_s: float | None,
    sinks: Sinks,
) -> None:
    """Convert a trace and send it where the user wants it."""
    options = ReplayOptions(
        start_s=start_s, end_s=end_s, speed=speed, hold_s=hold_s, kinds=names(kinds), graph=sinks.graph
    )
    _check(options, sinks)
    if sinks.live:
        _check_live(sinks)
        live_command(given, options, nodes, serve=sinks.serve)
        return
    trace = trace_file(given)
    if nodes is not None:
        options = replace(options, nodes=node_ids(trace, [part.strip() for part in nodes.split(",")]))
    check_window(trace, options)
    if options.graph:
        load_flow(trace)  # says what is missing
    _show(trace, options, sinks)


def _show(trace: Path, options: ReplayOptions, sinks: Sinks) -> None:
    if sinks.at_s is not None:
        check_instant(trace, sinks.at_s)
    if sinks.save is not None:
        save(trace, sinks.save, options)
        say(f"wrote {sinks.save}; open it with: rerun {sinks.save}")
    if sinks.screenshot is not None and sinks.at_s is not None:
        for report in screenshot(trace, sinks.screenshot, sinks.at_s, options):
            tell(f"warning: {report}")
        say(f"wrote {sinks.screenshot}")
    if sinks.serve:
        serve(trace, options, announce=lambda address: tell(f"open {address} in a browser; Ctrl-C ends"))
    elif sinks.save is None and sinks.screenshot is None:
        view(trace, options)


def names(given: str | None) -> frozenset[str] | None:
    """What a list with commas names."""
    return None if given is None else frozenset(part.strip() for part in given.split(","))


def _check_live(sinks: Sinks) -> None:
    for option, given in (("--save", sinks.save), ("--screenshot", sinks.screenshot), ("--graph", sinks.graph)):
        if given:
            message = f"{option}: expected a finished run, got --live; leave out one of the two"
            raise ScenarioError(message)


def _check(options: ReplayOptions, sinks: Sinks) -> None:
    if (sinks.screenshot is None) != (sinks.at_s is None):
        message = "--screenshot and --at go together: a picture is of an instant, as in --screenshot map.png --at 12.5"
        raise ScenarioError(message)
    if options.end_s is not None and options.end_s <= options.start_s:
        message = f"--end: expected a time after --start ({options.start_s:g} s), got {options.end_s:g} s"
        raise ScenarioError(message)
    for option, path, ending in (("--save", sinks.save, ".rrd"), ("--screenshot", sinks.screenshot, ".png")):
        if path is not None:
            _check_file(option, path, ending)
    for name, value in (("--speed", options.speed), ("--hold", options.hold_s)):
        if value is not None and not 0 < value < math.inf:
            message = f"{name}: expected a number > 0, got {value:g}"
            raise ScenarioError(message)


def _check_file(option: str, path: Path, ending: str) -> None:
    """Refuse a name before anything is made; its ending keeps traces from being replaced."""
    if path.suffix.lower() != ending:
        message = f"{option} {path}: expected the name of a file that ends in {ending}"
    elif path.is_dir():
        message = f"{option} {path}: expected the name of a file, got that of a folder"
    elif not path.absolute().parent.is_dir():
        message = f"{option} {path}: expected a folder that exists, got {path.parent}; make it, or name another"
    else:
        return
    raise ScenarioError(message)
