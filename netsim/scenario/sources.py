"""The sources of what a scenario uses, and of everything that comes with netsim."""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

from netsim.algorithms.registry import SHIPPED, Entry
from netsim.models.device_sources import table_source
from netsim.models.device_tables import Kind, load_battery, load_radio, shipped
from netsim.models.devices import RadioDevice
from netsim.models.media import IdealMediumParameters, MediumParameters, PhysicalMedium, TraceMediumParameters
from netsim.scenario.citations import ASPECTS, ASYMMETRY, CITED, HARDWARE, NAMES, OWN, RECEPTION, SHADOWING, Aspect
from netsim.scenario.load import LoadedScenario
from netsim.scenario.schema import DeviceBattery, NodeGroup

_PART_OF: Mapping[Kind, str] = {"radios": "radio", "cpus": "processor", "batteries": "battery table"}
_HERE = Path()
_REFERENCE = re.compile(r" \((?:Rappaport, [^()]*|[^()]*\b\d{4}\b[^()]*)\)")
"""A reference inside a summary: the citation says it in full."""


@dataclasses.dataclass(frozen=True, slots=True)
class Source:
    """Where a part of a simulation comes from.

    Attributes:
        part: Which part: `algorithm`, `MAC`, `fading`, ...
        name: What it is called there: `csmp`, `csma`, `rayleigh`, ...
        summary: What it is, in one line.
        citation: The paper, standard or data sheet with its section; or that netsim chose it by itself.
    """

    part: str
    name: str
    summary: str
    citation: str


def sources_of(loaded: LoadedScenario) -> list[Source]:
    """The sources of what a scenario uses: its algorithms, problem, models and devices, each once.

    Args:
        loaded: The scenario, with its rung of fidelity climbed.

    Raises:
        ScenarioError: If a device table cannot be read.
    """
    scenario = loaded.scenario
    found = [_of_algorithm(entry) for entry in _algorithms(loaded)]
    found += [_of_record(type(record)) for record in _records(scenario) if type(record) in CITED]
    found += [Source(*aspect) for aspect in _aspects(scenario.medium)]
    for group in scenario.nodes:
        found += _of_devices(group, loaded.folder, uses_modulation=_uses_modulation(scenario.medium))
    return list(dict.fromkeys(found))


def everything() -> dict[str, list[Source]]:
    """Everything that a scenario can name with its source, by part: algorithms first, device tables last."""
    found = [_of_algorithm(entry) for entry in SHIPPED.values()]
    found += [_of_record(record) for record in CITED]
    found += [Source(*aspect) for aspect in ASPECTS]
    found += [_of_table(kind, name, _HERE) for kind in _PART_OF for name in shipped(kind)]
    by_part: dict[str, list[Source]] = {}
    for source in found:
        by_part.setdefault(source.part, []).append(source)
    return by_part


def _algorithms(loaded: LoadedScenario) -> Sequence[Entry]:
    """What the nodes run; the scenario's algorithm only where some group has none of its own."""
    scenario = loaded.scenario
    records: list[Any] = [group.algorithm or scenario.algorithm for group in scenario.nodes]
    return [loaded.registry.entry_of(record) for record in records]


def _of_algorithm(entry: Entry) -> Source:
    unknown = f"not said by {entry.name}" if ":" in entry.name else OWN
    return Source("algorithm", entry.name, entry.summary, entry.citation or unknown)


def _of_record(record: type[Any]) -> Source:
    cited = CITED[record]
    summary = (record.__doc__ or "").strip().splitlines()[0].removesuffix(".")
    return Source(cited.part, _name_of(record), _REFERENCE.sub("", summary), cited.citation)


def _name_of(record: type[Any]) -> str:
    """The value of its field `type`, or the name it is given here."""
    if record in NAMES:
        return NAMES[record]
    tag: str = get_args(get_type_hints(record)["type"])[0]
    return tag


def _records(value: Any) -> Iterator[Any]:
    """Every record in a scenario, itself included."""
    if dataclasses.is_dataclass(value):
        yield value
        for field in dataclasses.fields(value):
            yield from _records(getattr(value, field.name))
    elif isinstance(value, tuple | list):
        for item in value:
            yield from _records(item)


def _aspects(medium: MediumParameters) -> Iterator[Aspect]:
    """What a medium's values switch on."""
    if isinstance(medium, IdealMediumParameters):
        return
    yield RECEPTION[medium.reception]
    if isinstance(medium, PhysicalMedium):
        yield from (SHADOWING,) if medium.shadowing_sd_db else ()
        yield from (ASYMMETRY,) if medium.asymmetry_sd_db else ()
        yield from (HARDWARE,) if medium.hardware_covariance is not None else ()


def _uses_modulation(medium: MediumParameters) -> bool:
    """Whether bit errors are computed: not on an ideal medium, nor where ratios were measured and nothing interferes."""
    if isinstance(medium, TraceMediumParameters) and medium.format == "k7":
        return medium.reception == "sinr"
    return not isinstance(medium, IdealMediumParameters)


def _of_devices(group: NodeGroup, folder: Path, *, uses_modulation: bool) -> Iterator[Source]:
    """The tables of a group's devices, and the models that these choose."""
    yield _of_table("radios", group.radio, folder)
    yield from (_of_record(model) for model in _models_of(load_radio(group.radio, folder), uses_modulation))
    yield _of_table("cpus", group.cpu, folder)
    if isinstance(group.battery, DeviceBattery):
        yield _of_table("batteries", group.battery.device, folder)
        chemistry = load_battery(group.battery.device, folder).chemistry
        yield from () if chemistry is None else (_of_record(type(chemistry)),)


def _models_of(radio: RadioDevice, uses_modulation: bool) -> Iterator[type[Any]]:
    if uses_modulation:
        yield type(radio.modulation)
    if radio.amplifier is not None:
        yield type(radio.amplifier)
    if radio.lora is not None:
        yield type(radio.lora.settings)


def _of_table(kind: Kind, name: str, folder: Path) -> Source:
    device, source = table_source(kind, name, folder)
    return Source(_PART_OF[kind], name, device, source)
