"""Handing trials to workers and taking what comes back, until all are done, the user has had enough or workers fail.

A worker that dies takes every trial in its pool with it. Those are run again, one at a time, so that a trial that kills
its worker is known for it, and only that one fails.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Protocol

from netsim.errors import NetsimError
from netsim.study.executors import WorkerDied, Workers
from netsim.study.trial import Outcome, Task

LOOK_S = 0.2
"""How often to look whether the user wants to end, at least."""
MOST_DEATHS_AT_THE_START = 3
"""So many trials whose workers died, and not one that came back: it is the workers, not the trials."""


@dataclass(slots=True)
class Standing:
    """How far a study is, in different trials: those of equal content count once.

    Attributes:
        trials: All of them.
        done: Those that have an outcome, from before or now.
        ran: Those that ran now.
        ran_failed: Those of them that failed.
        running: Those handed to workers.
        workers: How many of them run at a time.
        trial_wall_s: Time spent in the trials that ran now, all workers together.
    """

    trials: int
    done: int = 0
    ran: int = 0
    ran_failed: int = 0
    running: int = 0
    workers: int = 1
    trial_wall_s: float = 0.0

    @property
    def left(self) -> int:
        """Trials without an outcome."""
        return self.trials - self.done

    @property
    def remaining_s(self) -> float | None:
        """Time until all are done, from the trials that ran so far; None before the first one."""
        return self.left * self.trial_wall_s / self.ran / max(self.workers, 1) if self.ran else None

    def count(self, outcome: Outcome) -> None:
        """Note a trial that ran."""
        self.done += 1
        self.ran += 1
        self.ran_failed += outcome.status == "failed"
        self.trial_wall_s += outcome.wall_s


class Watch(Protocol):
    """Looks on while a study runs."""

    def __call__(self, standing: Standing) -> bool:
        """Told now and then how far the study is; False ends it: no new trials, those that run are waited for."""


class Dispatcher:
    """Runs trials on workers.

    Args:
        workers: Who runs them.
        note: Told of every outcome at once.
        watch: Looks on.
        standing: How far the study is.
    """

    def __init__(self, workers: Workers, note: Callable[[Outcome], None], watch: Watch, standing: Standing) -> None:
        self._workers = workers
        self._note = note
        self._watch = watch
        self._standing = standing
        self._waiting: deque[Task] = deque()
        self._suspects: deque[Task] = deque()
        self._running: dict[Future[Outcome], Task] = {}
        self._alone: str | None = None
        self._deaths: Counter[str] = Counter()
        self._killed = 0

    def run(self, tasks: Iterable[Task]) -> bool:
        """Run the tasks; whether all of them were run.

        Raises:
            NetsimError: If no worker lives long enough to run a trial, or none is left; what `note` raises.
        """
        self._waiting.extend(tasks)
        going = True
        while going or self._running:
            going = self._look() and going
            if going:
                self._hand_out()
            if not self._running:
                break
            done, _ = wait(self._running, timeout=LOOK_S, return_when=FIRST_COMPLETED)
            self._take(done)
        self._look()
        return not (self._waiting or self._suspects)

    def _look(self) -> bool:
        self._standing.running = len(self._running)
        self._standing.workers = self._workers.count
        return self._watch(self._standing)

    def _hand_out(self) -> None:
        """Fill the window; a suspect waits until nothing else runs, and runs alone."""
        while self._room():
            queue = self._suspects or self._waiting
            try:
                future = self._workers.submit(queue[0])
            except WorkerDied:  # while it had nothing to do
                self._lose([])
                continue
            task = queue.popleft()
            self._running[future] = task
            self._alone = task.key if queue is self._suspects else None

    def _room(self) -> bool:
        if self._suspects:
            return not self._running
        return bool(self._waiting) and self._alone is None and len(self._running) < self._workers.window

    def _take(self, done: "Iterable[Future[Outcome]]") -> None:
        """Note what came back; trials whose worker died are suspects."""
        company = len(self._running) > 1
        victims = [task for future in done if (task := self._taken(future)) is not None]
        if victims:
            self._lose(victims, alone=not company)
        if not self._running:
            self._alone = None

    def _taken(self, future: "Future[Outcome]") -> Task | None:
        """Note the outcome, or return the task if its worker died."""
        task = self._running.pop(future)
        error = self._workers.error_of(future)
        if error is None:
            self._finish(future.result())
        elif isinstance(error, WorkerDied):
            return task
        else:
            raise error
        return None

    def _lose(self, victims: list[Task], *, alone: bool = False) -> None:
        """Replace workers; what ran on them is to be run again, unless it is known for killing them."""
        if self._workers.share_fate:
            broken, _ = wait(self._running)
            victims += [task for future in broken if (task := self._taken(future)) is not None]
        self._workers.renew()
        for task in sorted(victims, key=lambda task: task.trial):
            self._deaths[task.key] += alone
            if self._deaths[task.key] < self._workers.deaths_allowed:
                self._suspects.append(task)
            else:
                self._finish(Outcome(task.trial, task.key, "failed", "its worker died"))
                self._count_killed()

    def _count_killed(self) -> None:
        self._killed += 1
        if self._standing.ran == self._killed == MOST_DEATHS_AT_THE_START:
            message = (
                f"{MOST_DEATHS_AT_THE_START} trials died with their workers and none came back: is there enough memory "
                "for one? Try `--jobs 1`, which shows what happens"
            )
            raise NetsimError(message)

    def _finish(self, outcome: Outcome) -> None:
        self._note(outcome)
        self._standing.count(outcome)
