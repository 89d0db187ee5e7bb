"""`netsim check`."""

from collections.abc import Sequence
from pathlib import Path

import typer

from netsim.cli import EXIT_BAD_INPUT
from netsim.cli.check_study import check_study
from netsim.cli.console import say, tell
from netsim.errors import Finding, ScenarioError
from netsim.models.device_checks import device_findings
from netsim.models.device_tables import Device, load_device, unverified
from netsim.scenario.build import build
from netsim.scenario.device_warnings import device_warnings
from netsim.scenario.load import LoadedScenario, inspect
from netsim.study.plan import kind_of


def check_command(files: Sequence[Path], overrides: Sequence[str], *, plugins: bool) -> None:
    """Check each file, a scenario or a device table; exit status 2 if any has findings. Warnings do not count."""
    wrong = sum(_check(file, overrides, plugins) for file in files)
    if wrong:
        tell(f"{wrong} error{'s' if wrong > 1 else ''}")
        raise typer.Exit(EXIT_BAD_INPUT)


def _check(file: Path, overrides: Sequence[str], plugins: bool) -> int:
    """Check one file and say what is wrong with it; how many errors."""
    if _is_study(file):
        return check_study(file, overrides, plugins)
    loaded, device, findings = _checked(file, overrides, plugins)
    for finding in findings:
        tell(str(finding))
    if device is not None:
        _tell_device(file, device)
    elif loaded is not None and not findings:
        _tell(loaded)
    return len(findings)


def _checked(
    file: Path, overrides: Sequence[str], plugins: bool
) -> tuple[LoadedScenario | None, Device | None, list[Finding | str]]:
    """A scenario or device and everything wrong with it: the file itself, then what shows only when it is built."""
    try:
        device = None if overrides else load_device(file)
        if device is not None:
            return None, device, []
        loaded, findings = inspect(file, overrides, plugins=plugins)
        if loaded is not None:
            build(loaded)
    except ScenarioError as error:
        return None, None, list(error.findings) or [str(error)]
    return loaded, None, list(findings)


def _is_study(file: Path) -> bool:
    try:
        return kind_of(file) == "study"
    except ScenarioError:  # told of below
        return False


def _tell_device(file: Path, device: Device) -> None:
    kind = type(device).__name__.removesuffix("Device").lower()
    say(f"{file}: ok ({kind} {device.name})")
    keys, count = unverified(file)
    if keys:
        say(f"  {len(keys)} of {count} values are recalled or chosen, not read in a source: {', '.join(keys)}")
    for warning in device_findings(device):
        tell(f"warning: {warning}")


def _tell(loaded: LoadedScenario) -> None:
    scenario = loaded.scenario
    say(f"{loaded.path}: ok ({scenario.name})")
    for name, entry in sorted(loaded.registry.found.items()):
        if ":" in name:
            say(f"  {name} was imported: {entry.summary}")
    for warning in device_warnings(loaded):
        tell(f"warning: {warning}")
