"""`netsim study`."""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from netsim.cli import EXIT_FAILURE, EXIT_INTERRUPTED
from netsim.cli.console import counted, say, tell
from netsim.cli.study_progress import duration, watched_study
from netsim.errors import NetsimError, ScenarioError
from netsim.study.cluster import DaskWorkers
from netsim.study.executors import Workers, local_workers, usable_cores
from netsim.study.folder import study_folder
from netsim.study.journal import StudyInUse
from netsim.study.plan import Plan, load_plan
from netsim.study.results import command_of
from netsim.study.run import OpenStudy, StudyEnd, open_study


@dataclass(frozen=True, slots=True)
class Orders:
    """What the user wants done with a study.

    Attributes:
        out: Folder; None for the usual one.
        jobs: Worker processes; None for one a core.
        scheduler: Address of a Dask scheduler; None for this machine.
        resume: Go on with what is in the folder.
        allow_changed: Even if it is another study.
        force: Replace what is in the folder.
        report: Write the report.
        plugins: Whether algorithms named `module:Class` may be imported.
    """

    out: Path | None
    jobs: int | None
    scheduler: str | None
    resume: bool
    allow_changed: bool
    force: bool
    report: bool
    plugins: bool


def study_command(file: Path, overrides: Sequence[str], orders: Orders) -> None:
    """Run, tabulate, report; the exit status says how it went."""
    _refuse_contradictions(orders)
    plan = load_plan(file, overrides, plugins=orders.plugins)
    cluster = None if orders.scheduler is None else DaskWorkers(orders.scheduler)
    try:
        folder = study_folder(orders.out, plan.study.name, resume=orders.resume, force=orders.force)
        with open_study(
            plan, folder, shlex.join(_typed()), resume=orders.resume, allow_changed=orders.allow_changed
        ) as study:
            _tell_plan(study)
            for warning in () if cluster is None else cluster.warnings:
                tell(f"warning: {warning}")
            end = _run(study, orders, cluster)
            _tell_end(plan, end, report=orders.report)
    finally:
        if cluster is not None:
            cluster.close(at_once=True)
    if end.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if end.failures:
        raise typer.Exit(EXIT_FAILURE)


def _refuse_contradictions(orders: Orders) -> None:
    pairs = {
        "--resume and --force": orders.resume and orders.force,
        "--jobs and --scheduler": orders.jobs is not None and orders.scheduler is not None,
    }
    for pair, both in pairs.items():
        if both:
            message = f"{pair} exclude each other: give one of them"
            raise ScenarioError(message)
    if orders.allow_changed and not orders.resume:
        message = "--allow-changed belongs to --resume: give both"
        raise ScenarioError(message)


def _run(study: OpenStudy, orders: Orders, cluster: DaskWorkers | None) -> StudyEnd:
    def hire(trials: int) -> Workers:
        workers = cluster or local_workers(min(orders.jobs or usable_cores(), trials))
        tell(f"{counted(trials, 'trial')} to run by {workers.name}")
        return workers

    try:
        with watched_study() as watch:
            return study.run(hire, watch)
    except KeyboardInterrupt:
        tell(f"stopped at once; go on with: {_resuming(study.folder)}")
        raise
    except StudyInUse:
        raise
    except NetsimError as error:
        message = f"{error}; finished trials are kept, go on with: {_resuming(study.folder)}"
        raise NetsimError(message) from error


def _tell_plan(study: OpenStudy) -> None:
    plan, trials = study.plan, len(study.tasks)
    variants, repetitions = counted(len(plan.variants), "variant"), counted(len(plan.repetitions), "repetition")
    tell(f"{plan.study.name}: {variants} x {repetitions} = {counted(trials, 'trial')}")
    for note in (*study.notes, *(f"warning: {each}" for each in plan.warnings)):
        tell(note)
    once = study.finished + len(study.todo)
    if once < trials:
        tell(f"{trials - once} trials are the same as others and are run once")
    if study.finished or study.failed_before:
        again = f", {study.failed_before} that failed are run again" if study.failed_before else ""
        tell(f"{study.finished} are finished already{again}")


def _tell_end(plan: Plan, end: StudyEnd, *, report: bool) -> None:
    standing = end.standing
    if standing.ran:
        failed = f" ({len(end.failures)} failed)" if end.failures else ""
        rate = standing.ran / end.wall_s
        say(f"{counted(standing.ran, 'trial')}{failed} in {duration(end.wall_s)} by {end.workers}, {rate:.3g} trials/s")
        start = ", the start of the workers included" if standing.workers > 1 else ""
        mean_s = standing.trial_wall_s / standing.ran
        say(f"A trial took {mean_s:.3g} s on average, and {1e3 * (end.overhead_s or 0.0):.3g} ms besides itself{start}")
    else:
        say("Nothing to run: every trial is finished")
    say(
        f"Results in {end.folder}: results.parquet, results.csv (a row a trial), nodes.parquet, nodes.csv (a row a node)"
    )
    if report and standing.done > len(end.failures):
        say(f"Report: {_write_report(end.folder)}")
    if end.failures:
        _tell_failures(plan, end)
    if end.interrupted:
        tell(
            f"interrupted: {standing.done} of {standing.trials} trials are finished; go on with: {_resuming(end.folder)}"
        )


def _write_report(folder: Path) -> Path:
    from netsim.study.report import write_report

    tell("writing the report")
    try:
        return write_report(folder)
    except KeyboardInterrupt:
        tell(f"stopped before the report was written; the tables are: netsim report {shlex.quote(str(folder))}")
        raise


def _tell_failures(plan: Plan, end: StudyEnd) -> None:
    task, outcome = end.failures[0]
    levels = ", ".join(f"{name}={level}" for name, level in plan.variants[task.variant].levels.items())
    which = f"trial {task.trial} ({levels}{', ' if levels else ''}repetition {task.repetition})"
    tell(f"error: {len(end.failures)} of {end.standing.trials} trials failed; the first is {which}: {outcome.error}")
    tell(f"  see it: cd {shlex.quote(str(end.folder))} && {command_of(task)} --debug")
    tell(f"  run the failed ones again: {_resuming(end.folder)}")
    if end.standing.done > len(end.failures):
        tell(
            "  (with --allow-changed if you mend an algorithm or a scenario: all trials that it changes are run again)"
        )
    if "--debug" in sys.argv[1:] and outcome.details:
        tell(outcome.details.rstrip())


def _typed() -> list[str]:
    """What the user typed, without what concerns only the folder."""
    words, kept = iter(sys.argv[1:]), ["netsim"]
    for word in words:
        if word == "--out":
            next(words, None)
        elif word not in ("--resume", "--force", "--allow-changed") and not word.startswith("--out="):
            kept.append(word)
    return kept


def _resuming(folder: Path) -> str:
    """The command that goes on with a study."""
    return shlex.join([*_typed(), "--out", str(folder), "--resume"])
