"""Which variants are worth having: those that no other beats in error and cost at once."""

import math
from collections.abc import Sequence
from itertools import combinations

import pandas as pd

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import metric_of
from netsim.study.cells import Cell, Figures, cells_of, figures_of
from netsim.study.differences import EQUAL, HIGHER, LOWER, paired
from netsim.study.samples import CONFIDENCE, holm, merged

BETTER, WORSE = "better", "worse"


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


def pareto_candidates(
    trials: pd.DataFrame, error: str, cost: str, groups: Sequence[Sequence[int]] | None = None
) -> list[int]:
    """The variants of which it is not shown that another of their group dominates them, repetition by repetition.

    Another is shown to dominate where its paired difference is better in one metric (the 95 % interval excludes 0, even
    after Holm's adjustment for all pairs of the metric), and in the other better too or equal in every pair. The set is the
    more cautious one: it holds the true Pareto sets' members unless an interval errs, and beside them those that these few
    repetitions cannot tell from them.

    Args:
        trials: One row a trial.
        error: One metric.
        cost: The other.
        groups: Numbers of the variants that are held against each other; None for all in one group.

    Returns:
        Their numbers in order; those without a figure of both are left out.
    """
    both = [figures_of(trials, metric) for metric in (error, cost)]
    cells = {cell.variant: cell for cell in cells_of(trials, ()) if all(figures.of(cell) for figures in both)}
    lots = [list(cells)] if groups is None else [[number for number in lot if number in cells] for lot in groups]
    pairs = [(cells[one], cells[other]) for lot in lots for one, other in combinations(lot, 2)]
    beaten = _beaten(pairs, [_shown(figures, pairs) for figures in both])
    return sorted({number for lot in lots for number in lot} - beaten)


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


def _shown(figures: Figures, pairs: Sequence[tuple[Cell, Cell]]) -> list[str]:
    """What is shown of the first of each pair: BETTER, WORSE, EQUAL, or else nothing."""
    found = [paired(figures, one, other) for one, other in pairs]
    words = {LOWER: BETTER, HIGHER: WORSE} if sign_of(figures.metric) > 0 else {LOWER: WORSE, HIGHER: BETTER}
    words[EQUAL] = EQUAL
    adjusted = holm([each.sample.p for each in found])
    return [
        words.get(each.verdict, "") if each.verdict == EQUAL or p < 1 - CONFIDENCE else ""
        for each, p in zip(found, adjusted, strict=True)
    ]


def _beaten(pairs: Sequence[tuple[Cell, Cell]], shown: Sequence[Sequence[str]]) -> set[int]:
    """The variants that another is shown to dominate: better in one metric, better or equal in the other."""
    beaten = set()
    for (one, other), *words in zip(pairs, *shown, strict=True):
        for loser, won in ((other.variant, BETTER), (one.variant, WORSE)):
            if won in words and all(word in (won, EQUAL) for word in words):
                beaten.add(loser)
    return beaten
