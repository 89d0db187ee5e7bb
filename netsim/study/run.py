"""Running a study: its trials on workers, each on disk at once, then the tables.

The journal is the truth of a study: tables are made of it and of the plan alone, so they do not depend on who ran the
trials, in which order, or in how many goes.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.study.build_id import versions
from netsim.study.changes import changes
from netsim.study.dispatch import Dispatcher, Standing, Watch
from netsim.study.executors import Workers, local_workers
from netsim.study.folder import clear, clear_results
from netsim.study.info import INFO_FILE, JOURNAL_FILE, read_info
from netsim.study.journal import Journal, outcomes_of
from netsim.study.plan import Plan, write_plan
from netsim.study.tabulate import tabulate
from netsim.study.trial import Outcome, Task

Hire = Callable[[int], Workers]
"""Workers for so many trials."""


@dataclass(frozen=True, slots=True)
class StudyEnd:
    """How a study ended.

    Attributes:
        folder: Where its files are.
        standing: How far it came.
        failures: Trials that failed, with what came of them.
        interrupted: Whether it was ended before its time.
        wall_s: How long the trials took, from the first handed out to the last on disk.
        workers: Who ran them; empty if there was nothing to run.
    """

    folder: Path
    standing: Standing
    failures: tuple[tuple[Task, Outcome], ...]
    interrupted: bool
    wall_s: float
    workers: str

    @property
    def overhead_s(self) -> float | None:
        """What a trial cost besides itself: its share of the workers' time that was not spent in trials."""
        standing = self.standing
        spent_s = self.wall_s * min(standing.workers, standing.ran)
        return (spent_s - standing.trial_wall_s) / standing.ran if standing.ran else None


@dataclass(frozen=True, slots=True)
class OpenStudy:
    """A study in its folder, which it alone may write into.

    Attributes:
        plan: The study.
        folder: The folder.
        command: What the user typed.
        journal: Where outcomes go.
        tasks: Every trial; those of equal content are all there.
        todo: Trials to be run, one of each content.
        finished: How many trials of different content have been finished before.
        failed_before: How many of those to be run have failed before.
        notes: What the user should know.
    """

    plan: Plan
    folder: Path
    command: str
    journal: Journal
    tasks: tuple[Task, ...]
    todo: tuple[Task, ...]
    finished: int
    failed_before: int
    notes: tuple[str, ...]

    def run(self, hire: Hire, watch: Watch) -> StudyEnd:
        """Run what is to be run, and write the tables of all there is.

        Args:
            hire: Makes the workers.
            watch: Looks on, and may end it.

        Raises:
            TraceError: If a file cannot be written.
            NetsimError: If the workers are lost.
        """
        standing = Standing(len(self.todo) + self.finished, self.finished)
        begun_s = time.perf_counter()
        name, whole = "", True
        if self.todo:
            workers = hire(len(self.todo))
            name, at_once = workers.name, True
            try:
                whole = Dispatcher(workers, self.journal.add, watch, standing).run(self.todo)
                at_once = False
            finally:
                workers.close(at_once=at_once)
        wall_s = time.perf_counter() - begun_s
        outcomes = outcomes_of(self.folder)
        tabulate(self.folder, self.plan.info(self.command), outcomes)
        failures = [(task, outcomes[task.key]) for task in distinct(self.tasks) if task.key in outcomes]
        failed = tuple((task, outcome) for task, outcome in failures if outcome.status == "failed")
        return StudyEnd(self.folder, standing, failed, not whole, wall_s, name)


@contextmanager
def open_study(
    plan: Plan, folder: Path, command: str, *, resume: bool = False, allow_changed: bool = False
) -> Iterator[OpenStudy]:
    """Begin a study in a folder, or go on with it.

    Args:
        plan: The study.
        folder: Its folder; without `resume`, what a study wrote there is removed.
        command: What the user typed.
        resume: Whether finished trials count.
        allow_changed: Whether it may be another study than the one that the folder was begun with.

    Raises:
        ScenarioError: If it is another study, and that is not allowed.
        StudyInUse: If another process works in the folder.
        TraceError: If a file cannot be read or written.
    """
    with Journal(folder / JOURNAL_FILE, afresh=not resume) as journal:
        if not resume:
            clear(folder)
        outcomes = outcomes_of(folder)
        notes = _compare(plan, folder, outcomes, allow_changed) if (folder / INFO_FILE).exists() else []
        if notes:
            clear_results(folder)
        write_plan(plan, folder, command)
        tasks = plan.tasks(folder)
        once = distinct(tasks)
        found = {task.key: outcomes[task.key] for task in once if task.key in outcomes}
        todo = tuple(task for task in once if task.key not in found or found[task.key].status == "failed")
        failed = sum(outcome.status == "failed" for outcome in found.values())
        notes += _versions(found)
        yield OpenStudy(plan, folder, command, journal, tuple(tasks), todo, len(found) - failed, failed, tuple(notes))


def run_study(
    plan: Plan, folder: Path, command: str, *, jobs: int = 1, resume: bool = False, watch: Watch | None = None
) -> StudyEnd:
    """Run a study on this machine; see `open_study` and `OpenStudy.run`."""
    with open_study(plan, folder, command, resume=resume) as study:
        return study.run(lambda trials: local_workers(min(jobs, trials)), watch or (lambda standing: True))


def distinct(tasks: Iterable[Task]) -> list[Task]:
    """The first trial of each content."""
    first: dict[str, Task] = {}
    for task in tasks:
        first.setdefault(task.key, task)
    return list(first.values())


def _compare(plan: Plan, folder: Path, outcomes: Mapping[str, Outcome], allow_changed: bool) -> list[str]:
    """What to tell about a study that has changed.

    Raises:
        ScenarioError: If it must not.
    """
    found = changes(plan, folder, read_info(folder))
    if not found.lines:
        return []
    if found.extends:
        return [f"more repetitions than before ({found.lines[0]})"]
    kept = {task.key for task in plan.tasks(folder)}
    finished = [key for key, outcome in outcomes.items() if outcome.status == "ok"]
    if not finished:  # nothing is lost: say, all had failed, and the algorithm has been mended since
        return [f"changed: {line}" for line in found.lines]
    count = f"{sum(key in kept for key in finished)} of {len(finished)} finished trials still count"
    if allow_changed:
        return [*(f"changed: {line}" for line in found.lines), f"{count}; the others stay in {JOURNAL_FILE}"]
    lines = "".join(f"\n  {line}" for line in found.lines)
    remedy = "--allow-changed goes on with them; another --out begins anew"
    message = f"{folder} was begun with another study than {plan.path}:{lines}\n  {count}: {remedy}"
    raise ScenarioError(message)


def _versions(outcomes: Mapping[str, Outcome]) -> list[str]:
    """What to tell where finished trials were run by other versions than those that are to be run."""
    here, notes = versions(), []
    finished = [outcome.versions for outcome in outcomes.values() if outcome.status == "ok"]
    for name, own in here.items():
        others = sorted({each[name] for each in finished if name in each} - {own})
        if others:
            told = ", ".join(others)
            notes.append(f"warning: finished trials were run by {name} {told}, the others are by {own}")
    return notes
