"""Whether "A is lower than B" holds everywhere that a study looked, and where it turns round.

A verdict over many combinations is many tests at once: one in twenty would err by chance. Here a comparison counts as
decided only where its p-value, adjusted after Holm for all comparisons made, is below 0.05.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import pandas as pd

from netsim.study.differences import EQUAL, HIGHER, LOWER, TOO_FEW, UNDECIDED, paired_differences
from netsim.study.info import StudyInfo
from netsim.study.levels import is_numeric, label_of, words
from netsim.study.samples import CONFIDENCE

FLIPS = "flips"

VERDICT_COLUMNS = (
    *("metric", "axis", "baseline", "level", "combinations"),
    *("lower", "higher", "equal", "undecided", "too_few", "verdict"),
)
FLIP_COLUMNS = ("metric", "axis", "baseline", "level", "along", "at", "lower_at", "higher_at", "words")


def verdicts(trials: pd.DataFrame, info: StudyInfo, metric: str) -> pd.DataFrame:
    """Each level of the compare axis against its baseline, over all combinations of the other axes' levels.

    Args:
        trials: One row a trial.
        info: The study; without an axis to compare along the table is empty.
        metric: The metric to compare.

    Returns:
        A row a level: `metric`, `axis`, `baseline`, `level`, `combinations` (how many were compared), in how many of them it
        is `lower`, `higher`, `equal`, `undecided` or has `too_few` pairs, and `verdict` in words: "lower everywhere", "lower
        where decided", likewise "higher", "equal everywhere", "flips", or "undecided".
    """
    rows = []
    for level, found in _by_level(decided(trials, info, metric), info):
        count = Counter(found["decided"].tolist())
        rows.append(
            {
                "metric": metric,
                "axis": info.compare_axis,
                "baseline": info.baseline,
                "level": level,
                "combinations": len(found),
                "lower": count[LOWER],
                "higher": count[HIGHER],
                "equal": count[EQUAL],
                "undecided": count[UNDECIDED],
                "too_few": count[TOO_FEW],
                "verdict": _overall(count),
            }
        )
    return pd.DataFrame(rows, columns=list(VERDICT_COLUMNS))


def flips(trials: pd.DataFrame, info: StudyInfo, metric: str) -> pd.DataFrame:
    """Where a comparison turns round along one of the other axes while the rest stays as it is.

    Along an axis of numbers each change of sign between two decided levels, with none decided between them, is a row; along
    another axis a row tells at which levels it is lower and at which higher.

    Args:
        trials: One row a trial.
        info: The study; without an axis to compare along the table is empty.
        metric: The metric to compare.

    Returns:
        A row a flip: `metric`, `axis`, `baseline`, `level` (compared), `along` (the axis), `at` (where on the rest, in
        words), `lower_at` and `higher_at` (labels of levels of `along`), `words` ("from lower to higher between
        exponent=2.5 and exponent=3, at radio=cc2420").
    """
    rows: list[dict[str, Any]] = []
    table = decided(trials, info, metric)
    for level, found in _by_level(table, info):
        head = {"metric": metric, "axis": info.compare_axis, "baseline": info.baseline, "level": level}
        for along in (axis for axis in info.axis_names if axis != info.compare_axis):
            rows += [head | {"along": along} | flip for flip in _flips_along(found, along, info)]
    return pd.DataFrame(rows, columns=list(FLIP_COLUMNS))


def decided(trials: pd.DataFrame, info: StudyInfo, metric: str) -> pd.DataFrame:
    """The paired differences along the compare axis with a column `decided`: the verdict by `p_holm`."""
    if info.compare_axis is None:
        return pd.DataFrame(columns=["decided"])
    table = paired_differences(trials, info.axis_names, info.compare_axis, info.baseline, [metric])
    sure = (table["p_holm"] < 1 - CONFIDENCE).tolist()
    verdict = zip(table["verdict"].tolist(), sure, strict=True)
    return table.assign(
        decided=[UNDECIDED if one in (LOWER, HIGHER) and not is_sure else one for one, is_sure in verdict]
    )


def _by_level(table: pd.DataFrame, info: StudyInfo) -> Iterator[tuple[Any, pd.DataFrame]]:
    """The rows of each level compared, in the order of the axis."""
    if info.compare_axis is None:
        return
    labels = [label_of(level) for level in table[info.compare_axis].tolist()]
    levels = next(axis.levels for axis in info.axes if axis.name == info.compare_axis)
    for level in levels:
        found = table[[label == label_of(level) for label in labels]]
        if len(found):
            yield level, found


def _overall(count: Counter[str]) -> str:
    signs = [word for word in (LOWER, HIGHER) if count[word]]
    if len(signs) == 2:
        return FLIPS
    if not signs:
        return "equal everywhere" if count.total() == count[EQUAL] else "undecided"
    return f"{signs[0]} everywhere" if count[signs[0]] == count.total() else f"{signs[0]} where decided"


def _flips_along(found: pd.DataFrame, along: str, info: StudyInfo) -> Iterator[dict[str, str]]:
    """The flips along one axis, for each combination of the remaining ones."""
    rest = [axis for axis in info.axis_names if axis not in (along, info.compare_axis)]
    lines: dict[str, list[tuple[Any, str]]] = {}
    for row in found.to_dict("records"):
        if row["decided"] in (LOWER, HIGHER):
            lines.setdefault(words({axis: row[axis] for axis in rest}), []).append((row[along], row["decided"]))
    for where, line in lines.items():
        made = _turns(line, along) if is_numeric(level for level, _ in line) else _sides(line, along)
        for flip in made:
            yield flip | {"at": where, "words": flip["words"] + (f", at {where}" if where else "")}


def _turns(line: Sequence[tuple[float, str]], along: str) -> Iterator[dict[str, str]]:
    """The changes of sign along an axis of numbers."""
    ordered = sorted(line)
    for (level, verdict), (after, then) in pairwise(ordered):
        if verdict != then:
            ends = {verdict: label_of(level), then: label_of(after)}
            text = f"from {verdict} to {then} between {words({along: level})} and {words({along: after})}"
            yield {"lower_at": ends[LOWER], "higher_at": ends[HIGHER], "words": text}


def _sides(line: Sequence[tuple[Any, str]], along: str) -> Iterator[dict[str, str]]:
    """The levels of an axis without an order where it is lower, and those where it is higher."""
    sides = {word: ", ".join(label_of(level) for level, verdict in line if verdict == word) for word in (LOWER, HIGHER)}
    if all(sides.values()):
        text = f"lower at {along}={sides[LOWER]}, higher at {along}={sides[HIGHER]}"
        yield {"lower_at": sides[LOWER], "higher_at": sides[HIGHER], "words": text}
