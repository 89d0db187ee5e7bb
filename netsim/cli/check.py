"""`netsim check`."""

from collections.abc import Sequence
from pathlib import Path

import typer

from netsim.cli import EXIT_BAD_INPUT
from netsim.cli.console import say, tell
from netsim.errors import Finding, ScenarioError
from netsim.models.device_tables import load_radio
from netsim.models.devices import device_findings
from netsim.scenario.build import build
from netsim.scenario.load import LoadedScenario, inspect


def check_command(files: Sequence[Path], overrides: Sequence[str], *, plugins: bool) -> None:
    """Check each file; exit status 2 if any has findings."""
    wrong = 0
    for file in files:
        loaded, findings = _checked(file, overrides, plugins)
        for finding in findings:
            tell(str(finding))
        wrong += len(findings)
        if loaded is not None and not findings:
            _tell(loaded)
    if wrong:
        tell(f"{wrong} error{'s' if wrong > 1 else ''}")
        raise typer.Exit(EXIT_BAD_INPUT)


def _checked(file: Path, overrides: Sequence[str], plugins: bool) -> tuple[LoadedScenario | None, list[Finding | str]]:
    """A scenario and everything wrong with it: the file itself, then what shows only when it is built."""
    try:
        loaded, findings = inspect(file, overrides, plugins=plugins)
        if loaded is not None:
            build(loaded)
    except ScenarioError as error:
        return None, list(error.findings) or [str(error)]
    return loaded, list(findings)


def _tell(loaded: LoadedScenario) -> None:
    scenario = loaded.scenario
    say(f"{loaded.path}: ok ({scenario.name})")
    for name, entry in sorted(loaded.registry.found.items()):
        if ":" in name:
            say(f"  {name} was imported: {entry.summary}")
    for radio in sorted({group.radio for group in scenario.nodes}):
        for warning in device_findings(load_radio(radio, loaded.folder)):
            tell(f"warning: radio {radio}: {warning}")
