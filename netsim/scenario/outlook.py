"""From the folder of a run to how long its nodes last under a plan."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.errors import ScenarioError
from netsim.metrics.lifetime import DutyPlan, Lifetime, NodeUse, assumptions, lifetimes
from netsim.models.devices import RadioDevice
from netsim.reading.reasons import why_unreadable
from netsim.rng import Streams
from netsim.scenario.folder import METRICS_FILE, SCENARIO_FILE
from netsim.scenario.load import LoadedScenario, load
from netsim.scenario.places import Place, places


@dataclass(frozen=True, slots=True)
class Outlook:
    """How long the nodes of a run last.

    Attributes:
        title: The run.
        lifetimes: Of each node.
        assumptions: What is taken for granted, a sentence each.
    """

    title: str
    lifetimes: list[Lifetime]
    assumptions: list[str]


def outlook(folder: Path, changes: Mapping[str, Any]) -> Outlook:
    """How long the nodes of a run last under the plan of its scenario.

    Args:
        folder: The folder of a run; its metrics and its scenario are read.
        changes: Values of `DutyPlan` that replace the scenario's.

    Raises:
        ScenarioError: If the folder holds no finished run, there is no plan, or the plan does not fit a day.
    """
    figures = _figures(folder)
    loaded = load(folder / SCENARIO_FILE)
    plan = _plan(loaded, changes)
    scenario = loaded.scenario
    activity_s = figures["simulated_s"] / plan.activities_per_run
    nodes = places(loaded, Streams(scenario.seed, scenario.repetition))
    names = [place.name for place in nodes]
    if twice := {name for name in names if names.count(name) > 1}:
        message = f"several nodes are called {min(twice)}: expected names that differ, for the run's figures go by name"
        raise ScenarioError(message)
    uses = [_use(place, figures, plan) for place in nodes]
    run = f"the run {scenario.name} (seed {scenario.seed}, {figures['simulated_s']:g} s simulated)"
    if figures.get("interrupted"):
        run += ", which was interrupted"
    said = assumptions(plan, run, activity_s, figures["deaths"])
    return Outlook(f"{scenario.name} (seed {scenario.seed})", lifetimes(uses, plan, activity_s), said)


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
