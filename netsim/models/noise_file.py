"""Noise readings from a text file: one number a line, in dBm, as TOSSIM's noise traces have them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from netsim.errors import Finding, ScenarioError
from netsim.reading.reasons import why_unreadable

LOWEST_DBM, HIGHEST_DBM = -200.0, 30.0


def read_noise(path: Path) -> NDArray[np.float64]:
    """The readings of a file, in its order; empty lines are skipped.

    Raises:
        ScenarioError: If there is no such file, or no reading in it, or a line is no number from -200 to 30 dBm.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        reason = why_unreadable(path, error)
        finding = Finding(str(path), 1, "", "a text file of noise readings in dBm", reason, "check the path")
        raise ScenarioError([finding]) from error
    readings = [(number, _number(line)) for number, line in enumerate(lines, start=1) if line.strip()]
    values = np.array([value for _, value in readings])
    wrong = ~((values >= LOWEST_DBM) & (values <= HIGHEST_DBM))
    if not len(values) or wrong.any():
        line = readings[int(np.argmax(wrong))][0] if len(values) else 1
        got = repr(lines[line - 1][:40]) if len(values) else "none"
        expected = f"a reading a line, from {LOWEST_DBM:g} to {HIGHEST_DBM:g} dBm"
        raise ScenarioError([Finding(str(path), line, "", expected, got)])
    return values


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
