"""Positions of nodes from a CSV file with the header `id,x_m,y_m` or `id,x_m,y_m,name`."""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from netsim.errors import Finding, ScenarioError
from netsim.reading.reasons import why_unreadable

HEADERS = (["id", "x_m", "y_m"], ["id", "x_m", "y_m", "name"])
LAST_ID = 65_533
"""Highest node id: the last short address of IEEE 802.15.4 (7.5.8 keeps 0xfffe and 0xffff)."""


@dataclass(frozen=True, slots=True)
class PlacedNode:
    """Where one node stands.

    Attributes:
        id: Its id, if the placement says so (CSV only).
        name: Its name, if the placement says so (CSV only).
        x_m: Position.
        y_m: Position.
    """

    id: int | None
    name: str | None
    x_m: float
    y_m: float


def read_nodes(path: Path) -> list[PlacedNode]:
    """The nodes of a CSV file, in the file's order.

    Args:
        path: The file, in UTF-8. Empty lines are skipped; an empty name is no name.

    Raises:
        ScenarioError: If there is no such file, or with every wrong line: a wrong header, a wrong number of columns, an
            id that is not a whole number from 0 to `LAST_ID` or comes twice, a coordinate that is not a finite number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        message = f"{path}: expected a CSV file of nodes, got: {why_unreadable(path, error)}"
        raise ScenarioError(message) from error
    findings = list(_findings(str(path), rows))
    if findings:
        raise ScenarioError(findings)
    return [_node(row) for _, row in rows[1:]]


def _node(row: list[str]) -> PlacedNode:
    name = row[3] if len(row) > 3 else ""
    return PlacedNode(id=int(row[0]), name=name or None, x_m=float(row[1]), y_m=float(row[2]))


def _findings(file: str, rows: list[tuple[int, list[str]]]) -> Iterator[Finding]:
    if not rows or rows[0][1] not in HEADERS:
        line, header = rows[0] if rows else (1, [])
        yield Finding(file, line, "", "the header `id,x_m,y_m` or `id,x_m,y_m,name`", f"`{','.join(header)}`")
        return
    if len(rows) == 1:
        yield Finding(file, rows[0][0], "", "at least one node below the header", "none")
    first_line: dict[int, int] = {}
    for line, row in rows[1:]:
        if len(row) != len(rows[0][1]):
            yield Finding(file, line, "", f"{len(rows[0][1])} columns", f"{len(row)}")
            continue
        yield from _id_findings(file, line, row[0], first_line)
        yield from _coordinate_findings(file, line, row)


def _id_findings(file: str, line: int, text: str, first_line: dict[int, int]) -> Iterator[Finding]:
    number = int(text) if text.isascii() and text.isdigit() else -1
    if not 0 <= number <= LAST_ID:
        yield Finding(file, line, "id", f"a whole number from 0 to {LAST_ID}", f"`{text}`")
    elif first_line.setdefault(number, line) != line:
        yield Finding(file, line, "id", "ids that differ", f"{number} again", f"first on line {first_line[number]}")


def _coordinate_findings(file: str, line: int, row: list[str]) -> Iterator[Finding]:
    for column, text in zip(("x_m", "y_m"), row[1:3], strict=True):
        if not math.isfinite(_number(text)):
            yield Finding(file, line, column, "a number of metres", f"`{text}`")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
