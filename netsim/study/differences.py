"""Differences between variants, with intervals.

All variants of a study see the same targets, noise and shadowing in one repetition. What these contribute to a figure, they
contribute to both of two variants, and the difference *within a repetition* is free of it: the paired difference needs far
fewer repetitions than one between independent means (Law, "Simulation Modeling and Analysis", 5th ed. 2015, sections 10.2.1
and 11.2: paired-t interval, common random numbers).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from netsim.errors import ScenarioError
from netsim.study.cells import Cell, Figures, cells_of, figures_of
from netsim.study.levels import label_of, words
from netsim.study.samples import Sample, are_equal, differences_of, holm, moments, paired_sample, welch
from netsim.study.schema import Level

LOWER: Final = "lower"
HIGHER: Final = "higher"
EQUAL: Final = "equal"
"""In every pair the two figures are one and the same."""
UNDECIDED: Final = "no difference shown"
"""The interval holds 0."""
TOO_FEW: Final = "too few pairs"
"""There is no interval: fewer than two pairs, or fewer than six that differ by the very same amount."""

COLUMNS: Final = (
    *("n", "n_baseline", "baseline_mean", "mean"),
    *("difference", "se", "low", "high", "relative"),
    *("p", "p_holm", "verdict"),
)


@dataclass(frozen=True, slots=True)
class Difference:
    """How much higher one variant's figure is than another's.

    Attributes:
        n: Pairs, or trials of the variant.
        n_baseline: Pairs, or trials of the baseline.
        baseline_mean: Mean of the baseline over these.
        mean: Mean of the variant.
        sample: The difference.
        verdict: One of the words above.
    """

    n: int
    n_baseline: int
    baseline_mean: float
    mean: float
    sample: Sample
    verdict: str

    def row(self) -> dict[str, Any]:
        """As in the tables; `p_holm` is yet to come."""
        sample = self.sample
        base = abs(self.baseline_mean)
        return {
            "n": self.n,
            "n_baseline": self.n_baseline,
            "baseline_mean": self.baseline_mean,
            "mean": self.mean,
            "difference": sample.mean,
            "se": sample.se,
            "low": sample.low,
            "high": sample.high,
            "relative": sample.mean / base if base > 0 else math.nan,
            "p": sample.p,
            "verdict": self.verdict,
        }


Compare = Callable[[Figures, Cell, Cell], Difference]


def paired(figures: Figures, cell: Cell, baseline: Cell) -> Difference:
    """The mean difference within pairs: trials of the same repetition and seed, both with a figure."""
    values, others = figures.pairs(cell, baseline)
    apart = differences_of(values, others)
    sample = paired_sample(values, others)
    verdict = EQUAL if apart and not any(apart) else verdict_of(sample)
    return Difference(len(values), len(others), moments(others)[0], moments(values)[0], sample, verdict)


def unpaired(figures: Figures, cell: Cell, baseline: Cell) -> Difference:
    """The difference of the means, as if the trials had drawn independently (Welch)."""
    values, others = figures.of(cell), figures.of(baseline)
    sample = welch(values, others)
    same = are_equal([*values, *others]) and min(len(values), len(others)) > 0
    verdict = EQUAL if same else verdict_of(sample)
    return Difference(len(values), len(others), moments(others)[0], moments(values)[0], sample, verdict)


def verdict_of(sample: Sample) -> str:
    """What an interval of a difference shows."""
    if math.isnan(sample.low):
        return TOO_FEW
    return HIGHER if sample.low > 0 else LOWER if sample.high < 0 else UNDECIDED


def paired_differences(
    trials: pd.DataFrame, axes: Sequence[str], axis: str, baseline: Level, metrics: Sequence[str]
) -> pd.DataFrame:
    """Every other level of an axis against one, repetition by repetition, at each combination of the other axes' levels.

    Args:
        trials: One row a trial (see `StudyResults.trials`).
        axes: All axes of the study.
        axis: The one along which levels are compared.
        baseline: The level that the others are compared with.
        metrics: Names of metrics; one that no trial has gives rows without figures.

    Returns:
        A row for each combination of the others, metric and level: the other axes, `axis` (the level compared), `metric`,
        `n` (pairs), `n_baseline` (the same), `baseline_mean` and `mean` over these pairs, `difference` with its standard
        error `se` and 95 % interval `low` to `high` (NaN where there are too few pairs), `relative` (difference over
        the magnitude of baseline_mean; NaN where that is 0), `p` of the paired t test, `p_holm` (adjusted for all
        comparisons of this metric in the table: below 0.05 it stands even though many were made), `verdict`: "lower" or
        "higher" where the interval excludes 0, "equal" where every pair is, "no difference shown", or "too few pairs".

    Raises:
        ScenarioError: If axis or baseline are not in the table, or `axes` leaves out one that matters.
    """
    return _along(trials, axes, axis, baseline, metrics, paired)


def unpaired_differences(
    trials: pd.DataFrame, axes: Sequence[str], axis: str, baseline: Level, metrics: Sequence[str]
) -> pd.DataFrame:
    """As `paired_differences`, as if the variants had drawn independently: Welch's interval, wider where they have not.

    `n` and `n_baseline` are the trials with a figure on either side.
    """
    return _along(trials, axes, axis, baseline, metrics, unpaired)


def variant_differences(
    trials: pd.DataFrame, baseline: int, variants: Sequence[int], metrics: Sequence[str]
) -> pd.DataFrame:
    """Some variants against another, repetition by repetition, wherever on the axes they stand.

    Args:
        trials: One row a trial.
        baseline: Number of the variant that the others are compared with.
        variants: The others' numbers; the baseline's own is passed over.
        metrics: Names of metrics.

    Returns:
        A row for each variant and metric: `variant`, `metric`, then as in `paired_differences`.

    Raises:
        ScenarioError: If one of the variants has no trials.
    """
    cells = {cell.variant: cell for cell in cells_of(trials, ())}
    for number in (baseline, *variants):
        if number not in cells:
            message = f"variant {number}: expected one with trials, got none; there are {', '.join(map(str, cells))}"
            raise ScenarioError(message)
    rows = [
        {"variant": number, "metric": metric, **paired(figures, cells[number], cells[baseline]).row()}
        for metric in metrics
        for figures in [figures_of(trials, metric)]
        for number in variants
        if number != baseline
    ]
    return _table(rows, ["variant", "metric"])


def _along(
    trials: pd.DataFrame, axes: Sequence[str], axis: str, baseline: Level, metrics: Sequence[str], compare: Compare
) -> pd.DataFrame:
    if axis not in axes:
        message = f"axis to compare along: expected one of {', '.join(axes) or 'none: there are no axes'}, got {axis!r}"
        raise ScenarioError(message)
    others = [each for each in axes if each != axis]
    couples = list(_couples(cells_of(trials, axes), axes, axis, baseline))
    rows = [
        {
            **{each: cell.levels[each] for each in others},
            axis: cell.levels[axis],
            "metric": metric,
            **compare(figures, cell, base).row(),
        }
        for metric in metrics
        for figures in [figures_of(trials, metric)]
        for cell, base in couples
    ]
    return _table(rows, [*others, axis, "metric"])


def _couples(cells: Sequence[Cell], axes: Sequence[str], axis: str, baseline: Level) -> Iterator[tuple[Cell, Cell]]:
    """Each variant with the one at the baseline that is like it otherwise."""
    by_labels: dict[tuple[str, ...], Cell] = {}
    for cell in cells:
        if by_labels.setdefault(cell.labels(axes), cell) is not cell:
            message = (
                f"axes {', '.join(axes)}: expected one variant at {words(cell.levels)}, got "
                f"{by_labels[cell.labels(axes)].variant} and {cell.variant}; give all axes of the study"
            )
            raise ScenarioError(message)
    place, wanted = list(axes).index(axis), label_of(baseline)
    if cells and not any(labels[place] == wanted for labels in by_labels):
        known = ", ".join(dict.fromkeys(labels[place] for labels in by_labels))
        message = f"baseline of axis {axis}: expected one of {known}, got {wanted}"
        raise ScenarioError(message)
    for labels, cell in by_labels.items():
        base = by_labels.get((*labels[:place], wanted, *labels[place + 1 :]))
        if labels[place] != wanted and base is not None:
            yield cell, base


def _table(rows: list[dict[str, Any]], head: list[str]) -> pd.DataFrame:
    """The rows as a table, with p adjusted for all comparisons of a metric."""
    table = pd.DataFrame(rows, columns=[*head, *COLUMNS])
    for positions in table.groupby("metric", sort=False).indices.values():
        adjusted = holm([rows[position]["p"] for position in positions])
        table.loc[table.index[positions], "p_holm"] = adjusted
    return table.astype({"p_holm": float, "n": int, "n_baseline": int})
