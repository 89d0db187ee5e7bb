"""What the study runner costs beside the trials: many small trials, in one process and in a pool.

    python tools/bench_study.py [--trials 1000] [--jobs 2]

Prints a table: by way of running, wall time, the mean time of a trial itself, and what a trial costs besides: handing it
out, taking it back, writing it to disk (with fsync), tables included and workers' start apart.
"""

import argparse
import json
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from netsim.study.dispatch import Standing
from netsim.study.executors import LocalPool, ThisProcess, Workers
from netsim.study.plan import Plan, load_plan
from netsim.study.run import open_study

SCENARIO = Path(__file__).resolve().parents[1] / "scenarios" / "quickstart.yaml"
VARIANTS = 10


@dataclass(frozen=True)
class Timing:
    """Where the time of a study went, in seconds."""

    begin: float
    start: float
    trials: float
    inside: float
    end: float


class Marks:
    """Notes when the workers were ready: when the first trial came back, less its own time."""

    def __init__(self) -> None:
        self.ready_s: float | None = None

    def __call__(self, standing: Standing) -> bool:
        if standing.ran and self.ready_s is None:
            self.ready_s = time.perf_counter() - standing.trial_wall_s / min(standing.ran, standing.workers)
        return True


def study_file(folder: Path, trials: int) -> Path:
    tolerances = [round(0.1 * step, 1) for step in range(VARIANTS)]
    study = {
        "kind": "study",
        "schema_version": 1,
        "name": "bench",
        "question": "What does the runner cost?",
        "scenario": str(SCENARIO),
        "set": {"duration_s": 7, "algorithm.rounds": 1},
        "repetitions": max(1, trials // VARIANTS),
        "sweep": [{"path": "algorithm.tolerance", "values": tolerances}],
    }
    path = folder / "study.yaml"
    path.write_text(json.dumps(study))
    return path


def timed(plan: Plan, folder: Path, jobs: int) -> Timing:
    folder.mkdir()
    marks = Marks()
    begun_s = time.perf_counter()
    with open_study(plan, folder, "bench") as study:
        opened_s = time.perf_counter()

        def hire(_: int) -> Workers:
            return ThisProcess() if jobs == 1 else LocalPool(jobs)

        end = study.run(hire, marks)
        ended_s = time.perf_counter()
    ready_s = marks.ready_s or opened_s
    return Timing(
        begin=opened_s - begun_s,
        start=ready_s - opened_s,
        trials=end.wall_s - (ready_s - opened_s),
        inside=end.standing.trial_wall_s,
        end=ended_s - opened_s - end.wall_s,
    )


def sync_s(folder: Path) -> float:
    """Time to append a line of a trial's size and have it on the disk."""
    with (folder / "sync").open("ab", buffering=0) as stream:
        begun_s = time.perf_counter()
        for _ in range(50):
            stream.write(b"x" * 6000)
            os.fsync(stream.fileno())
        return (time.perf_counter() - begun_s) / 50


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        begun_s = time.perf_counter()
        plan = load_plan(study_file(folder, given.trials))
        count = len(plan.tasks(folder))
        print(f"{count} trials of {len(plan.variants)} variants on {os.cpu_count()} cores")
        print(f"study read and checked in {time.perf_counter() - begun_s:.2f} s")
        print(
            f"this disk takes {1e3 * sync_s(folder):.2f} ms to have a line safe (fsync), which is part of `besides`\n"
        )
        print("| way | folder | workers' start | trials | a trial itself | besides, a trial | share | tables |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for jobs in (1, given.jobs):
            timing = timed(plan, folder / f"jobs-{jobs}", jobs)
            inside = timing.inside / count
            besides = (timing.trials * jobs - timing.inside) / count
            print(
                f"| {'one process' if jobs == 1 else f'pool of {jobs}'} | {timing.begin:.2f} s | {timing.start:.2f} s "
                f"| {timing.trials:.2f} s | {1e3 * inside:.1f} ms | {1e3 * besides:.2f} ms "
                f"| {besides / inside:.1%} | {timing.end:.2f} s |"
            )


if __name__ == "__main__":
    main()
