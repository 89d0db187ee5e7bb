"""What a comparison of two studies cannot be judged on: trials that the later one lacks, figures that only one of them has.

Means over the trials that are left would hide it: where the hard trials crash, the mean error falls.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from netsim.study.cells import figures_of
from netsim.study.levels import label_of, words
from netsim.study.results import StudyResults
from netsim.study.samples import Number

NOT_RUN: Final = "not run"
Key = tuple[tuple[tuple[str, str], ...], int]
"""What two studies know a trial by: its levels by axis, and its repetition."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial that a study asks for.

    Attributes:
        words: Its levels and repetition in words.
        status: `ok`, `failed` or `not run`.
        row: Its row in the table; None if it was not run.
    """

    words: str
    status: str
    row: int | None


@dataclass(frozen=True, slots=True)
class Tally:
    """How the trials of a study ended.

    Attributes:
        name: The study's folder as it was given.
        asked: How many trials it asks for.
        failed: Those that failed, in words.
        not_run: Those that were not run so far, in words.
    """

    name: str
    asked: int
    failed: tuple[str, ...]
    not_run: tuple[str, ...]


Roll = Mapping[Key, Trial]
"""All trials that a study asks for."""
Numbers = Sequence[Number | None]
"""A metric, one figure a row of a table of trials; None where there is none."""


def roll_of(study: StudyResults, *, is_paired: bool) -> Roll:
    """Every trial that a study asks for.

    Args:
        study: The study.
        is_paired: Whether trials of one repetition are pairs; else the first repetition of one study stands for the first
            of the other, whatever its number.
    """
    table = study.trials
    columns = (table[name].tolist() for name in ("variant", "repetition", "status"))
    rows = {
        (variant, number): (row, status) for row, (variant, number, status) in enumerate(zip(*columns, strict=True))
    }
    found = {}
    for variant in study.info.variants:
        labels = tuple(sorted((axis, label_of(level)) for axis, level in variant.levels.items()))
        for place, number in enumerate(study.info.repetitions):
            row, status = rows.get((variant.number, number), (None, NOT_RUN))
            name = ", ".join(filter(None, (words(variant.levels), f"repetition {number}")))
            found[labels, number if is_paired else place] = Trial(name, status, row)
    return found


def tally_of(name: str, roll: Roll) -> Tally:
    """How the trials of a study ended."""
    failed, not_run = (
        tuple(trial.words for trial in roll.values() if trial.status == status) for status in ("failed", NOT_RUN)
    )
    return Tally(name, len(roll), failed, not_run)


def lost(first: Roll, later: Roll) -> tuple[str, ...]:
    """Trials that ended well in the first study and not in the later one, each with what came of it there."""
    ended = {key: trial for key, trial in first.items() if trial.status == "ok"}
    there = {key: later[key].status if key in later else "not asked for" for key in ended}
    return tuple(f"{trial.words} ({there[key]})" for key, trial in ended.items() if there[key] != "ok")


def uneven(
    studies: tuple[StudyResults, StudyResults], rolls: tuple[Roll, Roll], metric: str, *, is_paired: bool
) -> tuple[str, ...]:
    """What ended well in both studies, but has a figure of a metric in only one of them, in words.

    Of pairs these are trials; of independent samples, variants of which not the same share of trials has a figure.
    """
    first, later = (figures_of(study.trials, metric).numbers for study in studies)
    if is_paired:
        return tuple(
            f"{trial.words} (no {metric} {'there' if _number(later, other) is None else 'in the first'})"
            for trial, other in _both(*rolls)
            if (_number(first, trial) is None) != (_number(later, other) is None)
        )
    before, after = _shares(first, rolls[0]), _shares(later, rolls[1])
    return tuple(
        f"{name or 'the trials'} (of {metric}: a share of {after[name]} there, {share} in the first)"
        for name, share in before.items()
        if name in after and after[name] != share
    )


def _both(first: Roll, later: Roll) -> Iterator[tuple[Trial, Trial]]:
    """Trials that ended well in both."""
    for key, trial in first.items():
        if key in later and trial.status == later[key].status == "ok":
            yield trial, later[key]


def _shares(numbers: Numbers, roll: Roll) -> Mapping[str, Fraction]:
    """The share of a variant's trials with a figure, of those that ended well, by levels in words."""
    known = defaultdict[str, list[bool]](list)
    for (labels, _), trial in roll.items():
        if trial.status == "ok":
            known[words(dict(labels))].append(_number(numbers, trial) is not None)
    return {name: Fraction(sum(each), len(each)) for name, each in known.items()}


def _number(numbers: Numbers, trial: Trial) -> Number | None:
    return None if trial.row is None else numbers[trial.row]
