"""A study's results, looked at in one way: which metrics, which axes are choices, what the statistics say."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import pandas as pd

from netsim.metrics.catalogue import DEFAULT_COSTS, DEFAULT_METRICS, ERROR_METRICS
from netsim.study.cells import figures_of
from netsim.study.info import AxisInfo, StudyInfo
from netsim.study.levels import label_of
from netsim.study.reporting.names import bounds_of, unit_of, variant_name
from netsim.study.reporting.numbers import Scale, scale_for
from netsim.study.results import StudyResults
from netsim.study.statistics import aggregate, paired_differences, pareto_candidates, pareto_set

CIRCUMSTANCES = ("fidelity", "medium", "problem", "field", "faults", "duration_s", "seed", "duty_plan")
"""Sections of a scenario that say how the world is. The other ones are a designer's choice."""
LIFETIMES = ("lifetime_first_dead_days", "lifetime_median_days", "lifetime_partition_days", "lifetime_accuracy_days")
"""Milestones of a duty plan, none of them before the first."""
PLACES = ("placement", "mobility", "name", "role")
"""What says so of a group of nodes."""
ALL_BUT_CONSTANT = 5e-3
"""A usual cost whose means spread by less than this share within every setting tells nobody what to choose."""

MOST_PAIRS = 1500
"""Among more pairs of variants it is not looked for those that repetitions cannot tell from a Pareto set."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean with its 95 % interval; NaN where there is none."""

    n: int
    mean: float
    se: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half the width of the interval."""
        return (self.high - self.low) / 2


NOTHING = Estimate(0, math.nan, math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class View:
    """What a report shows of a study.

    Attributes:
        results: The study.
        metrics: What is tabulated; all of them have figures.
        error: What tells how wrong an answer is; None if nothing does.
        costs: What it is held against.
        absent: Metrics asked for of which no trial has a figure.
        constant: Usual costs that are all but the same for all variants, and so are not among `costs`.
    """

    results: StudyResults
    metrics: tuple[str, ...]
    error: str | None
    costs: tuple[str, ...]
    absent: tuple[str, ...]
    constant: tuple[str, ...] = ()

    @property
    def info(self) -> StudyInfo:
        """What was asked."""
        return self.results.info

    @cached_property
    def ended(self) -> pd.DataFrame:
        """The trials that have figures."""
        trials = self.results.trials
        return trials[trials["status"] == "ok"]

    @cached_property
    def shown(self) -> tuple[str, ...]:
        """Every metric that any table or plot shows, once each."""
        error = () if self.error is None else (self.error,)
        published = tuple(each.metric for each in self.info.published)
        return tuple(dict.fromkeys((*error, *self.metrics, *self.costs, *published, *self.lifetimes)))

    @cached_property
    def lifetimes(self) -> tuple[str, ...]:
        """The milestones of a duty plan, if there is one; without a figure where a milestone is never reached."""
        return tuple(name for name in LIFETIMES if name in self.results.trials.columns)

    @cached_property
    def compared(self) -> tuple[str, ...]:
        """The metrics that alternatives are compared by."""
        return (() if self.error is None else (self.error,)) + self.costs

    @cached_property
    def summary(self) -> pd.DataFrame:
        """Means and intervals (see `aggregate`) of what is shown."""
        return aggregate(self.results.trials, self.info.axis_names, self.shown)

    @cached_property
    def differences(self) -> pd.DataFrame | None:
        """Paired differences against the baseline; None without an axis to compare along, or without its baseline."""
        info, trials = self.info, self.results.trials
        if info.compare_axis is None or trials.empty:
            return None
        if label_of(info.baseline) not in map(label_of, trials[info.compare_axis].tolist()):
            return None
        found = paired_differences(trials, info.axis_names, info.compare_axis, info.baseline, self.shown)
        return found if len(found) else None

    @cached_property
    def estimates(self) -> Mapping[tuple[int, str], Estimate]:
        """The same by variant and metric."""
        columns = ["variant", "metric", "n", "mean", "se", "low", "high"]
        rows = zip(*(self.summary[column].tolist() for column in columns), strict=True)
        return {(int(row[0]), row[1]): Estimate(int(row[2]), *map(float, row[3:])) for row in rows}

    def estimate(self, variant: int, metric: str) -> Estimate:
        """A metric of a variant; without a figure where there is none."""
        return self.estimates.get((variant, metric), NOTHING)

    def drawn(self, variant: int, metric: str) -> tuple[float, float, float]:
        """Mean and ends of the interval as a plot shows them: in the metric's unit there, and within what it can be.

        Both ends are the mean where there is no interval, and all three NaN where there is no figure.
        """
        found, factor, (least, most) = self.estimate(variant, metric), self.scale(metric).factor, bounds_of(metric)
        low, high = (found.mean if math.isnan(end) else min(max(end, least), most) for end in (found.low, found.high))
        return found.mean * factor, low * factor, high * factor

    def single(self, variant: int, metric: str) -> list[float]:
        """A metric of each trial of a variant that has a figure of it."""
        numbers = figures_of(self.ended[self.ended["variant"] == variant], metric).numbers
        return [number for number in numbers if number is not None]

    def scale(self, metric: str) -> Scale:
        """The unit that a metric is shown in, the same in all tables and plots."""
        means = [found.mean for (_, name), found in self.estimates.items() if name == metric]
        return scale_for(unit_of(metric), means)

    @cached_property
    def variants(self) -> tuple[int, ...]:
        """The variants that have figures of any trial."""
        there = set(self.ended["variant"].tolist())
        return tuple(each.number for each in self.info.variants if each.number in there)

    def levels(self, variant: int) -> Mapping[str, Any]:
        """A variant's levels by axis."""
        return self.info.variants[variant].levels

    def name(self, variant: int, left_out: Sequence[str] = ()) -> str:
        """A variant in words."""
        return variant_name(self.levels(variant), self.info.axes, left_out) or self.info.variants[variant].scenario

    @cached_property
    def conditions(self) -> tuple[AxisInfo, ...]:
        """Axes that say how the world is, not what one would choose."""
        return tuple(axis for axis in self.info.axes if axis.name != self.info.compare_axis and _is_condition(axis))

    @cached_property
    def choices(self) -> tuple[AxisInfo, ...]:
        """The other axes; that of the comparison first."""
        rest = [axis for axis in self.info.axes if axis not in self.conditions]
        return tuple(sorted(rest, key=lambda axis: axis.name != self.info.compare_axis))

    @cached_property
    def settings(self) -> Mapping[str, tuple[int, ...]]:
        """The variants with figures by where they stand on the conditions, in words; one group without any."""
        names = [axis.name for axis in self.choices]
        groups: dict[str, list[int]] = {}
        for variant in self.variants:
            where = self.name(variant, names) if self.conditions else ""
            groups.setdefault(where, []).append(variant)
        return {where: tuple(found) for where, found in groups.items()}

    def is_all_but_constant(self, metric: str) -> bool:
        """Whether a metric's means are the same for all variants of each setting, as near as makes no difference."""
        groups = [[self.estimate(number, metric).mean for number in found] for found in self.settings.values()]
        means = [[mean for mean in group if not math.isnan(mean)] for group in groups]
        spreads = [max(group) - min(group) <= ALL_BUT_CONSTANT * max(map(abs, group)) for group in means if group]
        return all(spreads) and any(len(group) > 1 for group in means)

    @cached_property
    def trial_counts(self) -> Mapping[int, int]:
        """How many trials of each variant have ended."""
        return Counter(map(int, self.ended["variant"].tolist()))

    def is_whole(self, variant: int, metric: str) -> bool:
        """Whether every trial of a variant that ended has a figure of a metric."""
        return self.estimate(variant, metric).n == self.trial_counts[variant]

    def pareto(self, cost: str, variants: Sequence[int]) -> list[int]:
        """Those of some variants that no other of them beats in error and cost at once, from the best error on."""
        if self.error is None or cost == self.error:
            return []
        rows = self.summary[self.summary["variant"].isin(variants)]
        return pareto_set(rows, self.error, cost)

    def candidates(self, cost: str) -> list[int]:
        """The variants of which it is not shown that another of their setting dominates them; none with too many pairs."""
        groups = list(self.settings.values())
        pairs = sum(math.comb(len(group), 2) for group in groups)
        if self.error is None or cost == self.error or len(self.info.repetitions) < 2 or pairs > MOST_PAIRS:
            return []
        if cost not in self._candidates:
            self._candidates[cost] = pareto_candidates(self.ended, self.error, cost, groups)
        return self._candidates[cost]

    @cached_property
    def _candidates(self) -> dict[str, list[int]]:
        """What was found of each cost."""
        return {}


def view_of(results: StudyResults) -> View:
    """Choose what to show: what the study asks for, else the usual metrics, as far as there are figures of them."""
    info = results.info
    has = {name for name in results.trials.columns if _has_figures(results.trials, name)}
    errors = (info.error,) if info.error is not None else tuple(name for name in ERROR_METRICS if name in has)
    error = errors[0] if errors and errors[0] in has else None
    metrics = tuple(name for name in info.metrics or DEFAULT_METRICS if name in has)
    costs = tuple(name for name in info.costs or DEFAULT_COSTS if name in has and name != error)
    wanted = (*info.metrics, *info.costs, *((info.error,) if info.error is not None else ()))
    absent = tuple(dict.fromkeys(name for name in wanted if name not in has))
    view = View(results, metrics, error, costs, absent)
    constant = () if info.costs else tuple(name for name in costs if view.is_all_but_constant(name))
    if len(constant) == len(costs):
        return view
    return replace(view, costs=tuple(name for name in costs if name not in constant), constant=constant)


def _has_figures(trials: pd.DataFrame, name: str) -> bool:
    return any(number is not None for number in figures_of(trials, name).numbers)


def _is_condition(axis: AxisInfo) -> bool:
    """Whether all that an axis changes says how the world is."""
    return bool(axis.paths) and all(_tells_the_world(path) for path in axis.paths)


def _tells_the_world(path: str) -> bool:
    words = path.replace("[", ".").replace("]", "").split(".")
    return words[0] in CIRCUMSTANCES or (words[0] == "nodes" and any(word in PLACES for word in words[1:]))
