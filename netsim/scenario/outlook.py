"""From the folder of a run to how long its nodes last under a plan."""

import json
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from netsim.errors import ScenarioError
from netsim.metrics.lifetime import DutyPlan, Lifetime, NodeUse, assumptions, lifetimes, spread_of
from netsim.metrics.milestones import Milestones, milestones
from netsim.metrics.reach import USABLE_PRR, Reach
from netsim.models.devices import RadioDevice
from netsim.reading.reasons import why_unreadable
from netsim.rng import Streams
from netsim.scenario.folder import METRICS_FILE, SCENARIO_FILE, TRACE_FILE
from netsim.scenario.load import LoadedScenario, load
from netsim.scenario.places import Place, places
from netsim.trace.events import LinkTable, VariablePlacement
from netsim.trace.reader import read_trace
from netsim.trace.recorder import Recorder

LINKS_STAY: Final = (
    f"The network is made of the links of the start with a packet reception ratio of {USABLE_PRR:g} or more both ways; "
    "whoever had no such way to it (to a sink, where there is one) is left out. Routes are found wherever there is a way."
)


@dataclass(frozen=True, slots=True)
class Outlook:
    """How long the nodes of a run last.

    Attributes:
        title: The run.
        lifetimes: Of each node.
        milestones: When the network stops being one; None for a run without a trace, which alone tells its links.
        needed: How many nodes the answer needs; 0 without a trace, and where nothing is asked of the nodes.
        assumptions: What is taken for granted, a sentence each.
    """

    title: str
    lifetimes: list[Lifetime]
    milestones: Milestones | None
    needed: int
    assumptions: list[str]


def outlook(folder: Path, changes: Mapping[str, Any]) -> Outlook:
    """How long the nodes of a run last under the plan of its scenario.

    Args:
        folder: The folder of a run; its metrics, its scenario, and the links and hosts in its trace are read.
        changes: Values of `DutyPlan` that replace the scenario's.

    Raises:
        ScenarioError: If the folder holds no finished run, there is no plan, or the plan does not fit a day.
        TraceError: If there is a trace that cannot be read.
    """
    figures = _figures(folder)
    loaded = load(folder / SCENARIO_FILE)
    plan = _plan(loaded, changes)
    scenario = loaded.scenario
    nodes = _nodes(loaded)
    found = _lifetimes(nodes, figures, plan)
    run = f"the run {scenario.name} (seed {scenario.seed}, {figures['simulated_s']:g} s simulated)"
    if figures.get("interrupted"):
        run += ", which was interrupted"
    said = assumptions(plan, run, figures["simulated_s"] / plan.activities_per_run, figures["deaths"])
    title = f"{scenario.name} (seed {scenario.seed})"
    reach = _reach(folder / TRACE_FILE)
    if reach is None:
        return Outlook(title, found, None, 0, said)
    stages = _milestones(nodes, found, reach.links, reach.hosts)
    return Outlook(title, found, stages, len(_needed(nodes, reach.hosts)), [*said, LINKS_STAY])


def lifetime_figures(
    loaded: LoadedScenario, figures: Mapping[str, Any], links: Iterable[tuple[int, int]], hosts: Collection[int]
) -> dict[str, float | None]:
    """The lifetimes of a run as figures beside its metrics (see `netsim.metrics.catalogue`); None for never.

    Args:
        loaded: The scenario; its plan of a day is used, and without one there are no figures.
        figures: The metrics of its run.
        links: Pairs of nodes that hear each other, as `netsim.metrics.reach.Reach` notes them.
        hosts: Nodes that host variables of the problem.

    Raises:
        ScenarioError: If the plan does not fit a day, or nodes share a name.
    """
    plan = loaded.scenario.duty_plan
    if plan is None:
        return {}
    nodes = _nodes(loaded)
    found = _lifetimes(nodes, figures, plan)
    stages = _milestones(nodes, found, links, hosts)
    spread = spread_of(found)
    return {
        "lifetime_first_dead_days": stages.first_dead_days,
        "lifetime_median_days": None if spread is None or spread.median_days == math.inf else spread.median_days,
        "lifetime_partition_days": stages.partition_days,
        "lifetime_accuracy_days": stages.accuracy_days,
    }


def _nodes(loaded: LoadedScenario) -> list[Place]:
    nodes = places(loaded, Streams(loaded.scenario.seed, loaded.scenario.repetition))
    names = [place.name for place in nodes]
    if twice := {name for name in names if names.count(name) > 1}:
        message = f"several nodes are called {min(twice)}: expected names that differ, for the run's figures go by name"
        raise ScenarioError(message)
    return nodes


def _lifetimes(nodes: Iterable[Place], figures: Mapping[str, Any], plan: DutyPlan) -> list[Lifetime]:
    uses = [_use(place, figures, plan) for place in nodes]
    return lifetimes(uses, plan, figures["simulated_s"] / plan.activities_per_run)


def _milestones(
    nodes: Sequence[Place], found: Iterable[Lifetime], links: Iterable[tuple[int, int]], hosts: Collection[int]
) -> Milestones:
    days = {place.id: each.days for place, each in zip(nodes, found, strict=True)}
    return milestones(days, links, _needed(nodes, hosts), _of_role(nodes, "sink"))


def _needed(nodes: Sequence[Place], hosts: Collection[int]) -> Collection[int]:
    """The hosts of variables; where there are none but a sink, all that sense for it."""
    return hosts or (_of_role(nodes, "sensor") if _of_role(nodes, "sink") else ())


def _of_role(nodes: Iterable[Place], role: str) -> list[int]:
    return [place.id for place in nodes if place.group.role == role]


def _reach(trace: Path) -> Reach | None:
    """What a run's trace says of its links and hosts at the start; None without a trace."""
    if not trace.exists():
        return None
    reach = Reach()
    recorder = Recorder(lambda: 0, [reach])
    for _, event in read_trace(trace, {LinkTable.topic, VariablePlacement.topic}, end_ns=1):
        recorder.record(event)
    return reach


def _figures(folder: Path) -> dict[str, Any]:
    path = folder / METRICS_FILE
    try:
        figures: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        got = "no such file" if isinstance(error, FileNotFoundError) else why_unreadable(path, error)
        message = f"{path}: expected the metrics of a finished run, got: {got}; give the folder that `netsim run` wrote"
        raise ScenarioError(message) from error
    return figures


def _plan(loaded: LoadedScenario, changes: Mapping[str, Any]) -> DutyPlan:
    plan = loaded.scenario.duty_plan
    given = {} if plan is None else {name: getattr(plan, name) for name in DutyPlan.__dataclass_fields__}
    settings = given | dict(changes)
    if "activities_per_day" not in settings:
        message = "no plan of a day: expected `duty_plan: {activities_per_day: ...}` in the scenario, or --per-day"
        raise ScenarioError(message)
    return DutyPlan(**settings)


def _use(place: Place, figures: Mapping[str, Any], plan: DutyPlan) -> NodeUse:
    return NodeUse(
        name=place.name,
        group=place.group.name,
        capacity_j=place.battery.energy_j,
        activity_j=figures["energy_by_node_j"][place.name] / plan.activities_per_run,
        between_mw=_radio_mw(place.radio, plan) + place.cpu.sleep_mw,
        died_s=figures["death_by_node_s"].get(place.name),
    )


def _radio_mw(radio: RadioDevice, plan: DutyPlan) -> float:
    if plan.between == "low_power_listening":
        return plan.listen_share * radio.listen_mw + (1.0 - plan.listen_share) * radio.power_down_mw
    return {"power_down": radio.power_down_mw, "idle": radio.idle_mw, "listen": radio.listen_mw}[plan.between]
