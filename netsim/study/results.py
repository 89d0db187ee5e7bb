"""The tables of a study: one row a trial, one row a trial and node; written as Parquet and CSV.

from netsim import load_results

trials = load_results("runs/csmp-tolerance")
trials.groupby("tolerance")["energy_j"].mean()
"""

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from netsim.errors import ScenarioError, TraceError
from netsim.metrics.catalogue import flatten
from netsim.scenario.folder import SCENARIO_FILE
from netsim.study.info import NODES, RESULTS, VARIANTS, StudyInfo, read_info
from netsim.study.trial import Outcome, Task

HEAD = ("trial", "variant")
TAIL = ("repetition", "seed", "status", "error", "command")
"""Columns around the axes' own; then come the metrics."""


@dataclass(frozen=True)
class StudyResults:
    """What a study gave.

    Attributes:
        info: The study.
        trials: One row a trial: `trial`, `variant`, the axes' columns, `repetition`, `seed`, `status`, `error`,
            `command` (to be typed in the study's folder), then every scalar metric, nested ones by dotted names.
        nodes: One row a trial and node: `trial`, `variant`, `repetition`, `node`, `name`, `group`, `role`, `x_m`, `y_m`,
            `energy_j`, `death_s`.
        folder: Where it lies.
    """

    info: StudyInfo
    trials: pd.DataFrame
    nodes: pd.DataFrame
    folder: Path


def trial_table(info: StudyInfo, tasks: Iterable[Task], outcomes: Mapping[str, Outcome], seeds: Any) -> pd.DataFrame:
    """The tidy table of the trials that have an outcome, in the order of their numbers.

    Args:
        info: The study.
        tasks: Its trials.
        outcomes: What came of them, by `Task.key`.
        seeds: Each variant's seed.
    """
    rows = [
        _row(info, task, outcomes[task.key], seeds[task.variant])
        for task in sorted(tasks, key=lambda task: task.trial)
        if task.key in outcomes
    ]
    head = [*HEAD, *info.axis_names, *TAIL]
    metrics = list(dict.fromkeys(name for row in rows for name in row if name not in head))
    return pd.DataFrame(rows, columns=[*head, *metrics])


def node_table(tasks: Iterable[Task], outcomes: Mapping[str, Outcome]) -> pd.DataFrame:
    """One row a trial and node."""
    parts = [
        pd.DataFrame({"trial": task.trial, "variant": task.variant, "repetition": task.repetition, **found.nodes})
        for task in sorted(tasks, key=lambda task: task.trial)
        if (found := outcomes.get(task.key)) is not None and found.nodes
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["trial", "variant", "repetition"])


def command_of(task: Task) -> str:
    """What makes a trial again with its trace, typed in the study's folder."""
    scenario = f"{VARIANTS}/{task.variant:03d}/{SCENARIO_FILE}"
    return shlex.join(["netsim", "run", scenario, "--set", f"repetition={task.repetition}"])


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
                    table.to_csv(partial, index=False)
                else:
                    table.to_parquet(partial, index=False)
                partial.replace(path)
            except OSError as error:
                message = f"cannot write {path}: {error.strerror or error}"
                raise TraceError(message) from error


def load_study(folder: Path | str) -> StudyResults:
    """The results of a study, from its folder.

    Raises:
        ScenarioError: If there are none.
    """
    folder = Path(folder)
    info = read_info(folder)
    return StudyResults(info, _table(folder / f"{RESULTS}.parquet"), _table(folder / f"{NODES}.parquet"), folder)


def load_results(path: Path | str) -> pd.DataFrame:
    """The table of a study's trials: see `StudyResults.trials`.

    Args:
        path: The study's folder, or its results.parquet.

    Raises:
        ScenarioError: If there is none.
    """
    path = Path(path)
    return _table(path if path.suffix == ".parquet" else path / f"{RESULTS}.parquet")


def _table(path: Path) -> pd.DataFrame:
    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:
        got = "no such file" if isinstance(error, FileNotFoundError) else str(error)
        message = f"{path}: expected the table of a study, got: {got}; give the folder that `netsim study` wrote"
        raise ScenarioError(message) from error


def _row(info: StudyInfo, task: Task, outcome: Outcome, seed: int) -> dict[str, Any]:
    figures = {name: value for name, value in flatten(outcome.figures).items() if name not in ("scenario", "seed")}
    return {
        "trial": task.trial,
        "variant": task.variant,
        **info.variants[task.variant].levels,
        "repetition": task.repetition,
        "seed": seed,
        "status": outcome.status,
        "error": outcome.error,
        "command": command_of(task),
        **figures,
    }
