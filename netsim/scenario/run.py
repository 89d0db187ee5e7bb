"""Running a scenario: into a folder with trace, metrics and what is needed to make it again."""

import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from netsim import __version__
from netsim.errors import NetsimError, ScenarioError, TraceError
from netsim.metrics.collect import Metrics
from netsim.reading import dump_yaml
from netsim.scenario.build import build
from netsim.scenario.load import LoadedScenario
from netsim.sim.clock import Clock
from netsim.sim.simulation import Simulation
from netsim.trace.events import EVENT_TYPES, EnergyLedger, Event
from netsim.trace.recorder import Handler, Observer
from netsim.trace.writer import Attachment, TraceWriter, partial_path

TRACE_FILE = "trace.mcap"
METRICS_FILE = "metrics.json"
RUN_FILE = "run.json"
SCENARIO_FILE = "scenario.yaml"
FILES = (TRACE_FILE, METRICS_FILE, RUN_FILE, SCENARIO_FILE, partial_path(Path(TRACE_FILE)).name)

Progress = Callable[[int, int], bool]
"""Called now and then with simulated time and horizon in nanoseconds; False ends the run, marked interrupted."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a run gave.

    Attributes:
        metrics: Every figure by name, units in the names; equal for equal runs.
        ledger: Where every joule went, one row a node, device, state and message kind.
        failures: What algorithms raised, by node.
        interrupted: Whether the run was ended before its time.
        wall_s: How long it took on this machine.
        folder: Where the files are; None if none were written.
        trace: The trace; None if none was written.
    """

    metrics: Mapping[str, Any]
    ledger: EnergyLedger | None
    failures: Mapping[int, NetsimError]
    interrupted: bool
    wall_s: float
    folder: Path | None
    trace: Path | None


class TraceObserver:
    """Writes every event into a trace."""

    def __init__(self, writer: TraceWriter) -> None:
        self._writer = writer

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Observer.handlers`."""
        return dict.fromkeys(EVENT_TYPES, self._writer.write)


def new_folder(wanted: Path | None, name: str, force: bool) -> Path:
    """Make the folder of a run.

    Args:
        wanted: Where the user wants it; None takes the first free of `runs/NAME`, `runs/NAME-2`, ...
        name: The scenario's name.
        force: Whether files of an earlier run in `wanted` may be replaced.

    Raises:
        ScenarioError: If it exists and holds something, or cannot be made.
    """
    folder = wanted or _first_free(Path("runs"), name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            if not force:
                message = (
                    f"{folder} exists and is not empty: choose another --out, or replace the run there with --force"
                )
                raise ScenarioError(message)
            for file in FILES:
                (folder / file).unlink(missing_ok=True)
    except OSError as error:
        message = f"cannot write to {folder}: {error.strerror or error}; choose another folder with --out"
        raise ScenarioError(message) from error
    return folder


def run(
    loaded: LoadedScenario,
    *,
    folder: Path | None = None,
    trace: bool = True,
    progress: Progress | None = None,
    observers: Sequence[Observer] = (),
    clock: Clock | None = None,
) -> Result:
    """Run a scenario to its end.

    Args:
        loaded: The scenario.
        folder: An existing folder for trace, metrics and the rest; None writes nothing.
        trace: Whether to write the trace into it.
        progress: Is told how far the run is, and may end it.
        observers: Who else follows the events.
        clock: Simulated time, if not a plain new clock.

    Raises:
        ScenarioError: If the parts of the scenario do not fit together.
        TraceError: If a file cannot be written.
        InvariantError: If the simulation broke one of its own laws.
    """
    begun_s = time.perf_counter()
    metrics = Metrics()
    resolved = dump_yaml(loaded.scenario)
    writer = _writer(loaded, folder, resolved) if trace and folder is not None else None
    followers = [*metrics.observers, *observers, *([TraceObserver(writer)] if writer else [])]
    try:
        simulation = build(loaded, followers, clock).simulation
        interrupted = _simulate(simulation, progress)
        figures = {"scenario": loaded.scenario.name, "seed": loaded.scenario.seed, "interrupted": interrupted}
        figures |= metrics.figures()
        metrics_json = json.dumps(figures, indent=2, allow_nan=False) + "\n"
        if writer is not None:
            writer.attach(METRICS_FILE, "application/json", metrics_json.encode())
            writer.close()
    except BaseException:
        if writer is not None:
            with suppress(TraceError):
                writer.abort()
        raise
    wall_s = time.perf_counter() - begun_s
    if folder is not None:
        _write(folder / SCENARIO_FILE, resolved)
        _write(folder / METRICS_FILE, metrics_json)
        _write(folder / RUN_FILE, json.dumps(_circumstances(loaded, wall_s), indent=2) + "\n")
    return Result(
        metrics=figures,
        ledger=metrics.ledger,
        failures={number: node.failure for number, node in simulation.nodes.items() if node.failure is not None},
        interrupted=interrupted,
        wall_s=wall_s,
        folder=folder,
        trace=writer.path if writer is not None else None,
    )


def _simulate(simulation: Simulation, progress: Progress | None) -> bool:
    """Run and close the books; returns whether the run was ended from outside."""
    stopped = False

    def look(now_ns: int) -> bool:
        nonlocal stopped
        stopped = progress is not None and not progress(now_ns, simulation.horizon_ns)
        return not stopped

    simulation.run(look)
    simulation.conclude()
    return stopped


def _writer(loaded: LoadedScenario, folder: Path, resolved: str) -> TraceWriter:
    scenario = loaded.scenario
    metadata = {
        "scenario": scenario.name,
        "seed": str(scenario.seed),
        "repetition": str(scenario.repetition),
        "horizon_s": repr(scenario.duration_s),
        "detail": scenario.trace.detail,
    }
    attachment = Attachment(SCENARIO_FILE, "application/yaml", resolved.encode())
    return TraceWriter(folder / TRACE_FILE, metadata, [attachment])


def _write(path: Path, text: str) -> None:
    """Write a file as a whole or not at all."""
    partial = path.with_name(path.name + ".partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        message = f"cannot write {path}: {error.strerror or error}"
        raise TraceError(message) from error


def _circumstances(loaded: LoadedScenario, wall_s: float) -> dict[str, Any]:
    """What differs between equal runs."""
    packages = ("simpy", "numpy", "scipy", "networkx", "mcap", "rerun-sdk", "pydantic")
    return {
        "scenario_file": str(loaded.path),
        "wall_s": wall_s,
        "netsim_version": __version__,
        "python_version": platform.python_version(),
        "package_versions": {name: version(name) for name in packages},
        "machine": {"system": platform.platform(), "processor": platform.machine()},
    }


def _first_free(parent: Path, name: str) -> Path:
    candidate, number = parent / name, 1
    while candidate.exists():
        number += 1
        candidate = parent / f"{name}-{number}"
    return candidate
