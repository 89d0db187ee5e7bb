"""Folders of studies made by hand, with all that a report shows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from study_records import Figures, outcomes, study, tasks

from netsim.study.info import INFO_FILE, NODES, RESULTS, PublishedInfo, StudyInfo
from netsim.study.results import node_table, trial_table, write_tables
from netsim.study.schema import Level

Axes = Mapping[str, Sequence[Level]]


def figures(levels: Mapping[str, Level], repetition: int, **more: Any) -> dict[str, Any]:
    """Error falls and cost rises with the place of each level; repetitions share a draw that is larger than either."""
    shared, own = np.random.default_rng(repetition).normal(size=2)
    place = sum(len(str(level)) + (level if isinstance(level, int | float) else 0) for level in levels.values())
    beyond_j = 0.01 * (1 + place) * (1 + 0.02 * shared) + 1e-4 * own * place
    return {
        "association_error": 0.5 / (1 + place) + 0.05 * shared + 0.002 * own * place,
        "energy_j": 10.0 + beyond_j,
        "energy_beyond_listening_j": beyond_j,
        "radio_messages": 100 + 10 * int(place) + repetition,
        "frame_byte": 5000 + 500 * int(place) + 7 * repetition,
        "latency_mean_s": 0.002 * (1 + place) + 1e-5 * shared,
        "energy_by_state_j": {"radio.listen": 10.0, "radio.transmit": 0.6 * beyond_j, "cpu.active": 0.4 * beyond_j},
        "energy_by_kind_j": {"(none)": 10.0, "belief": beyond_j},
        **more,
    }


def nodes(figures: Mapping[str, Any], count: int = 4) -> dict[str, list[Any]]:
    """A few nodes in a square, a sink among them."""
    share = figures.get("energy_beyond_listening_j", 0.0) / count
    return {
        "node": list(range(count)),
        "name": [f"n{number}" for number in range(count)],
        "group": ["sensors"] * count,
        "role": ["sink", *["sensor"] * (count - 1)],
        "x_m": [10.0 * (number % 2) for number in range(count)],
        "y_m": [10.0 * (number // 2) for number in range(count)],
        "energy_j": [figures.get("energy_j", 0.0) / count] * count,
        "energy_beyond_listening_j": [share * (0.5 + number / count) for number in range(count)],
        "death_s": [None] * count,
    }


def written(
    folder: Path,
    axes: Axes,
    repetitions: int = 5,
    law: Figures = figures,
    *,
    published: Sequence[PublishedInfo] = (),
    only: int | None = None,
    **changes: Any,
) -> StudyInfo:
    """Write a study's folder.

    Args:
        folder: Where to.
        axes: Levels by axis.
        repetitions: How many.
        law: A trial's figures by levels and repetition; None for one that fails.
        published: Published figures.
        only: So many trials have been run.
        changes: Of the study's description.
    """
    info = replace(study(axes, repetitions, published), question="What does it cost?", **changes)
    found = {key: replace(each, nodes=nodes(each.figures)) for key, each in outcomes(info, law).items()}
    run = [task for task in tasks(info) if only is None or task.trial < only]
    there = {task.key: found[task.key] for task in run}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / INFO_FILE).write_text(info.to_json(), encoding="utf-8")
    (folder / "study.yaml").write_text("kind: study\n", encoding="utf-8")
    trials = trial_table(info, run, there, [1] * len(info.variants))
    write_tables(folder, {RESULTS: trials, NODES: node_table(run, there)})
    return info
