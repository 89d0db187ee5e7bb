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
from netsim.scenario.folder import METRICS_FILE, RUN_FILE, SCENARIO_FILE, TRACE_FILE, copy_inputs, discard, write_file
from netsim.scenario.inputs import Gathering, Input
from netsim.scenario.load import LoadedScenario
from netsim.sim.clock import Clock
from netsim.sim.simulation import Simulation
from netsim.trace.events import EVENT_TYPES, EnergyLedger, Event
from netsim.trace.recorder import Handler, Observer
from netsim.trace.writer import Attachment, TraceWriter

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
    resolved, inputs = _resolved(loaded) if folder is not None else ("", [])
    metrics = Metrics()
    writer = _writer(loaded, folder, resolved) if trace and folder is not None else None
    try:
        followers = [*metrics.observers, *observers, *([TraceObserver(writer)] if writer else [])]
        simulation = build(loaded, followers, clock).simulation
        interrupted = _simulate(simulation, progress)
        figures = _figures(loaded, metrics, interrupted)
        if writer is not None:
            writer.attach(METRICS_FILE, "application/json", _json(figures).encode())
            writer.close()
    except BaseException as error:
        _give_up(writer, folder, error)
        raise
    wall_s = time.perf_counter() - begun_s
    if folder is not None:
        copy_inputs(folder, inputs)
        write_file(folder / SCENARIO_FILE, resolved)
        write_file(folder / METRICS_FILE, _json(figures))
        write_file(folder / RUN_FILE, _json(_circumstances(loaded, wall_s)))
    return Result(
        metrics=figures,
        ledger=metrics.ledger,
        failures={number: node.failure for number, node in simulation.nodes.items() if node.failure is not None},
        interrupted=interrupted,
        wall_s=wall_s,
        folder=folder,
        trace=writer.path if writer is not None else None,
    )


def _resolved(loaded: LoadedScenario) -> tuple[str, list[Input]]:
    """The scenario as it can be run again from a folder, and the files that it needs there."""
    portable, inputs = Gathering(loaded).gather()
    return dump_yaml(portable), inputs


def _give_up(writer: TraceWriter | None, folder: Path | None, error: BaseException) -> None:
    """Close what was begun; where the scenario could not even be built, nothing is left behind."""
    if writer is not None:
        with suppress(TraceError):
            writer.abort()
    if folder is not None and isinstance(error, ScenarioError):
        discard(folder)


def _figures(loaded: LoadedScenario, metrics: Metrics, interrupted: bool) -> dict[str, Any]:
    head = {"scenario": loaded.scenario.name, "seed": loaded.scenario.seed, "interrupted": interrupted}
    return head | metrics.figures()


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _simulate(simulation: Simulation, progress: Progress | None) -> bool:
    """Run and close the books; returns whether the run was ended from outside."""
    stopped = False

    def look(now_ns: int) -> bool:
        nonlocal stopped
        stopped = progress is not None and not progress(now_ns, simulation.horizon_ns)
        return not stopped

    try:
        simulation.run(look)
        simulation.conclude()
    finally:
        simulation.abandon()
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
