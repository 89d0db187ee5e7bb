"""Ways of targets from CSV files."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from netsim.errors import Finding, ScenarioError
from netsim.models.csv_rows import csv_rows, number
from netsim.parameters import NonNegative, parameters
from netsim.units import NS_PER_S, s_to_ns

COLUMNS = ("time_s", "x_m", "y_m")
TARGET = "target"
_ORDER = "order the rows of a target"


@parameters
class TrackPoint:
    """Where a target is at a time."""

    at_s: NonNegative
    """When, in simulated time."""
    x_m: float
    """Where."""
    y_m: float
    """Where."""


@dataclass(frozen=True, slots=True)
class _Row:
    """A line of a file: number, name of the target, and the cells under `COLUMNS`."""

    line: int
    target: str
    cells: tuple[str, ...]


def read_track(path: Path, target: str | None = None) -> tuple[TrackPoint, ...]:
    """The way of a target in a CSV file.

    Args:
        path: The file, in UTF-8, with the columns `time_s`, `x_m` and `y_m` in any order, of several targets with `target`
            besides. Empty lines are skipped; the rows of a target stand in the order of their times.
        target: Which of several: what stands in its column `target`.

    Raises:
        ScenarioError: If there is no such file, or with every wrong line: a wrong header, a wrong number of columns, a time
            that is not above the one before, a number that is not finite; if the target is not in it, must be said, or has
            fewer than two points.
    """
    lines = csv_rows(path, "a target's ways")
    if findings := list(_shape_findings(str(path), lines)):
        raise ScenarioError(findings)
    rows = _chosen(str(path), _rows(lines), lines[0][1], target)
    if findings := list(_row_findings(str(path), rows)):
        raise ScenarioError(findings)
    values = ([float(cell) for cell in row.cells] for row in rows)
    return tuple(TrackPoint(at_s=at_s, x_m=x_m, y_m=y_m) for at_s, x_m, y_m in values)


def _shape_findings(file: str, lines: Sequence[tuple[int, list[str]]]) -> Iterator[Finding]:
    """What is wrong with the header or with the number of cells in a line."""
    first, header = lines[0] if lines else (1, [])
    if sorted(header) not in (sorted(COLUMNS), sorted((*COLUMNS, TARGET))):
        expected = f"the header `{','.join(COLUMNS)}`"
        yield Finding(file, first, "", expected, f"`{','.join(header)}`", f"a column `{TARGET}` may be added")
        return
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            yield Finding(file, line, "", f"{len(header)} columns", f"{len(cells)}")


def _rows(lines: Sequence[tuple[int, list[str]]]) -> list[_Row]:
    header = lines[0][1]
    places = [header.index(name) for name in COLUMNS]
    target = header.index(TARGET) if TARGET in header else None
    return [
        _Row(line, "" if target is None else cells[target], tuple(cells[place] for place in places))
        for line, cells in lines[1:]
    ]


def _chosen(file: str, rows: Sequence[_Row], header: Sequence[str], target: str | None) -> list[_Row]:
    """The rows of one target."""
    known = ", ".join(f"`{name}`" for name in dict.fromkeys(row.target for row in rows))
    if target is not None and TARGET not in header:
        finding = Finding(file, 1, "", f"a column `{TARGET}` to find `{target}` in", f"`{','.join(header)}`")
        raise ScenarioError([finding])
    if target is None and len({row.target for row in rows}) > 1:
        remedy = "say `target` in the track"
        raise ScenarioError([Finding(file, 1, TARGET, "one target", f"the targets {known}", remedy)])
    chosen = [row for row in rows if target is None or row.target == target]
    if not chosen and target is not None:
        raise ScenarioError([Finding(file, 1, TARGET, f"the target `{target}`", f"only {known or 'none'}")])
    if len(chosen) < 2:
        line = chosen[-1].line if chosen else 1
        raise ScenarioError([Finding(file, line, "", "at least two points of a target", f"{len(chosen)}")])
    return chosen


def _row_findings(file: str, rows: Sequence[_Row]) -> Iterator[Finding]:
    last_ns = -1
    for row in rows:
        at_s, *place_m = (number(cell) for cell in row.cells)
        for column, cell, value in zip(COLUMNS[1:], row.cells[1:], place_m, strict=True):
            if not math.isfinite(value):
                yield Finding(file, row.line, column, "a number of metres", f"`{cell}`")
        if not math.isfinite(at_s) or s_to_ns(at_s) <= last_ns:
            known = ("a time from 0 s on", "") if last_ns < 0 else (f"a time above {last_ns / NS_PER_S:g} s", _ORDER)
            yield Finding(file, row.line, COLUMNS[0], known[0], f"`{row.cells[0]}`", known[1])
        else:
            last_ns = s_to_ns(at_s)
