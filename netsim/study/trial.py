"""One trial: a variant's scenario in one repetition, run in whatever process it comes to."""

import json
import tempfile
import time
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, Protocol

from netsim.errors import NetsimError, TraceError
from netsim.metrics.energy import STANDING
from netsim.metrics.reach import Reach
from netsim.scenario.folder import SCENARIO_FILE
from netsim.scenario.load import LoadedScenario, load
from netsim.scenario.outlook import lifetime_figures
from netsim.scenario.run import Result, run
from netsim.study.build_id import build_id, package_versions
from netsim.study.folder import variant_folder
from netsim.trace.events import EnergyLedger, Event, NodeTable
from netsim.trace.recorder import Handler

Status = Literal["ok", "failed"]


@dataclass(frozen=True, slots=True)
class Task:
    """What a worker needs to run one trial.

    Attributes:
        trial: Number in the study.
        variant: Number of its variant.
        repetition: Number of its repetition.
        key: Names the content: the variant's digest and the repetition. Equal keys give equal figures.
        folder: Folder of the variant's scenario on the machine that runs the study.
        files: The same folder's files by name, for a worker elsewhere; empty where the folder is at hand.
        netsim_version: The study's; a worker with another one refuses.
    """

    trial: int
    variant: int
    repetition: int
    key: str
    folder: str
    files: tuple[tuple[str, bytes], ...] = field(default=(), compare=False)
    netsim_version: str = field(default_factory=build_id)

    @property
    def digest(self) -> str:
        """The variant's digest."""
        return self.key.rpartition("-")[0]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one trial.

    Attributes:
        trial: Number in the study.
        key: See `Task.key`.
        status: Whether it has figures.
        error: Why not, on one line.
        figures: Its metrics, as in metrics.json.
        nodes: What it cost each node: columns by name, of equal length.
        wall_s: How long it took.
        details: The traceback of a failure.
        netsim_version: The worker's.
        packages: Versions of Python and packages there; empty if they are not known.
    """

    trial: int
    key: str
    status: Status
    error: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    nodes: Mapping[str, list[Any]] = field(default_factory=dict)
    wall_s: float = 0.0
    details: str = ""
    netsim_version: str = field(default_factory=build_id)
    packages: Mapping[str, str] = field(default_factory=dict)

    @property
    def versions(self) -> dict[str, str]:
        """Of netsim, Python and packages, as far as they are known."""
        return {"netsim": self.netsim_version, **self.packages}


class Kind(Protocol):
    """A variant, as its trials need it."""

    @property
    def number(self) -> int:
        """Its number."""

    @property
    def digest(self) -> str:
        """Digest of its scenario and files."""


def tasks_of(variants: Sequence[Kind], repetitions: Iterable[int], folder: Path) -> list[Task]:
    """Every trial: all variants of a repetition, then the next one, so that an early look is a fair one.

    Args:
        variants: The study's variants.
        repetitions: The repetitions' numbers.
        folder: The study's folder.
    """
    pairs = [(repetition, variant) for repetition in repetitions for variant in variants]
    return [
        Task(
            trial=number,
            variant=variant.number,
            repetition=repetition,
            key=f"{variant.digest}-{repetition}",
            folder=str(variant_folder(folder, variant.number).resolve()),
        )
        for number, (repetition, variant) in enumerate(pairs)
    ]


def run_trial(task: Task) -> Outcome:
    """Run a trial; what it raises becomes its outcome."""
    begun_s = time.perf_counter()
    try:
        result, nodes = _run(task)
    except Exception as error:  # whatever it is, the other trials go on
        text = str(error) if isinstance(error, NetsimError) else repr(error)
        return _failed(task, text, begun_s, traceback.format_exc())
    if result.failures:
        cause = next(iter(result.failures.values()))
        details = "".join(traceback.format_exception(cause.__cause__ or cause))
        return _failed(task, _failures(result), begun_s, details)
    wall_s = time.perf_counter() - begun_s
    return Outcome(task.trial, task.key, "ok", "", result.metrics, nodes, wall_s, packages=package_versions())


def files_of(task: Task) -> tuple[tuple[str, bytes], ...]:
    """The files of a task's folder by name, for a worker that cannot see it.

    Raises:
        TraceError: If one cannot be read.
    """
    folder = Path(task.folder)
    try:
        paths = sorted(path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
        return tuple((path.relative_to(folder).as_posix(), path.read_bytes()) for path in paths)
    except OSError as error:
        message = f"cannot read {folder}: {error.strerror or error}"
        raise TraceError(message) from error


def _run(task: Task) -> tuple[Result, dict[str, list[Any]]]:
    if task.netsim_version != build_id():
        message = f"its worker has netsim {build_id()}, the study netsim {task.netsim_version}: install the same"
        raise NetsimError(message)
    loaded = _variant(_Source(task.digest, task.folder if not task.files else "", task.files)).loaded
    loaded = replace(loaded, scenario=replace(loaded.scenario, repetition=task.repetition))
    notes, reach = NodeNotes(), Reach()
    result = run(loaded, observers=[notes, reach])
    if not result.failures:
        days = lifetime_figures(loaded, result.metrics, reach.links, reach.hosts)
        result = replace(result, metrics={**result.metrics, **days})
    nodes = notes.columns(result.metrics)
    json.dumps([result.metrics, nodes], allow_nan=False)  # what cannot be written down is a failure of this trial
    return result, nodes


def _failed(task: Task, text: str, begun_s: float, details: str) -> Outcome:
    wall_s = time.perf_counter() - begun_s
    packages = package_versions()
    return Outcome(task.trial, task.key, "failed", _line(text), wall_s=wall_s, details=details, packages=packages)


class NodeNotes:
    """Notes where the nodes stand and what they draw; an observer of one run."""

    def __init__(self) -> None:
        self._table: NodeTable | None = None
        self._beyond_j: dict[int, float] = {}

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Observer.handlers`."""
        return {NodeTable: self._on_nodes, EnergyLedger: self._on_ledger}

    def columns(self, figures: Mapping[str, Any]) -> dict[str, list[Any]]:
        """One row a node: name, group, role, position, energy with and without listening, time of death."""
        table = self._table
        if table is None:
            return {}
        return {
            "node": list(map(int, table.node)),
            "name": list(table.name),
            "group": list(table.group),
            "role": list(table.role),
            "x_m": list(map(float, table.x_m)),
            "y_m": list(map(float, table.y_m)),
            "energy_j": [figures["energy_by_node_j"].get(name) for name in table.name],
            "energy_beyond_listening_j": [self._beyond_j.get(int(node), 0.0) for node in table.node],
            "death_s": [figures["death_by_node_s"].get(name) for name in table.name],
        }

    def _on_nodes(self, event: NodeTable, _: int) -> None:
        self._table = event

    def _on_ledger(self, event: EnergyLedger, _: int) -> None:
        """As the metric of that name: without what goes on by itself."""
        for node, device, state, joules in zip(event.node, event.device, event.state, event.energy_j, strict=True):
            if state not in STANDING.get(device, ()):
                self._beyond_j[int(node)] = self._beyond_j.get(int(node), 0.0) + float(joules)


@dataclass(frozen=True, slots=True)
class _Unpacked:
    """A variant's scenario, and the folder made for it, if one was: it goes when this goes."""

    loaded: LoadedScenario
    folder: "tempfile.TemporaryDirectory[str] | None" = None


@dataclass(frozen=True, slots=True)
class _Source:
    """Where a variant's scenario comes from; the digest stands for the files."""

    digest: str
    folder: str
    files: tuple[tuple[str, bytes], ...] = field(compare=False)


@lru_cache(maxsize=64)
def _variant(source: _Source) -> _Unpacked:
    """The scenario of a variant: read once in a process, not once a trial."""
    if not source.files:
        return _Unpacked(load(Path(source.folder) / SCENARIO_FILE))
    made = tempfile.TemporaryDirectory(prefix="netsim-")
    for name, content in source.files:
        target = Path(made.name) / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return _Unpacked(load(Path(made.name) / SCENARIO_FILE), made)


def _failures(result: Result) -> str:
    node, failure = next(iter(result.failures.items()))
    more = f" (and {len(result.failures) - 1} nodes more)" if len(result.failures) > 1 else ""
    return _line(f"node {node}: {failure}{more}")


def _line(text: str) -> str:
    return " | ".join(line.strip() for line in text.splitlines() if line.strip())
