"""Tables whose columns have one kind each, and which Parquet and CSV give back alike."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from netsim.errors import ScenarioError, TraceError
from netsim.study.levels import label_of

WHOLE: Final = re.compile(r"[+-]?\d+")
DECIMAL: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
LARGEST: Final = 2**63 - 1


def typed(values: Sequence[Any]) -> "pd.Series[Any]":
    """A column of one kind, told by the values that there are.

    Integers stay integers even where some are missing (`Int64`), truth values likewise (`boolean`); numbers of both kinds
    become floats. Anything else, and integers that 64 bits do not hold, becomes text. A column without values is one of
    missing floats.

    Args:
        values: Strings, truth values and numbers; None or NaN for a missing one.
    """
    plain = [None if value is None or value != value else value for value in values]
    present = [value for value in plain if value is not None]
    kinds = {_kind(value) for value in present}
    complete = len(present) == len(plain)
    if not present:
        return pd.Series(math.nan, index=range(len(plain)), dtype="float64")
    if kinds == {bool}:
        return pd.Series(plain, dtype="bool" if complete else "boolean")
    if kinds == {int} and max(map(abs, present)) <= LARGEST:
        return pd.Series(plain, dtype="int64" if complete else "Int64")
    if kinds in ({float}, {int, float}):
        return pd.Series(plain, dtype="float64")
    return text([None if value is None else label_of(value) for value in plain])


def text(values: Sequence[Any]) -> "pd.Series[Any]":
    """A column of text; None for a missing one."""
    return pd.Series(values, dtype="str" if None not in values else None)


def write_tables(folder: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    """Write each table as Parquet and CSV, each file as a whole or not at all.

    Raises:
        TraceError: If one cannot be written.
    """
    for stem, table in tables.items():
        for suffix in (".parquet", ".csv"):
            path = folder / (stem + suffix)
            partial = path.with_name(path.name + ".partial")
            try:
                if suffix == ".csv":
                    table.to_csv(partial, index=False, lineterminator="\n", encoding="utf-8")
                else:
                    table.to_parquet(partial, index=False)
                partial.replace(path)
            except OSError as error:
                message = f"cannot write {path}: {error.strerror or error}"
                raise TraceError(message) from error


def read_table(path: Path, texts: Collection[str] = ()) -> pd.DataFrame:
    """A table that `write_tables` wrote, from its Parquet or its CSV file.

    Args:
        path: The file.
        texts: Columns that hold text even where it looks like numbers, or is empty.

    Raises:
        ScenarioError: If there is no such table.
    """
    try:
        return _read_csv(path, texts) if path.suffix == ".csv" else pd.read_parquet(path)
    except (OSError, ValueError) as error:
        got = "no such file" if isinstance(error, FileNotFoundError) else _reason(error)
        message = f"{path}: expected the table of a study, got: {got}; give the folder that `netsim study` wrote"
        raise ScenarioError(message) from error


def _read_csv(path: Path, texts: Collection[str]) -> pd.DataFrame:
    raw = pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")
    return pd.DataFrame({name: _column(raw[name].tolist(), name in texts) for name in raw})


def _column(cells: list[str], is_text: bool) -> "pd.Series[Any]":
    """A column of a CSV file with its kind: an empty cell is a missing value, but in text."""
    if is_text:
        return text(cells)
    present = {cell for cell in cells if cell}
    if present <= {"True", "False"}:
        return typed([cell == "True" if cell else None for cell in cells])
    if all(WHOLE.fullmatch(cell) for cell in present):
        return typed([int(cell) if cell else None for cell in cells])
    if all(DECIMAL.fullmatch(cell) for cell in present):
        return typed([float(cell) if cell else None for cell in cells])
    return typed([cell or None for cell in cells])


def _kind(value: Any) -> type:
    return next((kind for kind in (bool, int, float) if isinstance(value, kind)), str)


def _reason(error: Exception) -> str:
    known = error.strerror if isinstance(error, OSError) else str(error).partition("\n")[0]
    return known or type(error).__name__
