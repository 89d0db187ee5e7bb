"""Device tables: YAML files in which every value has its unit in the key and its source beside it.

A scenario names a device by the name of a shipped table (`cc2420`) or by the path of one's own file, relative to the
scenario. Tables hold currents at a supply voltage, as data sheets do (a source in milliwatts: divide by `supply_v`). A
value is written `{value: 18.8, source: "data sheet, page 9"}`; one recalled or chosen also has `unverified: true`.
"""

from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from annotated_types import MinLen

from netsim.errors import ScenarioError
from netsim.models.devices import MAINS, BatteryDevice, CpuDevice, RadioDevice
from netsim.parameters import Name, NonNegative, Positive, PositiveInt, parameters
from netsim.reading import read_record
from netsim.units import NS_PER_US

Kind = Literal["radios", "cpus", "batteries"]


@parameters
class _Sourced:
    """What every value carries."""

    source: Name
    """Where it was read: document and place; or why it was chosen."""
    unverified: bool = False
    """It was recalled or chosen, not read in the source."""


@parameters
class Number(_Sourced):
    """A number with its source."""

    value: float
    """The number, in the unit that the key names."""


@parameters
class NonNegativeNumber(_Sourced):
    """A number of at least 0 with its source."""

    value: NonNegative
    """The number, in the unit that the key names."""


@parameters
class PositiveNumber(_Sourced):
    """A number above 0 with its source."""

    value: Positive
    """The number, in the unit that the key names."""


@parameters
class PositiveCount(_Sourced):
    """A whole number above 0 with its source."""

    value: PositiveInt
    """The number, in the unit that the key names."""


@parameters
class RadioTable:
    """A radio's table. Currents are at `supply_v`; sleep is the power-down state."""

    name: Name
    """The chip."""
    supply_v: PositiveNumber
    """Supply voltage."""
    bitrate_bps: PositiveCount
    """Data rate on the air."""
    off_ma: NonNegativeNumber
    """Everything off."""
    sleep_ma: NonNegativeNumber
    """Power-down, from which it wakes in `wake_us`."""
    idle_ma: NonNegativeNumber
    """Oscillator on, receiver and transmitter off."""
    listen_ma: NonNegativeNumber
    """Receiver on, waiting for a frame: what receiving draws."""
    receive_ma: NonNegativeNumber
    """A frame comes in."""
    transmit_ma: Annotated[dict[float, NonNegativeNumber], MinLen(1)]
    """By output power in dBm."""
    switching_ma: NonNegativeNumber
    """During turnaround and wake-up."""
    turnaround_us: NonNegativeNumber
    """From receiving to transmitting, or back."""
    wake_us: NonNegativeNumber
    """From power-down to listening."""
    sensitivity_dbm: Number
    """Weakest signal the data sheet vouches for."""
    cca_threshold_dbm: Number
    """Received power from which the channel counts as busy."""
    phy_header_byte: PositiveCount
    """What precedes the PSDU on the air."""
    max_psdu_byte: PositiveCount
    """Longest physical-layer payload."""
    symbol_us: PositiveNumber
    """Duration of a symbol."""
    preamble_lock_sinr_db: Number
    """Lowest SINR at which a preamble is caught."""

    def device(self) -> RadioDevice:
        """The radio in the simulator's units."""
        volt = self.supply_v.value
        return RadioDevice(
            name=self.name,
            supply_v=volt,
            bitrate_bps=self.bitrate_bps.value,
            off_mw=volt * self.off_ma.value,
            sleep_mw=volt * self.sleep_ma.value,
            idle_mw=volt * self.idle_ma.value,
            listen_mw=volt * self.listen_ma.value,
            receive_mw=volt * self.receive_ma.value,
            transmit_mw={dbm: volt * current.value for dbm, current in self.transmit_ma.items()},
            switching_mw=volt * self.switching_ma.value,
            turnaround_ns=round(self.turnaround_us.value * NS_PER_US),
            wake_ns=round(self.wake_us.value * NS_PER_US),
            sensitivity_dbm=self.sensitivity_dbm.value,
            cca_threshold_dbm=self.cca_threshold_dbm.value,
            phy_header_byte=self.phy_header_byte.value,
            max_psdu_byte=self.max_psdu_byte.value,
            symbol_ns=round(self.symbol_us.value * NS_PER_US),
            preamble_lock_sinr_db=self.preamble_lock_sinr_db.value,
        )


@parameters
class CpuTable:
    """A processor's table. Currents are at `supply_v`."""

    name: Name
    """The processor and its clock."""
    supply_v: PositiveNumber
    """Supply voltage."""
    active_ma: NonNegativeNumber
    """It computes."""
    sleep_ma: NonNegativeNumber
    """It waits."""
    operations_per_s: PositiveNumber
    """Elementary floating-point operations a second; say in the source which precision."""

    def device(self) -> CpuDevice:
        """The CPU in the simulator's units."""
        volt = self.supply_v.value
        return CpuDevice(
            name=self.name,
            active_mw=volt * self.active_ma.value,
            sleep_mw=volt * self.sleep_ma.value,
            operations_per_s=self.operations_per_s.value,
        )


@parameters
class BatteryTable:
    """A battery's table."""

    name: Name
    """The battery."""
    energy_j: PositiveNumber
    """Usable energy when full."""

    def device(self) -> BatteryDevice:
        """The battery as the simulator uses it."""
        return BatteryDevice(name=self.name, energy_j=self.energy_j.value)


def shipped(kind: Kind) -> list[str]:
    """Names of the device tables that come with netsim, sorted; for batteries `ideal` (mains power) too."""
    names = [path.stem for path in _directory(kind).iterdir() if path.suffix == ".yaml"]
    return sorted([*names, MAINS.name] if kind == "batteries" else names)


def load_radio(name_or_path: str, base_dir: Path) -> RadioDevice:
    """The radio of a shipped name, else of the table at a path.

    Args:
        name_or_path: A name from `shipped("radios")`, or a path.
        base_dir: What a relative path is relative to: the scenario's directory.

    Raises:
        ScenarioError: If there is neither, or the table is not valid (every finding with its line).
    """
    return read_record(_find("radios", name_or_path, base_dir), RadioTable).device()


def load_cpu(name_or_path: str, base_dir: Path) -> CpuDevice:
    """The CPU of a shipped name, else of the table at a path; arguments and errors as for `load_radio`."""
    return read_record(_find("cpus", name_or_path, base_dir), CpuTable).device()


def load_battery(name_or_path: str, base_dir: Path) -> BatteryDevice:
    """The battery of a shipped name, else of the table at a path; arguments and errors as for `load_radio`."""
    if name_or_path == MAINS.name:
        return MAINS
    return read_record(_find("batteries", name_or_path, base_dir), BatteryTable).device()


def _directory(kind: Kind) -> Path:
    return Path(str(files("netsim.models"))) / "data" / kind


def _find(kind: Kind, name_or_path: str, base_dir: Path) -> Path:
    names = shipped(kind)
    if name_or_path in names:
        return _directory(kind) / f"{name_or_path}.yaml"
    path = base_dir / name_or_path
    if path.is_file():
        return path
    near = get_close_matches(name_or_path.lower(), names, n=1)
    hint = f"; did you mean `{near[0]}`?" if near else ""
    message = f"`{name_or_path}`: expected one of {', '.join(names)}, or a file; there is no file {path}{hint}"
    raise ScenarioError(message)
