"""Statistics of a study's trials: tables in, tables out.

    results = load_study("runs/csmp-tolerance")
    axes = results.info.axis_names
    summary = aggregate(results.trials, axes, ["association_error", "energy_j"])
    differences = paired_differences(results.trials, axes, "tolerance", 0, ["energy_j"])

Failed trials and missing figures are left out, and `n` says how many are left; truth values count as 0 and 1; intervals are
95 % t intervals, and missing (NaN) where there are too few figures. The order of the rows given changes nothing.
"""

from collections.abc import Sequence

import pandas as pd

from netsim.study.cells import cells_of, figures_of
from netsim.study.differences import paired_differences, unpaired_differences, variant_differences
from netsim.study.pareto import pareto_candidates, pareto_set
from netsim.study.published import published_table
from netsim.study.samples import holm, sample_of
from netsim.study.verdicts import flips, verdicts

__all__ = [
    "aggregate",
    "flips",
    "holm",
    "paired_differences",
    "pareto_candidates",
    "pareto_set",
    "published_table",
    "unpaired_differences",
    "variant_differences",
    "verdicts",
]


def aggregate(trials: pd.DataFrame, axes: Sequence[str], metrics: Sequence[str]) -> pd.DataFrame:
    """Mean and 95 % interval of each metric for each variant.

    Args:
        trials: One row a trial (see `StudyResults.trials`).
        axes: Columns that tell what a variant is.
        metrics: Names of metrics; one that no trial has gives rows with n = 0.

    Returns:
        A row for each variant and metric: `variant`, the axes, `metric`, `n` (figures), `mean`, `sd` (n - 1 below the line),
        `se` (sd over the root of n), `low` and `high` (NaN below two figures, and below six that are all equal).

    Raises:
        ScenarioError: If the table lacks a column, or holds a variant's repetition twice.
    """
    cells = cells_of(trials, axes)
    rows = [
        (
            cell.variant,
            *cell.levels.values(),
            metric,
            sample.n,
            sample.mean,
            sample.sd,
            sample.se,
            sample.low,
            sample.high,
        )
        for metric in metrics
        for figures in [figures_of(trials, metric)]
        for cell in cells
        for sample in [sample_of(figures.of(cell))]
    ]
    return pd.DataFrame(rows, columns=["variant", *axes, "metric", "n", "mean", "sd", "se", "low", "high"])
