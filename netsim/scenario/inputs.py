"""Files that a scenario refers to, gathered so that its resolved form can be run again from the folder of the run."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from netsim.algorithms.own_modules import own_files
from netsim.models.device_tables import Kind, shipped
from netsim.models.media import IdealMediumParameters, MediumParameters, TraceMediumParameters
from netsim.models.noise import ReplayedNoiseParameters
from netsim.models.placement import CsvPlacement
from netsim.models.tracks import FileTrack
from netsim.problems.graph import GraphFile, GraphParameters
from netsim.problems.tracking_parameters import AcousticTarget, TrackingParameters
from netsim.scenario.load import LoadedScenario
from netsim.scenario.schema import DeviceBattery, NodeGroup, Scenario

INPUTS = "inputs"
"""Subfolder of a run for the files its scenario refers to."""


@dataclass(frozen=True, slots=True)
class Input:
    """A file to be copied.

    Attributes:
        source: Where it is.
        name: Where it goes, relative to the run's folder.
    """

    source: Path
    name: str


class Gathering:
    """Collects the files of one scenario and gives each the path of its copy."""

    def __init__(self, loaded: LoadedScenario) -> None:
        self._loaded = loaded
        self._names: dict[Path, str] = {}

    def gather(self) -> tuple[Scenario, list[Input]]:
        """The scenario with the paths of the copies, and the files to be copied."""
        scenario = self._loaded.scenario
        portable = replace(
            scenario,
            nodes=tuple(self._group(group) for group in scenario.nodes),
            medium=self._medium(scenario.medium),
            problem=self._problem(scenario.problem),
        )
        inputs = [Input(source, name) for source, name in self._names.items()]
        return portable, [*inputs, *self._modules()]

    def _copied(self, path: str) -> str:
        source = self._loaded.folder / path
        if source not in self._names:
            names = set(self._names.values())
            name, number = f"{INPUTS}/{source.name}", 1
            while name in names:
                number += 1
                name = f"{INPUTS}/{source.stem}-{number}{source.suffix}"
            self._names[source] = name
        return self._names[source]

    def _device(self, kind: Kind, name: str) -> str:
        return name if name in shipped(kind) else self._copied(name)

    def _group(self, group: NodeGroup) -> NodeGroup:
        placement, battery = group.placement, group.battery
        if isinstance(placement, CsvPlacement):
            placement = replace(placement, file=self._copied(placement.file))
        if isinstance(battery, DeviceBattery):
            battery = replace(battery, device=self._device("batteries", battery.device))
        mobility = group.mobility
        if mobility is not None and mobility.file is not None:
            mobility = replace(mobility, file=self._copied(mobility.file))
        radio, cpu = self._device("radios", group.radio), self._device("cpus", group.cpu)
        return replace(group, placement=placement, battery=battery, mobility=mobility, radio=radio, cpu=cpu)

    def _medium(self, medium: MediumParameters) -> MediumParameters:
        if isinstance(medium, IdealMediumParameters):
            return medium
        if isinstance(medium.noise, ReplayedNoiseParameters):
            medium = replace(medium, noise=replace(medium.noise, file=self._copied(medium.noise.file)))
        if isinstance(medium, TraceMediumParameters):
            medium = replace(medium, file=self._copied(medium.file))
        return medium

    def _problem(self, problem: Any) -> Any:
        if isinstance(problem, GraphParameters) and isinstance(problem.graph, GraphFile):
            return replace(problem, graph=replace(problem.graph, path=self._copied(problem.graph.path)))
        if isinstance(problem, TrackingParameters):
            return replace(problem, targets=tuple(self._target(target) for target in problem.targets))
        return problem

    def _target(self, target: AcousticTarget) -> AcousticTarget:
        track = target.track
        return (
            replace(target, track=replace(track, file=self._copied(track.file)))
            if isinstance(track, FileTrack)
            else target
        )

    def _modules(self) -> list[Input]:
        """Modules of the user's own algorithms with what they import from beside the scenario; they must lie there, too."""
        folder = self._loaded.folder
        names = sorted({name.partition(":")[0] for name in self._loaded.registry.found if ":" in name})
        paths = dict.fromkeys(path for name in names for path in own_files(name, folder))
        return [Input(path, path.relative_to(folder).as_posix()) for path in paths]


def modules_elsewhere(loaded: LoadedScenario) -> dict[str, Path]:
    """Modules of algorithms that were found on the Python path: they are not copied, but what they hold matters."""
    names = {name.partition(":")[0] for name in loaded.registry.found if ":" in name}
    files = {name: getattr(sys.modules.get(name), "__file__", None) for name in names}
    return {f"module {name}": Path(file) for name, file in files.items() if file and not own_files(name, loaded.folder)}
