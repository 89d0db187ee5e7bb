"""`netsim replay`."""

from dataclasses import dataclass
from pathlib import Path

from netsim.cli.console import err, out
from netsim.errors import ScenarioError
from netsim.replay import ReplayOptions, save, screenshot, serve, view
from netsim.scenario.run import TRACE_FILE


@dataclass(frozen=True, slots=True)
class Sinks:
    """Where a replay goes; the viewer if nowhere else.

    Attributes:
        save: A recording to write.
        serve: Serve to a browser.
        screenshot: A picture to write.
        at_s: The picture's instant.
    """

    save: Path | None
    serve: bool
    screenshot: Path | None
    at_s: float | None


def trace_file(given: Path) -> Path:
    """The trace itself, where the folder of a run was given."""
    return given / TRACE_FILE if given.is_dir() else given


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
    trace = trace_file(given)
    options = ReplayOptions(
        start_s=start_s,
        end_s=end_s,
        speed=speed,
        hold_s=hold_s,
        kinds=None if kinds is None else frozenset(part.strip() for part in kinds.split(",")),
        nodes=None if nodes is None else frozenset(_ids(nodes)),
    )
    _check(options, sinks)
    if sinks.save is not None:
        save(trace, sinks.save, options)
        out.print(f"wrote {sinks.save}; open it with: rerun {sinks.save}")
    if sinks.screenshot is not None and sinks.at_s is not None:
        for report in screenshot(trace, sinks.screenshot, sinks.at_s, options):
            err.print(f"warning: {report}", markup=False)
        out.print(f"wrote {sinks.screenshot}")
    if sinks.serve:
        serve(trace, options, announce=lambda address: err.print(f"open {address} in a browser; Ctrl-C ends"))
    elif sinks.save is None and sinks.screenshot is None:
        view(trace, options)


def _check(options: ReplayOptions, sinks: Sinks) -> None:
    if (sinks.screenshot is None) != (sinks.at_s is None):
        message = "--screenshot and --at go together: a picture is of an instant, as in --screenshot map.png --at 12.5"
        raise ScenarioError(message)
    if options.end_s is not None and options.end_s <= options.start_s:
        message = f"--end: expected a time after --start ({options.start_s:g} s), got {options.end_s:g} s"
        raise ScenarioError(message)
    for name, value in (("--speed", options.speed), ("--hold", options.hold_s)):
        if value is not None and value <= 0:
            message = f"{name}: expected a number > 0, got {value:g}"
            raise ScenarioError(message)


def _ids(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError as error:
        message = f"--nodes: expected node ids separated by commas, as in 0,7,12, got {text!r}"
        raise ScenarioError(message) from error
