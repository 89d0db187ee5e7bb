"""From a scenario file to a checked `Scenario`, with every finding at once."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from netsim.algorithms.registry import SHIPPED, Entry, load_own
from netsim.errors import Finding, ScenarioError
from netsim.models.media import IdealMediumParameters
from netsim.models.placement import GridPlacement, JitteredGridPlacement, PoissonDiskPlacement, UniformPlacement
from netsim.problems.association import AssociationParameters, ListedTargets
from netsim.reading import Document, Unknown, check_document, read_document
from netsim.reading import Path as ValuePath
from netsim.reading.remedies import nearest
from netsim.scenario.fidelity import climb, fidelity_findings
from netsim.scenario.model_checks import model_findings
from netsim.scenario.schema import Scenario
from netsim.scenario.tracking_checks import tracking_findings
from netsim.sim.mac.ideal import IdealMacParameters

MOST_NODES = 10_000
MOST_NODES_WITHOUT_RANGE = 2_000
MOST_ACK_DELAY_S = 1.5e-4
"""Half of what the acknowledgement wait (54 symbols) leaves after turnaround (12) and acknowledgement (22), 2.4 GHz."""

MOST_LETTERS = 100
FOLDER_NAME = f"at most {MOST_LETTERS} letters, digits, spaces and . _ - (results go into a folder of this name)"
"""What a name must be, in words."""

OPEN_PATHS = (("algorithm",), ("nodes", "*", "algorithm"))


@dataclass(slots=True)
class Registry:
    """Finds algorithms by name for one scenario, and remembers which record belongs to which.

    Args:
        folder: Where the scenario lies.
        plugins: Whether `module:Class` may be imported.
    """

    folder: Path
    plugins: bool = True
    found: dict[str, Entry] = field(default_factory=dict)

    def resolve(self, name: str) -> type[Any] | Unknown:
        """The parameter record of an algorithm, or what to tell the user."""
        if name in SHIPPED:
            self.found[name] = SHIPPED[name]
        elif ":" in name and not self.plugins:
            return Unknown("a shipped algorithm (--no-plugins is on)", f"one of {', '.join(SHIPPED)}")
        elif ":" in name and name not in self.found:
            try:
                self.found[name] = load_own(name, self.folder)
            except ScenarioError as error:
                return Unknown("a class that can be imported", str(error))
        elif ":" not in name:
            guess = nearest(name, SHIPPED)
            hint = f"did you mean `{guess}`? " if guess else ""
            return Unknown("the name of an algorithm", f"{hint}Known: {', '.join(SHIPPED)}, or your own `module:Class`")
        return self.found[name].record

    def entry_of(self, record: Any) -> Entry:
        """The algorithm a validated parameter record belongs to."""
        return self.found[record.type]


@dataclass(frozen=True, slots=True)
class LoadedScenario:
    """A valid scenario and where it came from.

    Attributes:
        scenario: The scenario.
        path: Its file.
        document: What was read, for findings about single values.
        registry: The algorithms it names.
    """

    scenario: Scenario
    path: Path
    document: Document
    registry: Registry

    @property
    def folder(self) -> Path:
        """What relative paths in the scenario are relative to."""
        return self.path.parent


def load(path: Path | str, overrides: Sequence[str] = (), *, plugins: bool = True) -> LoadedScenario:
    """Read and check a scenario.

    Args:
        path: The YAML file.
        overrides: `path=value` each, applied over the file.
        plugins: Whether algorithms named `module:Class` may be imported.

    Raises:
        ScenarioError: With every finding.
    """
    loaded, findings = inspect(path, overrides, plugins=plugins)
    if findings or loaded is None:
        raise ScenarioError(findings)
    return loaded


def inspect(
    path: Path | str, overrides: Sequence[str] = (), *, plugins: bool = True
) -> tuple[LoadedScenario | None, list[Finding]]:
    """Read a scenario and list everything wrong with it; the scenario is None if anything is.

    Raises:
        ScenarioError: If there is nothing to check: no such file, or not YAML.
    """
    return inspect_document(read_document(Path(path), overrides), Path(path), plugins=plugins)


def inspect_document(
    document: Document, path: Path, *, plugins: bool = True
) -> tuple[LoadedScenario | None, list[Finding]]:
    """Like `inspect`, for a scenario that has been read.

    Args:
        document: What was read, and perhaps changed since.
        path: Its file: relative paths in the scenario are relative to where it lies.
        plugins: Whether algorithms named `module:Class` may be imported.
    """
    registry = Registry(path.parent, plugins)
    scenario, findings = check_document(
        document,
        Scenario,
        dict.fromkeys(OPEN_PATHS, registry.resolve),
        {name: entry.record for name, entry in SHIPPED.items()},
    )
    if not findings:
        findings = list(fidelity_findings(scenario, document))
    if not findings:
        scenario = climb(scenario)
        findings = list(_across(scenario, document, registry))
    if findings:
        return None, findings
    return LoadedScenario(scenario, path, document, registry), []


def _across(scenario: Scenario, document: Document, registry: Registry) -> Iterator[Finding]:
    """Findings that concern more than one value."""
    yield from _file_name(scenario, document)
    yield from _node_counts(scenario, document)
    yield from _group_names(scenario, document)
    yield from _acknowledgements_in_time(scenario, document)
    yield from _problem_fits(scenario, document, registry)
    yield from model_findings(scenario, document)
    yield from tracking_findings(scenario, document)
    yield from _sink_exists(scenario, document, registry)
    yield from _targets_in_field(scenario, document)


def _file_name(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """The name becomes the name of a folder."""
    if not is_folder_name(scenario.name):
        yield document.finding(("name",), FOLDER_NAME, f"{scenario.name!r:.120}")


def is_folder_name(name: str) -> bool:
    """Whether a name can be that of a folder everywhere."""
    return len(name) <= MOST_LETTERS and re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._ -]*", name) is not None


def _node_counts(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """Refuse what would only fill the memory; nodes from a CSV file are counted when it is read."""
    total = 0
    for index, group in enumerate(scenario.nodes):
        placement = group.placement
        if isinstance(placement, GridPlacement | JitteredGridPlacement):
            total += placement.rows * placement.columns
        elif isinstance(placement, UniformPlacement | PoissonDiskPlacement):
            total += placement.count
        if total > MOST_NODES:
            yield document.finding(
                ("nodes", index, "placement"),
                f"at most {MOST_NODES} nodes in all",
                f"{total}",
                "make the field smaller",
            )
            return
    medium = scenario.medium
    if isinstance(medium, IdealMediumParameters) and medium.range_m is None and total > MOST_NODES_WITHOUT_RANGE:
        yield document.finding(
            ("medium",),
            f"a range_m where there are more than {MOST_NODES_WITHOUT_RANGE} nodes",
            f"{total} nodes that all hear each other",
        )


def _acknowledgements_in_time(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """An acknowledgement must be able to come back before its sender gives up waiting for it."""
    medium, mac = scenario.medium, scenario.mac
    waits = not isinstance(mac, IdealMacParameters) and mac.acknowledge
    if isinstance(medium, IdealMediumParameters) and waits and medium.delay_s > MOST_ACK_DELAY_S:
        yield document.finding(
            ("medium", "delay_s"),
            f"at most {MOST_ACK_DELAY_S:g} s with a MAC that waits for acknowledgements",
            f"{medium.delay_s:g}",
            "lower it, or set `mac: {type: ideal}`",
        )


def _group_names(scenario: Scenario, document: Document) -> Iterator[Finding]:
    seen: set[str] = set()
    for index, group in enumerate(scenario.nodes):
        if group.name in seen:
            yield document.finding(
                ("nodes", index, "name"), "a name no other group has", repr(group.name), "rename one of the groups"
            )
        seen.add(group.name)


def _problem_fits(scenario: Scenario, document: Document, registry: Registry) -> Iterator[Finding]:
    records: list[tuple[ValuePath, Any]] = [(("algorithm",), scenario.algorithm)]
    records += [(("nodes", index, "algorithm"), group.algorithm) for index, group in enumerate(scenario.nodes)]
    for path, record in records:
        problems = registry.entry_of(record).problems if record is not None else ()
        if problems and scenario.problem.type not in problems:
            yield document.finding(
                (*path, "type"),
                f"an algorithm for the problem `{scenario.problem.type}`",
                record.type,
                f"set `problem` to one of the type {' or '.join(problems)}",
            )


def _sink_exists(scenario: Scenario, document: Document, registry: Registry) -> Iterator[Finding]:
    """What is sent to a sink needs one."""
    if any(group.role == "sink" for group in scenario.nodes):
        return
    records: list[tuple[ValuePath, Any]] = [
        (("nodes", index, "algorithm"), group.algorithm)
        for index, group in enumerate(scenario.nodes)
        if group.algorithm is not None
    ]
    if len(records) < len(scenario.nodes):
        records.insert(0, (("algorithm",), scenario.algorithm))
    for path, record in records:
        if registry.entry_of(record).needs_sink:
            yield document.finding(
                (*path, "type"),
                f"a node of the role `sink` for {record.type} to send to",
                "none",
                "give one group `role: sink`",
            )


def _targets_in_field(scenario: Scenario, document: Document) -> Iterator[Finding]:
    problem = scenario.problem
    if not isinstance(problem, AssociationParameters) or not isinstance(problem.targets, ListedTargets):
        return
    left, bottom = scenario.field.origin_m
    right, top = left + scenario.field.width_m, bottom + scenario.field.height_m
    for index, (x_m, y_m) in enumerate(problem.targets.positions_m):
        if not (left <= x_m <= right and bottom <= y_m <= top):
            yield document.finding(
                ("problem", "targets", "positions_m", index),
                f"a position inside the field, x {left:g} to {right:g} m and y {bottom:g} to {top:g} m",
                f"[{x_m:g}, {y_m:g}]",
                "move the target or enlarge `field`",
            )
