"""Studies made by hand: descriptions, trials and outcomes, without running anything."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

from netsim.study.info import AxisInfo, PublishedInfo, StudyInfo, VariantInfo
from netsim.study.results import trial_table
from netsim.study.schema import Level
from netsim.study.trial import Outcome, Task

Figures = Callable[[Mapping[str, Level], int], Mapping[str, Any] | None]


def study(
    axes: Mapping[str, Sequence[Level]], repetitions: int = 5, published: Sequence[PublishedInfo] = ()
) -> StudyInfo:
    """A description of a study with these axes; it compares along the first, against its first level."""
    levels = [dict(zip(axes, chosen, strict=True)) for chosen in itertools.product(*axes.values())]
    return StudyInfo(
        name="by-hand",
        question="?",
        description="",
        axes=tuple(AxisInfo(name, tuple(values), (name,)) for name, values in axes.items()),
        variants=tuple(VariantInfo(number, each, f"d{number}", "s") for number, each in enumerate(levels)),
        seeds=(1,),
        repetitions=tuple(range(repetitions)),
        metrics=(),
        error=None,
        costs=(),
        compare_axis=next(iter(axes), None),
        baseline=next(iter(axes.values()))[0] if axes else None,
        published=tuple(published),
        sources=(),
        warnings=(),
        command="netsim study by-hand.yaml",
        versions={},
    )


def tasks(info: StudyInfo) -> list[Task]:
    """Its trials."""
    pairs = [(repetition, variant) for repetition in info.repetitions for variant in info.variants]
    return [
        Task(number, variant.number, repetition, f"{variant.digest}-{repetition}", "f")
        for number, (repetition, variant) in enumerate(pairs)
    ]


def outcomes(info: StudyInfo, figures: Figures) -> dict[str, Outcome]:
    """An outcome a trial: failed where `figures(levels, repetition)` gives None."""
    found = {}
    for task in tasks(info):
        given = figures(info.variants[task.variant].levels, task.repetition)
        status = "failed" if given is None else "ok"
        found[task.key] = Outcome(task.trial, task.key, status, "" if status == "ok" else "boom", given or {})
    return found


def trials(info: StudyInfo, figures: Figures) -> pd.DataFrame:
    """The table of its trials."""
    return trial_table(info, tasks(info), outcomes(info, figures), [1] * len(info.variants))
