"""Lifetime in days from a short run, for a stated plan of a node's day.

    days = capacity / (n E + P (1 day - n T) + q capacity / 365.25)

with n activities a day of energy E and duration T each, the power P between them, and q of the battery's energy lost to
self-discharge a year. It is an extrapolation: `assumptions` says in words what it takes for granted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median_low
from typing import Annotated, Final, Literal

from annotated_types import Ge, Lt

from netsim.errors import ScenarioError
from netsim.parameters import NonNegative, Positive, PositiveInt, Probability, parameters

S_PER_DAY: Final = 86_400.0
DAYS_PER_YEAR: Final = 365.25

Between = Literal["power_down", "idle", "listen", "low_power_listening"]


@parameters
class DutyPlan:
    """A node's day, for `netsim lifetime`: how often it does what the run shows, and what it does in between.

    It changes nothing in the run itself.
    """

    activities_per_day: Positive
    """How often a day."""
    activities_per_run: PositiveInt = 1
    """How many activities the run holds."""
    between: Between = "power_down"
    """What the radio does between activities; the processor sleeps and the sensor is off. `low_power_listening`: it
    listens for `listen_share` of the time and is powered down for the rest."""
    listen_share: Probability = 0.01
    """Share of the time that low-power listening listens, start-up included."""
    self_discharge_percent_per_year: Annotated[float, Ge(0), Lt(100)] = 0.0
    """What the batteries lose by themselves."""


@dataclass(frozen=True, slots=True)
class NodeUse:
    """What one node has and draws.

    Attributes:
        name: The node.
        group: Its group.
        capacity_j: Usable energy of its battery; infinity for mains power.
        activity_j: What one activity costs it.
        between_mw: What it draws between activities.
        died_s: When its battery ran empty within the run; None if it did not.
    """

    name: str
    group: str
    capacity_j: float
    activity_j: float
    between_mw: float
    died_s: float | None = None


@dataclass(frozen=True, slots=True)
class Lifetime:
    """How long one node lasts; infinity on mains power."""

    use: NodeUse
    days: float


def lifetimes(uses: Sequence[NodeUse], plan: DutyPlan, activity_s: NonNegative) -> list[Lifetime]:
    """How long each node lasts, in the order of the nodes.

    Args:
        uses: What the nodes have and draw.
        plan: Their day.
        activity_s: How long one activity takes.

    Raises:
        ScenarioError: If that many activities do not fit a day.
    """
    busy_s = plan.activities_per_day * activity_s
    if busy_s > S_PER_DAY:
        most = S_PER_DAY / activity_s
        message = f"{plan.activities_per_day:g} activities a day of {activity_s:g} s each: expected at most {most:.4g}"
        raise ScenarioError(message)
    return [Lifetime(use, _days(use, plan, activity_s)) for use in uses]


def _days(use: NodeUse, plan: DutyPlan, activity_s: float) -> float:
    rest_s = S_PER_DAY - plan.activities_per_day * activity_s
    if use.capacity_j == math.inf:
        return math.inf
    activity_j = use.activity_j
    if use.died_s is not None:  # what a whole activity would have cost it at the rate at which it ran empty
        if use.died_s <= 0.0:
            return 0.0
        activity_j = use.capacity_j * activity_s / use.died_s
    lost_j = plan.self_discharge_percent_per_year / 100.0 / DAYS_PER_YEAR * use.capacity_j
    day_j = plan.activities_per_day * activity_j + use.between_mw * 1e-3 * rest_s + lost_j
    return use.capacity_j / day_j if day_j > 0.0 else math.inf


@dataclass(frozen=True, slots=True)
class Spread:
    """How long the nodes of a group last, those on mains power left out.

    Attributes:
        first: The one that dies first.
        median_days: When half of them are dead: of n, the ceil(n / 2)-th death.
        last: The one that dies last.
        count: How many they are.
    """

    first: Lifetime
    median_days: float
    last: Lifetime
    count: int


def spread_of(found: Sequence[Lifetime]) -> Spread | None:
    """First, median and last of some lifetimes; None if all are on mains power. Of equals, the first in order counts."""
    finite = [each for each in found if each.use.capacity_j < math.inf]
    if not finite:
        return None
    first = min(finite, key=lambda each: each.days)
    last = max(finite, key=lambda each: each.days)
    return Spread(first, median_low(each.days for each in finite), last, len(finite))


def assumptions(plan: DutyPlan, run: str, activity_s: float, deaths: int) -> list[str]:
    """What the extrapolation takes for granted, a sentence each.

    Args:
        plan: The nodes' day.
        run: Which run it is from, in words.
        activity_s: How long one activity takes.
        deaths: How many nodes ran empty within the run.
    """
    share = plan.activities_per_day * activity_s / S_PER_DAY
    held = "one activity" if plan.activities_per_run == 1 else f"{plan.activities_per_run} equal activities"
    said = [
        f"Taken from {run}, as {held} of {activity_s:g} s; {plan.activities_per_day:g} a day take {100 * share:.3g} % "
        "of its time.",
        "Linear: every activity costs each node what it cost in this run, on average, for as long as the node lives. "
        "Nothing changes when others die, and no other run (seed) was looked at.",
        f"Between activities {_between(plan)}, the processor sleeps, the sensor is off, and nothing is sent or received: "
        "no time synchronisation, beacons or waking for others beyond what the run holds.",
        "Batteries give all of their stated energy at any draw: no rate effect, no recovery, no ageing or temperature, no "
        "harvesting.",
    ]
    percent = plan.self_discharge_percent_per_year
    said.append(
        f"Self-discharge takes {percent:g} % of the stated energy a year, evenly." if percent else "No self-discharge."
    )
    if deaths:
        said.append(
            f"{deaths} node(s) ran empty within the run itself: an activity is taken to cost each what it would have at the "
            "rate at which it ran empty."
        )
    return said


def _between(plan: DutyPlan) -> str:
    if plan.between == "low_power_listening":
        return f"the radio listens for {100 * plan.listen_share:g} % of the time and is powered down for the rest"
    return {
        "power_down": "the radio is powered down",
        "idle": "the radio is idle with its oscillator on",
        "listen": "the radio listens",
    }[plan.between]
