"""Device tables: YAML files in which every value has its unit in the key and its source beside it.

A scenario names a device by the name of a shipped table (`cc2420`) or by the path of one's own file, relative to the
scenario. Tables hold currents at a supply voltage, as data sheets do (a source in milliwatts: divide by `supply_v`). A
value is written `{value: 18.8, source: "data sheet, page 9"}`; one recalled or chosen also has `unverified: true`.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

from netsim.errors import Finding, ScenarioError
from netsim.models.battery_tables import BatteryTable
from netsim.models.devices import MAINS, BatteryDevice, CpuDevice, RadioDevice
from netsim.models.radio_tables import REMEDIES, LoraRadioTable, RadioTable
from netsim.models.sourced import NonNegativeNumber, PositiveNumber
from netsim.parameters import Name, parameters
from netsim.reading import Document, read_document, validate

T = TypeVar("T")
Kind = Literal["radios", "cpus", "batteries"]
Device = RadioDevice | CpuDevice | BatteryDevice


@parameters
class CpuTable:
    """A processor's table. Currents are at `supply_v`."""

    kind: Literal["cpu"] = "cpu"
    """What this file is."""
    name: Name
    """The processor and its clock."""
    supply_v: PositiveNumber
    """Supply voltage."""
    active_ma: NonNegativeNumber
    """It computes."""
    sleep_ma: NonNegativeNumber
    """It waits, in the deepest mode from which its own timer wakes it (not a power-down that only a pin can end)."""
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
    return _read_once(_radio, find_table("radios", name_or_path, base_dir))


def load_cpu(name_or_path: str, base_dir: Path) -> CpuDevice:
    """The CPU of a shipped name, else of the table at a path; arguments and errors as for `load_radio`."""
    return _read_once(_cpu, find_table("cpus", name_or_path, base_dir))


def load_battery(name_or_path: str, base_dir: Path) -> BatteryDevice:
    """The battery of a shipped name, else of the table at a path; arguments and errors as for `load_radio`."""
    if name_or_path == MAINS.name:
        return MAINS
    return _read_once(_battery, find_table("batteries", name_or_path, base_dir))


def load_device(path: Path) -> Device | None:
    """The device of a table, whatever it is of; None if the file is no device table.

    A table says what it is with `kind: radio`, `cpu` or `battery`; one without `kind` is known by its keys.

    Raises:
        ScenarioError: If it cannot be read, or the table is not valid.
    """
    plain = read_document(path).plain()
    if not isinstance(plain, dict):
        return None
    kind = plain.get("kind")
    if kind is None:
        kind = next((name for name, keys in _KNOWN_BY.items() if keys & plain.keys()), None)
    loader = _LOADERS.get(kind) if isinstance(kind, str) else None
    return None if loader is None else loader(path)


def table_values(path: Path) -> Any:
    """What a table's file says, by its keys as they stand there; shared by all who ask, so not to be changed.

    Raises:
        ScenarioError: If the file cannot be read.
    """
    return _read_once(_plain, path)


def unverified(path: Path) -> tuple[list[str], int]:
    """Values of a table that were recalled or chosen, not read in their source, by key; and how many values there are.

    Raises:
        ScenarioError: If the file cannot be read.
    """
    found = list(_values(table_values(path), ()))
    return [".".join(keys) for keys, is_unverified in found if is_unverified], len(found)


def _values(plain: Any, keys: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Every value with a source below a mapping: its keys, and whether it is unverified."""
    if isinstance(plain, dict) and "source" in plain:
        yield keys, bool(plain.get("unverified"))
    elif isinstance(plain, dict):
        for key, below in plain.items():
            yield from _values(below, (*keys, str(key)))


def _read_once(make: Callable[[Path], T], path: Path) -> T:
    """A table is read once in a process, unless its file changes: reading it takes as long as a short run."""
    try:
        state = path.stat()
    except OSError:
        return make(path)  # which says what is wrong
    made: T = _read(make, path, state.st_mtime_ns, state.st_size)
    return made


@lru_cache(maxsize=128)
def _read(make: Callable[[Path], Any], path: Path, modified_ns: int, size_byte: int) -> Any:
    return make(path)


def _plain(path: Path) -> Any:
    return read_document(path).plain()


def _radio(path: Path) -> RadioDevice:
    document = read_document(path)
    plain: Any = document.plain()
    modulation = plain.get("modulation") if isinstance(plain, dict) else None
    is_lora = isinstance(modulation, dict) and modulation.get("type") == "lora"
    return _validated(document, LoraRadioTable).device() if is_lora else _validated(document, RadioTable).device()


def _cpu(path: Path) -> CpuDevice:
    return _validated(read_document(path), CpuTable).device()


def _battery(path: Path) -> BatteryDevice:
    return _validated(read_document(path), BatteryTable).device()


def _validated(document: Document, table: type[T]) -> T:
    """The table; of a table of another kind nothing but that is said."""
    try:
        return validate(document, table)
    except ScenarioError as error:
        of_kind = [each for each in error.findings if each.path == "kind"]
        plain = document.plain()
        remedied = [replace(each, remedy=_remedy(each, plain)) for each in of_kind or error.findings]
        raise ScenarioError(remedied or str(error)) from error


def _remedy(finding: Finding, plain: Any) -> str:
    bare = plain.get(finding.path) if isinstance(plain, dict) else None
    if isinstance(bare, int | float) and not isinstance(bare, bool):
        return REMEDIES.get(finding.path, f"write `{finding.path}: {{value: {bare:g}, source: ...}}`")
    return REMEDIES.get(finding.path, finding.remedy)


_LOADERS: Final[dict[str, Callable[[Path], Device]]] = {"radio": _radio, "cpu": _cpu, "battery": _battery}
_KNOWN_BY: Final = {
    "radio": {"listen_ma", "receive_ma", "transmit_ma"},
    "cpu": {"active_ma", "operations_per_s"},
    "battery": {"energy_j", "chemistry"},
}


def _directory(kind: Kind) -> Path:
    return Path(str(files("netsim.models"))) / "data" / kind


def find_table(kind: Kind, name_or_path: str, base_dir: Path) -> Path:
    """The file of a device table; arguments and errors as for `load_radio`."""
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
