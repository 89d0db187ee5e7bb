"""The tables of a study: one row a trial, one row a trial and node; written as Parquet and CSV.

    from netsim import load_results

    trials = load_results("runs/csmp-tolerance")
    trials.groupby("tolerance")["energy_j"].mean()

Equal journals give equal tables, byte for byte.
"""

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pandas as pd

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import CATALOGUE, flatten
from netsim.scenario.folder import SCENARIO_FILE
from netsim.study.info import INFO_FILE, JOURNAL_FILE, NODES, RESULTS, VARIANTS, AxisInfo, StudyInfo, read_info
from netsim.study.levels import column_of, label_of
from netsim.study.tables import read_table, text, typed, write_tables
from netsim.study.trial import Outcome, Task

__all__ = [
    "StudyResults",
    "command_of",
    "has_tables",
    "load_results",
    "load_study",
    "node_table",
    "trial_table",
    "write_tables",
]

HEAD: Final = ("trial", "variant")
TAIL: Final = ("repetition", "seed", "status", "error", "command")
"""Columns around the axes' own; then come the metrics."""
TEXTS: Final = ("status", "error", "command", "name", "group", "role")
"""Columns that are text, whatever it looks like."""
NODE_COLUMNS: Final = (
    "node",
    "name",
    "group",
    "role",
    "x_m",
    "y_m",
    "energy_j",
    "energy_beyond_listening_j",
    "death_s",
)
ELSEWHERE: Final = re.compile(r"^(scenario|seed|repetition)$|_by_node(_|$)")
"""Figures that are no columns of their own: those of a node are in the table of nodes."""
PLACES: Final = {name: place for place, name in enumerate(CATALOGUE)}


@dataclass(frozen=True)
class StudyResults:
    """What a study gave.

    Attributes:
        info: The study.
        trials: One row a trial: `trial`, `variant`, the axes' columns, `repetition`, `seed`, `status`, `error`,
            `command` (to be typed in the study's folder), then every scalar metric in the catalogue's order, those in
            dictionaries by dotted names; those of a node are in `nodes`.
        nodes: One row a trial and node: `trial`, `variant`, `repetition`, `node`, `name`, `group`, `role`, `x_m`, `y_m`,
            `energy_j`, `energy_beyond_listening_j`, `death_s`.
        folder: Where it lies.
    """

    info: StudyInfo
    trials: pd.DataFrame
    nodes: pd.DataFrame
    folder: Path


def trial_table(
    info: StudyInfo, tasks: Iterable[Task], outcomes: Mapping[str, Outcome], seeds: Sequence[int]
) -> pd.DataFrame:
    """The tidy table of the trials that have an outcome, in the order of their numbers.

    Integers stay integers where some are missing (`Int64`). An axis has levels of one kind: numbers, truth values or text;
    where they are mixed, or one is null, all of them are labels (`netsim.study.levels.label_of`).

    Args:
        info: The study.
        tasks: Its trials.
        outcomes: What came of them, by `Task.key`.
        seeds: Each variant's seed.
    """
    done = [task for task in sorted(tasks, key=lambda task: task.trial) if task.key in outcomes]
    found = [outcomes[task.key] for task in done]
    head = {
        "trial": pd.Series([task.trial for task in done], dtype="int64"),
        "variant": pd.Series([task.variant for task in done], dtype="int64"),
        **_axis_columns(info, done),
        "repetition": pd.Series([task.repetition for task in done], dtype="int64"),
        "seed": typed([seeds[task.variant] for task in done]),
        "status": text([outcome.status for outcome in found]),
        "error": text([outcome.error for outcome in found]),
        "command": text([command_of(task) for task in done]),
    }
    figures = [_figures(outcome, head) for outcome in found]
    names = sorted({name for each in figures for name in each}, key=_place)
    return pd.DataFrame(head | {name: typed([each.get(name) for each in figures]) for name in names})


def node_table(tasks: Iterable[Task], outcomes: Mapping[str, Outcome]) -> pd.DataFrame:
    """One row a trial and node."""
    done = [
        (task, found.nodes)
        for task in sorted(tasks, key=lambda task: task.trial)
        if (found := outcomes.get(task.key)) is not None and found.nodes
    ]
    counts = [len(nodes["node"]) for _, nodes in done]
    head = {
        name: pd.Series(
            [getattr(task, name) for (task, _), count in zip(done, counts, strict=True) for _ in range(count)],
            dtype="int64",
        )
        for name in ("trial", "variant", "repetition")
    }
    columns = {
        name: [
            value for (_, nodes), count in zip(done, counts, strict=True) for value in nodes.get(name, [None] * count)
        ]
        for name in NODE_COLUMNS
    }
    return pd.DataFrame(head | {name: (text if name in TEXTS else typed)(values) for name, values in columns.items()})


def command_of(task: Task) -> str:
    """What makes a trial again with its trace, typed in the study's folder."""
    scenario = f"{VARIANTS}/{task.variant:03d}/{SCENARIO_FILE}"
    return shlex.join(["netsim", "run", scenario, "--set", f"repetition={task.repetition}"])


def load_study(folder: Path | str) -> StudyResults:
    """The results of a study, from its folder.

    Raises:
        ScenarioError: If there are none; of a study that was interrupted, with the command that makes them.
    """
    folder = Path(folder)
    info = read_info(folder)
    _require_tables(folder, info)
    trials = read_table(folder / f"{RESULTS}.parquet", _texts(info))
    return StudyResults(info, trials, read_table(folder / f"{NODES}.parquet", TEXTS), folder)


def load_results(path: Path | str) -> pd.DataFrame:
    """The table of a study's trials: see `StudyResults.trials`.

    Args:
        path: The study's folder, or its results.parquet or results.csv: they give the same table.

    Raises:
        ScenarioError: If there is none; of a study that was interrupted, with the command that makes it.
    """
    path = Path(path)
    if path.suffix not in (".parquet", ".csv"):
        path /= f"{RESULTS}.parquet"
    beside = path.parent / INFO_FILE
    if not beside.is_file():
        return read_table(path, TEXTS)
    info = read_info(path.parent)
    _require_tables(path.parent, info)
    return read_table(path, _texts(info))


def has_tables(folder: Path) -> bool:
    """Whether a study's tables are there; they are written when it ends."""
    return all((folder / f"{stem}.parquet").is_file() for stem in (RESULTS, NODES))


def _require_tables(folder: Path, info: StudyInfo) -> None:
    """Raises ScenarioError if a study that has a journal has no tables."""
    if not has_tables(folder) and (folder / JOURNAL_FILE).is_file():
        message = (
            f"{folder}: the study has no tables, as it was interrupted or still runs: make them of what is finished by "
            f"`netsim report {folder}`, or go on with it: {info.resuming(folder)}"
        )
        raise ScenarioError(message)


def _texts(info: StudyInfo) -> set[str]:
    """The columns of a study's tables that are text."""
    return {*TEXTS, *(axis.name for axis in info.axes if _is_text(axis))}


def _axis_columns(info: StudyInfo, tasks: Sequence[Task]) -> "dict[str, pd.Series[Any]]":
    columns = {}
    for axis in info.axes:
        known = dict(zip(map(label_of, axis.levels), column_of(axis.levels), strict=True))
        levels = [known[label_of(info.variants[task.variant].levels[axis.name])] for task in tasks]
        columns[axis.name] = text(levels) if _is_text(axis) else typed(levels)
    return columns


def _is_text(axis: AxisInfo) -> bool:
    return any(isinstance(level, str) for level in column_of(axis.levels))


def _figures(outcome: Outcome, head: Mapping[str, Any]) -> dict[str, Any]:
    """The figures that are columns; one called as an axis is steps aside."""
    flat = flatten({name: value for name, value in outcome.figures.items() if not ELSEWHERE.search(name)})
    return {f"{name}_measured" if name in head else name: value for name, value in flat.items()}


def _place(name: str) -> tuple[int, str, list[tuple[bool, int, str]]]:
    """Where a metric's column stands: as in the catalogue, the entries of a dictionary in natural order (n2 before n10)."""
    top, _, rest = name.partition(".")
    parts = re.findall(r"\d+|\D+", rest)
    return (
        PLACES.get(top, len(PLACES)),
        top,
        [(part.isdigit(), int(part) if part.isdecimal() else 0, part) for part in parts],
    )
