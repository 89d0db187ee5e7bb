"""Rows of CSV files, with what is wrong with them said for people."""

import csv
import math
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.reading.reasons import why_unreadable


def csv_rows(path: Path, what: str) -> list[tuple[int, list[str]]]:
    """The rows of a CSV file in UTF-8 with the numbers of their lines; empty ones are skipped, blanks around cells dropped.

    Args:
        path: The file.
        what: What it should hold, such as `waypoints`.

    Raises:
        ScenarioError: If it cannot be read.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            return [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        message = f"{path}: expected a CSV file of {what}, got: {why_unreadable(path, error)}"
        raise ScenarioError(message) from error


def number(text: str) -> float:
    """The number that a text says; NaN if it says none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
