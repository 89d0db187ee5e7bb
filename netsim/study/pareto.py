"""Which variants are worth having: those that no other beats in error and cost at once."""

import math
from collections.abc import Sequence
from itertools import combinations

import pandas as pd

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import metric_of
from netsim.study.cells import Cell, Figures, cells_of, figures_of
from netsim.study.differences import EQUAL, HIGHER, LOWER, paired
from netsim.study.samples import merged


def pareto_set(summary: pd.DataFrame, error: str, cost: str) -> list[int]:
    """The variants whose means no other variant's dominate: at least as good in both, better in one.

    Lower is better, unless the catalogue says higher. Of several variants with equal means, be it but for rounding, all are
    in the set; one without a mean of both is not.

    Args:
        summary: What `aggregate` gave, with both metrics.
        error: One metric.
        cost: The other.

    Returns:
        Their numbers, from the best error to the best cost.
    """
    means = [_means(summary, metric) for metric in (error, cost)]
    both = means[0].keys() & means[1].keys()
    errors, costs = (merged({variant: each[variant] for variant in both}) for each in means)
    points = sorted((errors[variant], costs[variant], variant) for variant in both)
    members, least = [], math.inf
    last: tuple[float, float] | None = None
    for first, second, variant in points:
        if second < least or (first, second) == last:
            members.append(variant)
            least, last = second, (first, second)
    return members


def pareto_candidates(trials: pd.DataFrame, error: str, cost: str) -> list[int]:
    """The variants of which it is not shown that another dominates them, repetition by repetition.

    Another is shown to dominate where its paired difference is better (the 95 % interval excludes 0) in one metric, and in
    the other better too or equal in every pair. The set is the more cautious one: it holds the true Pareto set's members
    unless an interval errs, and beside them those that these few repetitions cannot tell from it.

    Args:
        trials: One row a trial.
        error: One metric.
        cost: The other.

    Returns:
        Their numbers in order; those without a figure of both are left out.
    """
    both = [figures_of(trials, metric) for metric in (error, cost)]
    cells = [cell for cell in cells_of(trials, ()) if all(figures.of(cell) for figures in both)]
    return [cell.variant for cell in cells if not any(_dominates(both, other, cell) for other in cells)]


def indistinguishable(trials: pd.DataFrame, variants: Sequence[int], metrics: Sequence[str]) -> list[tuple[int, int]]:
    """The pairs of some variants between which no metric shows a difference, repetition by repetition.

    Args:
        trials: One row a trial.
        variants: Numbers of variants, such as a Pareto set.
        metrics: Names of metrics.

    Returns:
        The pairs, in the order of `variants`.
    """
    cells = {cell.variant: cell for cell in cells_of(trials, ())}
    figures = [figures_of(trials, metric) for metric in metrics]
    pairs = combinations([cells[variant] for variant in variants if variant in cells], 2)
    return [
        (one.variant, other.variant)
        for one, other in pairs
        if not any(paired(each, other, one).verdict in (LOWER, HIGHER) for each in figures)
    ]


def sign_of(metric: str) -> int:
    """1 where lower is better, or neither is known to be; -1 where higher is."""
    try:
        return -1 if metric_of(metric).better == "higher" else 1
    except ScenarioError:
        return 1


def _means(summary: pd.DataFrame, metric: str) -> dict[int, float]:
    """Means by variant, so that lower is better."""
    rows = summary[summary["metric"] == metric]
    sign = sign_of(metric)
    pairs = zip(rows["variant"].tolist(), rows["mean"].tolist(), strict=True)
    return {int(variant): sign * mean for variant, mean in pairs if not math.isnan(mean)}


def _dominates(both: Sequence[Figures], one: Cell, other: Cell) -> bool:
    """Whether one variant is shown to dominate another."""
    if one.variant == other.variant:
        return False
    better = False
    for figures in both:
        verdict = paired(figures, one, other).verdict
        if verdict == (LOWER if sign_of(figures.metric) > 0 else HIGHER):
            better = True
        elif verdict != EQUAL:
            return False
    return better
