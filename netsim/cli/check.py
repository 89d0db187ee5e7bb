"""`netsim check`."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import typer

from netsim.cli import EXIT_BAD_INPUT
from netsim.cli.console import say, tell
from netsim.errors import Finding, ScenarioError
from netsim.models.device_checks import device_findings, noise_finding, supply_finding
from netsim.models.device_tables import Device, load_battery, load_cpu, load_device, load_radio, unverified
from netsim.models.media import PhysicalMedium, UnitDiskParameters
from netsim.scenario.build import build
from netsim.scenario.load import LoadedScenario, inspect
from netsim.scenario.schema import DeviceBattery
from netsim.scenario.warnings import scenario_warnings


def check_command(files: Sequence[Path], overrides: Sequence[str], *, plugins: bool) -> None:
    """Check each file, a scenario or a device table; exit status 2 if any has findings. Warnings do not count."""
    wrong = sum(_check(file, overrides, plugins) for file in files)
    if wrong:
        tell(f"{wrong} error{'s' if wrong > 1 else ''}")
        raise typer.Exit(EXIT_BAD_INPUT)


def device_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """Traps that a valid scenario, its devices and its medium fall into, each once."""
    groups = loaded.scenario.nodes
    batteries = {group.battery.device for group in groups if isinstance(group.battery, DeviceBattery)}
    named: list[tuple[str, set[str], Callable[[str, Path], Device]]] = [
        ("radio", {group.radio for group in groups}, load_radio),
        ("cpu", {group.cpu for group in groups}, load_cpu),
        ("battery", batteries, load_battery),
    ]
    yield from (f"warning: {each}" for each in scenario_warnings(loaded))
    for kind, names, load in named:
        for name in sorted(names):
            yield from (f"warning: {kind} {name}: {each}" for each in device_findings(load(name, loaded.folder)))
    medium = loaded.scenario.medium
    if isinstance(medium, PhysicalMedium) and not isinstance(medium, UnitDiskParameters):
        for name in sorted({group.radio for group in groups}):
            finding = noise_finding(load_radio(name, loaded.folder), medium.noise_dbm)
            yield from () if finding is None else (f"warning: radio {name}: {finding}",)
    for group in groups:
        if isinstance(group.battery, DeviceBattery):
            radio, battery = load_radio(group.radio, loaded.folder), load_battery(group.battery.device, loaded.folder)
            finding = supply_finding(radio, battery)
            yield from () if finding is None else (f"warning: group {group.name}: {finding}",)


def _check(file: Path, overrides: Sequence[str], plugins: bool) -> int:
    """Check one file and say what is wrong with it; how many errors."""
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
        tell(warning)
