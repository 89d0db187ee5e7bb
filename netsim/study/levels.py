"""What a level is called: the one way to match levels from a study file, a table in memory, a Parquet and a CSV file.

A level of 1 read from a study file is 1.0 in a column that also holds 0.1, and `true` may come back as a numpy boolean: the
label is the same each time.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from netsim.study.schema import Level

NULL = "null"
"""Label of a level that is null."""


def label_of(level: Any) -> str:
    """The label of a level: `null`, `true`, `false`, a number as short as it goes, or the text itself.

    Args:
        level: A level as in a study file, or as in a table: numpy and pandas scalars too.
    """
    if level is None or level is pd.NA or level is pd.NaT:
        return NULL
    plain = level.item() if hasattr(level, "item") else level
    if isinstance(plain, bool):
        return "true" if plain else "false"
    if isinstance(plain, float):
        if math.isnan(plain):
            return NULL
        return str(int(plain)) if plain.is_integer() and abs(plain) < 1e15 else repr(plain)
    return str(plain)


def labels_of(table: pd.DataFrame, axis: str) -> list[str]:
    """The labels of a column of levels, row by row."""
    return [label_of(level) for level in table[axis].tolist()]


def at(table: pd.DataFrame, levels: Mapping[str, Level]) -> "pd.Series[bool]":
    """Which rows of a table stand at given levels, by the columns' names."""
    wanted = {axis: label_of(level) for axis, level in levels.items()}
    columns = [[label == wanted[axis] for label in labels_of(table, axis)] for axis in wanted]
    found = [all(row) for row in zip(*columns, strict=True)] if columns else [True] * len(table)
    return pd.Series(found, index=table.index, dtype=bool)


def words(levels: Mapping[str, Any]) -> str:
    """Levels in words: `radio=cc2420, exponent=3`."""
    return ", ".join(f"{axis}={label_of(level)}" for axis, level in levels.items())


def is_numeric(levels: Iterable[Any]) -> bool:
    """Whether all levels are numbers, so that they have an order and a distance."""
    return all(isinstance(level, int | float) and not isinstance(level, bool) and level == level for level in levels)


def column_of(levels: Sequence[Level]) -> list[Level]:
    """Levels of an axis as they stand in a column: of one kind each.

    Numbers stay numbers (all of them integers, or all of them floats), truth values and texts what they are; where kinds are
    mixed, or a level is null, all of them become labels, since no column of a Parquet or CSV file could keep them apart.

    Args:
        levels: The levels of the whole axis, in order.
    """
    if is_numeric(levels):
        return list(levels) if all(isinstance(level, int) for level in levels) else [float(level) for level in levels]  # type: ignore[arg-type]
    if all(isinstance(level, bool) for level in levels) or all(isinstance(level, str) for level in levels):
        return list(levels)
    return [label_of(level) for level in levels]
