"""Which variant is better than every other beyond doubt, by the same rule as all verdicts of a report."""

from collections.abc import Sequence

from netsim.study.differences import HIGHER, LOWER
from netsim.study.levels import label_of
from netsim.study.reporting.names import better_of
from netsim.study.reporting.phrases import rows_of, verdict_of
from netsim.study.reporting.view import View
from netsim.study.samples import CONFIDENCE, holm
from netsim.study.statistics import variant_differences


def clear_winners(view: View, metric: str) -> set[int]:
    """In each setting the variant that is better in a metric than every other, after Holm's adjustment.

    The adjustment is for all comparisons made here, the best variant of each setting with every other of its setting; and
    where the table of differences compares the same pair, it says the same. There is no winner where a variant lacks a
    figure in some trial: what is missing may be the best (a lifetime that never ends) or the worst.
    """
    better = better_of(metric)
    groups = [found for found in view.settings.values() if better and _are_whole(view, metric, found)]
    tables = [_against_best(view, metric, found) for found in groups]
    adjusted = iter(holm([p for _, found in tables for p, _ in found]))
    wanted = HIGHER if better == "lower" else LOWER  # what the others must be
    winners = set()
    for best, found in tables:
        sure = [next(adjusted) < 1 - CONFIDENCE and verdict == wanted for _, verdict in found]
        if all(sure) and _agrees(view, metric, best):
            winners.add(best)
    return winners


def _are_whole(view: View, metric: str, variants: Sequence[int]) -> bool:
    return len(variants) > 1 and all(view.is_whole(variant, metric) for variant in variants)


def _against_best(view: View, metric: str, variants: Sequence[int]) -> tuple[int, list[tuple[float, str]]]:
    """The variant of the best mean, and of every other against it the p-value and the verdict."""
    sign = 1 if better_of(metric) == "lower" else -1
    best = min(variants, key=lambda variant: sign * view.estimate(variant, metric).mean)
    table = variant_differences(view.results.trials, best, variants, [metric])
    return best, list(zip(table["p"].tolist(), table["verdict"].tolist(), strict=True))


def _agrees(view: View, metric: str, best: int) -> bool:
    """Whether the verdicts against the study's baseline, adjusted for all of them, make the same variant the better one."""
    axis = view.info.compare_axis
    if axis is None:
        return True
    levels, wanted = dict(view.levels(best)), "better"
    if label_of(levels[axis]) == label_of(view.info.baseline):
        del levels[axis]
        wanted = "worse"
    return all(verdict_of(row) == wanted for row in rows_of(view, metric, levels))
