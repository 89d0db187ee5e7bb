"""From node groups to numbered nodes with positions and devices."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from netsim.errors import Finding, ScenarioError
from netsim.models.batteries import PeukertParameters, RakhmatovVrudhulaParameters
from netsim.models.device_tables import load_battery, load_cpu, load_radio
from netsim.models.devices import MAINS, BatteryDevice, CpuDevice, RadioDevice, lora_radio
from netsim.models.modulation import Cc2420Fit, OQpsk
from netsim.models.node_files import PlacedNode
from netsim.models.placement import positions
from netsim.models.sensors import SensorDevice, sensor_device
from netsim.reading import Path as ValuePath
from netsim.rng import Streams
from netsim.scenario.load import MOST_NODES, LoadedScenario
from netsim.scenario.schema import BatteryParameters, CapacityBattery, DeviceBattery, NodeGroup


@dataclass(frozen=True, slots=True)
class Place:
    """One node before it is built.

    Attributes:
        id: Its number.
        name: For people.
        group: The group it belongs to, with the output power worked out.
        group_index: Position of that group in the scenario.
        x_m: Position.
        y_m: Position.
        radio: Radio device.
        cpu: Processor.
        battery: Energy supply.
        sensor: Sensor; None for a node without.
    """

    id: int
    name: str
    group: NodeGroup
    group_index: int
    x_m: float
    y_m: float
    radio: RadioDevice
    cpu: CpuDevice
    battery: BatteryDevice
    sensor: SensorDevice | None


def places(loaded: LoadedScenario, streams: Streams) -> list[Place]:
    """Every node of a scenario, ascending by id.

    Nodes from a CSV file keep the ids they have there; the others take the lowest free ids in the order of the groups.

    Raises:
        ScenarioError: With every finding: missing device or CSV files, ids used twice, powers a radio does not have.
    """
    findings: list[Finding] = []
    found: list[tuple[int, PlacedNode]] = []
    for index, group in enumerate(loaded.scenario.nodes):
        with _Collected(findings, loaded, ("nodes", index, "placement")):
            found += [(index, placed) for placed in _positions(loaded, group, streams)]
    findings += _twice(loaded, found)
    devices = [_devices(loaded, index, group, findings) for index, group in enumerate(loaded.scenario.nodes)]
    findings += _foreign_radios(loaded, devices)
    if not findings and len(found) > MOST_NODES:
        message = f"{len(found)} nodes, and at most {MOST_NODES} can be simulated"
        findings.append(loaded.document.finding(("nodes",), message, ""))
    if findings:
        raise ScenarioError(findings)
    return sorted(_numbered(loaded, found, devices), key=lambda place: place.id)


def positions_m(nodes: Sequence[Place]) -> NDArray[np.float64]:
    """Positions of nodes, shape (N, 2)."""
    return np.array([(place.x_m, place.y_m) for place in nodes], dtype=float).reshape(-1, 2)


class _Collected:
    """Turns a `ScenarioError` inside the block into findings at a value of the scenario."""

    def __init__(self, findings: list[Finding], loaded: LoadedScenario, path: ValuePath) -> None:
        self._findings = findings
        self._loaded = loaded
        self._path = path

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if not isinstance(error, ScenarioError):
            return False
        if error.findings:
            self._findings.extend(error.findings)
        else:
            self._findings.append(self._loaded.document.finding(self._path, str(error), ""))
        return True


def _positions(loaded: LoadedScenario, group: NodeGroup, streams: Streams) -> list[PlacedNode]:
    field = loaded.scenario.field
    rectangle = (*field.origin_m, field.width_m, field.height_m)
    return positions(group.placement, rectangle, streams, group.name, loaded.folder)


def _twice(loaded: LoadedScenario, found: Sequence[tuple[int, PlacedNode]]) -> Iterator[Finding]:
    seen: dict[int, int] = {}
    for index, placed in found:
        if placed.id is None:
            continue
        if placed.id in seen:
            yield loaded.document.finding(
                ("nodes", index, "placement"),
                "node ids that no other group uses",
                f"id {placed.id}, which group {loaded.scenario.nodes[seen[placed.id]].name} has too",
                "renumber the nodes of one of the files",
            )
        seen[placed.id] = index


def _foreign_radios(loaded: LoadedScenario, devices: Sequence["_Devices | None"]) -> Iterator[Finding]:
    """Radios of one medium must speak the same physical layer: whatever bit rate they hear, they would decode."""
    first: RadioDevice | None = None
    for index, device in enumerate(devices):
        radio = device[0] if device is not None else None
        first = first or radio
        if radio is None or first is None:
            continue
        if _physical_layer(radio) != _physical_layer(first):
            yield loaded.document.finding(
                ("nodes", index, "radio"),
                f"a radio with the physical layer of {_named(first)}",
                _named(radio),
                "radios of different physical layers cannot share a medium: give all groups the same kind"
                + (" and the same `lora` settings" if radio.lora is not None else ""),
            )


def _physical_layer(radio: RadioDevice) -> tuple[object, ...]:
    """What two radios must have in common to hear each other. How well a modem hears may differ, its settings may not."""
    if radio.lora is not None:
        return (radio.lora.settings,)
    return radio.bitrate_bps, radio.phy_header_byte, radio.preamble_ns, radio.symbol_ns, _waveform(radio)


def _waveform(radio: RadioDevice) -> str:
    """Modulations that describe one waveform by different curves count as one."""
    return "o-qpsk" if isinstance(radio.modulation, OQpsk | Cc2420Fit) else type(radio.modulation).__name__


def _named(radio: RadioDevice) -> str:
    settings = f"{radio.bitrate_bps} bit/s, {_waveform(radio)}"
    if radio.lora is not None:
        lora = radio.lora.settings
        settings = f"LoRa SF{lora.spreading_factor}, {lora.bandwidth_khz} kHz, coding rate 4/{4 + lora.coding_rate}"
    return f"{radio.name} ({settings})"


_Devices = tuple[RadioDevice, CpuDevice, BatteryDevice, SensorDevice | None]


def _devices(loaded: LoadedScenario, index: int, group: NodeGroup, findings: list[Finding]) -> _Devices | None:
    before = len(findings)
    folder = loaded.folder
    with _Collected(findings, loaded, ("nodes", index, "radio")):
        radio = load_radio(group.radio, folder)
        if group.lora is not None:
            with _Collected(findings, loaded, ("nodes", index, "lora")):
                radio = lora_radio(radio, group.lora)
        with _Collected(
            findings, loaded, ("nodes", index, "tx_power_dbm" if group.tx_range_m is None else "tx_range_m")
        ):
            radio.transmit_power_mw(_tx_power_dbm(group, radio))
    with _Collected(findings, loaded, ("nodes", index, "cpu")):
        cpu = load_cpu(group.cpu, folder)
    with _Collected(findings, loaded, ("nodes", index, "battery", "device")):
        battery = _battery(loaded, group.battery)
        findings += _harvester_fits(loaded, index, group, battery)
    if len(findings) > before:
        return None
    has_sensor = group.role == "sensor" and group.sensor is not None
    return radio, cpu, battery, sensor_device(group.sensor) if has_sensor and group.sensor is not None else None


def _tx_power_dbm(group: NodeGroup, radio: RadioDevice) -> float:
    """A group's output power, given as such or by the range that an amplifier's formula turns into one."""
    if group.tx_range_m is None:
        return group.tx_power_dbm
    if radio.amplifier is None:
        message = f"{radio.name} has no law from range to power, as the first-order model has: give tx_power_dbm"
        raise ScenarioError(message)
    return radio.amplifier.power_for_range_dbm(group.tx_range_m, radio.bitrate_bps)


def _harvester_fits(loaded: LoadedScenario, index: int, group: NodeGroup, battery: BatteryDevice) -> Iterator[Finding]:
    """Only a linear cell knows what charging does: the laws of the others are about draining."""
    if group.harvester is None or (battery.chemistry is None and battery.energy_j != math.inf):
        return
    yield loaded.document.finding(
        ("nodes", index, "harvester"),
        "a linear battery to charge",
        "mains power" if battery.chemistry is None else f"the chemistry {battery.chemistry.type}",
        "give `battery` an energy_j, or remove the harvester",
    )


def _battery(loaded: LoadedScenario, battery: BatteryParameters) -> BatteryDevice:
    if isinstance(battery, DeviceBattery):
        return load_battery(battery.device, loaded.folder)
    if isinstance(battery, CapacityBattery):
        return BatteryDevice("capacity", battery.energy_j)
    if isinstance(battery, PeukertParameters | RakhmatovVrudhulaParameters):
        return BatteryDevice(battery.type, battery.energy_j, battery)
    return MAINS


def _numbered(
    loaded: LoadedScenario, found: Sequence[tuple[int, PlacedNode]], devices: Sequence[_Devices | None]
) -> Iterator[Place]:
    taken = {placed.id for _, placed in found if placed.id is not None}
    free = (number for number in range(len(found) + len(taken)) if number not in taken)
    for index, placed in found:
        device = devices[index]
        if device is None:
            continue
        number = next(free) if placed.id is None else placed.id
        name = placed.name or f"n{number:02d}"
        group = loaded.scenario.nodes[index]
        group = replace(group, tx_power_dbm=_tx_power_dbm(group, device[0]))
        yield Place(number, name, group, index, placed.x_m, placed.y_m, *device)
