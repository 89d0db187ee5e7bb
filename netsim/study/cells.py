"""The trials of a study by variant, and their figures as plain numbers: what the statistics are made of."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from netsim.errors import ScenarioError
from netsim.study.levels import label_of
from netsim.study.samples import Number

Draw = tuple[int, int]
"""What fixes the random numbers of a trial: its repetition and seed. Trials of one draw are a pair."""


@dataclass(frozen=True)
class Cell:
    """The trials of one variant.

    Attributes:
        variant: Its number.
        levels: Its levels as they stand in the table.
        rows: Positions of its trials in the table, by draw, in order.
    """

    variant: int
    levels: Mapping[str, Any]
    rows: Mapping[Draw, int]

    def labels(self, axes: Sequence[str]) -> tuple[str, ...]:
        """What it is called on some of the axes."""
        return tuple(label_of(self.levels[axis]) for axis in axes)


@dataclass(frozen=True)
class Figures:
    """One metric of every trial.

    Attributes:
        metric: Its name.
        numbers: One a row of the table, truth values as 0 and 1; None for a trial that failed, and where the figure is
            missing, not finite or no number.
    """

    metric: str
    numbers: Sequence[Number | None]

    def of(self, cell: Cell) -> list[Number]:
        """Those of a variant, as far as there are any."""
        return [number for row in cell.rows.values() if (number := self.numbers[row]) is not None]

    def pairs(self, cell: Cell, baseline: Cell) -> tuple[list[Number], list[Number]]:
        """Those of two variants where both have one for the same draw."""
        first, second = [], []
        for draw, row in cell.rows.items():
            number, other = self.numbers[row], self.numbers[baseline.rows[draw]] if draw in baseline.rows else None
            if number is not None and other is not None:
                first.append(number)
                second.append(other)
        return first, second


def figures_of(trials: pd.DataFrame, metric: str) -> Figures:
    """A metric of the trials; without a figure anywhere if the table has no such column."""
    values = trials[metric].tolist() if metric in trials else [None] * len(trials)
    ended = trials["status"].tolist() if "status" in trials else ["ok"] * len(trials)
    return Figures(metric, [_number(value) if one == "ok" else None for value, one in zip(values, ended, strict=True)])


def cells_of(trials: pd.DataFrame, axes: Sequence[str]) -> list[Cell]:
    """The variants that have trials, in the order of their numbers.

    Args:
        trials: One row a trial, in any order, with the columns `variant`, `repetition` and the axes'.
        axes: The axes.

    Raises:
        ScenarioError: If a column is missing, or a variant has two trials that drew the same.
    """
    _require(trials, ("variant", "repetition", *axes))
    seeds = trials["seed"].tolist() if "seed" in trials else [0] * len(trials)
    draws = list(zip(map(int, trials["repetition"].tolist()), map(int, seeds), strict=True))
    variants = list(map(int, trials["variant"].tolist()))
    rows: dict[int, dict[Draw, int]] = {}
    for row in sorted(range(len(trials)), key=lambda row: (variants[row], draws[row])):
        found = rows.setdefault(variants[row], {})
        if draws[row] in found:
            message = (
                f"the table of trials: expected each repetition of variant {variants[row]} once, "
                f"got repetition {draws[row][0]} twice; put tables together only if their repetitions differ"
            )
            raise ScenarioError(message)
        found[draws[row]] = row
    levels = {axis: trials[axis].tolist() for axis in axes}
    return [
        Cell(variant, {axis: levels[axis][next(iter(found.values()))] for axis in axes}, found)
        for variant, found in rows.items()
    ]


def _require(trials: pd.DataFrame, columns: Sequence[str]) -> None:
    missing = [column for column in columns if column not in trials]
    if missing:
        message = (
            f"the table of trials: expected a column `{missing[0]}`, got {', '.join(map(str, trials.columns[:12]))}, ...; "
            "give the table that `load_results` reads"
        )
        raise ScenarioError(message)


def _number(value: Any) -> Number | None:
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, int):
        return value
    return value if isinstance(value, float) and math.isfinite(value) else None
