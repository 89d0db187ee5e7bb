"""`netsim run`."""

import shlex
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import typer

from netsim.cli import EXIT_FAILURE, EXIT_INTERRUPTED
from netsim.cli.console import say, show, tell
from netsim.cli.progress import watched
from netsim.cli.summary import summary_table
from netsim.errors import ScenarioError
from netsim.scenario.device_warnings import device_warnings
from netsim.scenario.folder import new_folder
from netsim.scenario.load import load
from netsim.scenario.run import Result, run
from netsim.study.plan import kind_of


def run_command(
    scenario: Path, overrides: Sequence[str], wanted: Path | None, *, force: bool, trace: bool, plugins: bool
) -> None:
    """Run, write, summarise; the exit status says how it went."""
    if kind_of(scenario) == "study":
        message = f"{scenario} is a study, not a scenario: run it with `netsim study {scenario}`"
        raise ScenarioError(message)
    loaded = load(scenario, overrides, plugins=plugins)
    folder = new_folder(wanted, loaded.scenario.name, force)
    with watched() as watch:
        result = run(loaded, folder=folder, trace=trace, progress=watch)
    show(summary_table(result, loaded))
    for warning in device_warnings(loaded):
        tell(f"warning: {warning}")
    _tell_files(result)
    _tell_troubles(result)
    if result.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if result.failures:
        raise typer.Exit(EXIT_FAILURE)


def _tell_files(result: Result) -> None:
    say(f"Results in {result.folder}: metrics.json, run.json, scenario.yaml" + (", trace.mcap" if result.trace else ""))
    if result.trace:
        say(f"Watch it: netsim replay {shlex.quote(str(result.trace))}")
        if "beliefs" in result.metrics:
            say(f"Draw it: netsim track {shlex.quote(str(result.folder))} --out track.png")


def _tell_troubles(result: Result) -> None:
    if result.interrupted:
        tell("interrupted: the figures cover the part that was simulated")
    nodes_by_failure: dict[str, list[int]] = {}
    for node, failure in result.failures.items():
        nodes_by_failure.setdefault(str(failure), []).append(node)
    for text, nodes in nodes_by_failure.items():
        tell(f"error: node{'s' if len(nodes) > 1 else ''} {_listed(nodes)}: {text}")
    first = next(iter(result.failures.values()), None)
    if first is not None and "--debug" in sys.argv[1:]:
        tell("".join(traceback.format_exception(first.__cause__ or first)).rstrip())


def _listed(nodes: Sequence[int]) -> str:
    shown = ", ".join(map(str, nodes[:8]))
    return shown if len(nodes) <= 8 else f"{shown} and {len(nodes) - 8} more"
