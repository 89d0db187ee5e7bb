"""What a valid scenario should be warned of."""

from collections.abc import Callable, Iterator
from pathlib import Path

from netsim.models.device_checks import device_findings, noise_finding, supply_finding
from netsim.models.device_tables import Device, load_battery, load_cpu, load_radio
from netsim.models.media import PhysicalMedium, UnitDiskParameters
from netsim.scenario.load import LoadedScenario
from netsim.scenario.schema import DeviceBattery
from netsim.scenario.warnings import scenario_warnings


def device_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """Traps that a valid scenario, its devices and its medium fall into, each once."""
    groups = loaded.scenario.nodes
    batteries = {group.battery.device for group in groups if isinstance(group.battery, DeviceBattery)}
    named: list[tuple[str, set[str], Callable[[str, Path], Device]]] = [
        ("radio", {group.radio for group in groups}, load_radio),
        ("cpu", {group.cpu for group in groups}, load_cpu),
        ("battery", batteries, load_battery),
    ]
    yield from scenario_warnings(loaded)
    for kind, names, load in named:
        for name in sorted(names):
            yield from (f"{kind} {name}: {each}" for each in device_findings(load(name, loaded.folder)))
    medium = loaded.scenario.medium
    if isinstance(medium, PhysicalMedium) and not isinstance(medium, UnitDiskParameters):
        for name in sorted({group.radio for group in groups}):
            finding = noise_finding(load_radio(name, loaded.folder), medium.noise_dbm)
            yield from () if finding is None else (f"radio {name}: {finding}",)
    for group in groups:
        if isinstance(group.battery, DeviceBattery):
            radio, battery = load_radio(group.radio, loaded.folder), load_battery(group.battery.device, loaded.folder)
            finding = supply_finding(radio, battery)
            yield from () if finding is None else (f"group {group.name}: {finding}",)
