"""The tables of a study made of its journal: when it ends, and of one that was interrupted at any time after.

Its folder says all that is needed: `study.json` the variants, the journal what came of their trials.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.scenario.folder import write_file
from netsim.study.info import INFO_FILE, JOURNAL_FILE, NODES, RESULTS, BuildInfo, StudyInfo, read_info
from netsim.study.journal import outcomes_of
from netsim.study.results import has_tables, node_table, trial_table, write_tables
from netsim.study.trial import Outcome, Task, tasks_of


def tabulate(folder: Path, info: StudyInfo, outcomes: Mapping[str, Outcome]) -> None:
    """Write a study's tables, and into `study.json` by which versions its trials were run.

    Args:
        folder: The study's folder.
        info: The study, with the seed of each variant.
        outcomes: What came of its trials, by `Task.key`.

    Raises:
        TraceError: If a file cannot be written.
    """
    tasks = tasks_of(info.variants, info.repetitions, folder)
    seeds = [variant.seed for variant in info.variants]
    trials = trial_table(info, tasks, outcomes, [seed for seed in seeds if seed is not None])
    write_tables(folder, {RESULTS: trials, NODES: node_table(tasks, outcomes)})
    write_file(folder / INFO_FILE, replace(info, builds=_builds(tasks, outcomes)).to_json())


def refresh_tables(folder: Path) -> None:
    """Make the tables of a study anew from its journal, which holds every finished trial, however the study ended.

    Tables without a journal stay as they are, and so do those of a study that does not tell its variants' seeds, as an
    early version of netsim wrote it.

    Raises:
        ScenarioError: If it is no study, or there are neither tables nor finished trials to make them of.
        TraceError: If a file cannot be read or written.
    """
    info = read_info(folder)
    has_seeds = all(variant.seed is not None for variant in info.variants)
    outcomes = outcomes_of(folder) if has_seeds else {}
    keys = {task.key for task in tasks_of(info.variants, info.repetitions, folder)}
    if not keys.isdisjoint(outcomes):
        tabulate(folder, info, outcomes)
    elif not has_tables(folder) and (folder / JOURNAL_FILE).exists():
        why = "no trial is finished yet" if has_seeds else "its description does not tell the variants' seeds"
        message = f"{folder}: there are no tables, and none can be made: {why}; go on with it: {info.resuming(folder)}"
        raise ScenarioError(message)


def _builds(tasks: Iterable[Task], outcomes: Mapping[str, Outcome]) -> tuple[BuildInfo, ...]:
    """By which versions the trials that have figures were run, the most frequent first."""
    found = [outcomes[task.key] for task in tasks if task.key in outcomes]
    counts = Counter(tuple(outcome.versions.items()) for outcome in found if outcome.status == "ok")
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return tuple(BuildInfo(dict(versions), count) for versions, count in ordered)
