"""`netsim run`."""

from collections.abc import Sequence
from pathlib import Path

import typer

from netsim.cli import EXIT_FAILURE, EXIT_INTERRUPTED
from netsim.cli.console import err, out
from netsim.cli.progress import watched
from netsim.cli.summary import summary_table
from netsim.scenario.load import load
from netsim.scenario.run import Result, new_folder, run


def run_command(
    scenario: Path, overrides: Sequence[str], wanted: Path | None, *, force: bool, trace: bool, plugins: bool
) -> None:
    """Run, write, summarise; the exit status says how it went."""
    loaded = load(scenario, overrides, plugins=plugins)
    folder = new_folder(wanted, loaded.scenario.name, force)
    with watched() as watch:
        result = run(loaded, folder=folder, trace=trace, progress=watch)
    out.print(summary_table(result, loaded))
    _tell_files(result)
    _tell_troubles(result)
    if result.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if result.failures:
        raise typer.Exit(EXIT_FAILURE)


def _tell_files(result: Result) -> None:
    out.print(
        f"Results in {result.folder}: metrics.json, run.json, scenario.yaml" + (", trace.mcap" if result.trace else "")
    )
    if result.trace:
        out.print(f"Watch it: netsim replay {result.trace}")


def _tell_troubles(result: Result) -> None:
    if result.interrupted:
        err.print("interrupted: the figures cover the part that was simulated")
    for node, failure in list(result.failures.items())[:5]:
        err.print(f"error: node {node}: {failure}", markup=False)
    if len(result.failures) > 5:
        err.print(f"error: and {len(result.failures) - 5} more nodes")
