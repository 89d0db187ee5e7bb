"""Running a study: its trials through an executor, each on disk at once, then tables and report."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.study.info import JOURNAL_FILE, NODES, RESULTS
from netsim.study.journal import Journal, read_journal
from netsim.study.plan import Plan, write_plan
from netsim.study.results import node_table, trial_table, write_tables
from netsim.study.trial import Outcome, Task, run_trial

Progress = Callable[[Outcome, int, int], bool]
"""Told of each finished trial, how many are finished and how many there are; False ends the study."""


class SerialExecutor(Executor):
    """Runs what it is given at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """See `concurrent.futures.Executor.submit`."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@dataclass(frozen=True, slots=True)
class StudyEnd:
    """How a study ended."""

    folder: Path
    outcomes: Mapping[str, Outcome]
    interrupted: bool


def run_study(plan: Plan, folder: Path, executor: Executor, command: str, progress: Progress | None = None) -> StudyEnd:
    """Run the trials of a study that have not been run, and write its tables."""
    write_plan(plan, folder, command)
    tasks = plan.tasks(folder)
    outcomes = {each.key: each for each in read_journal(folder / JOURNAL_FILE) if each.status == "ok"}
    interrupted = False
    with Journal(folder / JOURNAL_FILE) as journal:
        for task in tasks:
            if task.key in outcomes:
                continue
            outcome = executor.submit(run_trial, task).result()
            journal.add(outcome)
            outcomes[task.key] = outcome
            if progress is not None and not progress(outcome, len(outcomes), len(tasks)):
                interrupted = True
                break
    write_results(plan, folder, tasks, outcomes, command)
    return StudyEnd(folder, outcomes, interrupted)


def write_results(plan: Plan, folder: Path, tasks: list[Task], outcomes: Mapping[str, Outcome], command: str) -> None:
    """Write the tables of what there is."""
    seeds = [variant.loaded.scenario.seed for variant in plan.variants]
    trials = trial_table(plan.info(command), tasks, outcomes, seeds)
    write_tables(folder, {RESULTS: trials, NODES: node_table(tasks, outcomes)})
