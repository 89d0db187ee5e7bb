"""Who runs the trials: this process, or a pool of worker processes on this machine.

Both, and the cluster of `netsim.study.cluster`, are `Workers`: an executor, how many trials are handed to it at a time,
and what is done when it breaks.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol

from netsim.errors import NetsimError
from netsim.study.trial import Outcome, Task, run_trial
from netsim.study.worker import prepare_worker


class WorkerDied(NetsimError):
    """The worker of a trial died before it had a result: killed, out of memory, or crashed."""


class Workers(Protocol):
    """What runs trials.

    Attributes:
        name: What to call it in a message, such as `2 worker processes`.
        deaths_allowed: How often a trial that runs alone may take its worker with it before it counts as failed.
        share_fate: Whether a worker that dies takes the trials of all others with it.
    """

    name: str
    deaths_allowed: int
    share_fate: bool

    @property
    def count(self) -> int:
        """How many trials it runs at a time."""

    @property
    def window(self) -> int:
        """How many trials it should hold: a few more than it runs, so that no worker waits for the next one."""

    def submit(self, task: Task) -> "Future[Outcome]":
        """Hand over a trial.

        Raises:
            WorkerDied: If a worker died before; `renew` them.
            NetsimError: If there is nobody any more to hand it to.
        """

    def error_of(self, future: "Future[Outcome]") -> BaseException | None:
        """Why a future that is done has no result; `WorkerDied` if that is why."""

    def renew(self) -> None:
        """Replace workers that died."""

    def close(self, *, at_once: bool) -> None:
        """Let the workers go; at once, without waiting for the trials they run."""


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


class ThisProcess:
    """Runs one trial after the other in this process."""

    name = "this process"
    deaths_allowed = 1
    share_fate = True
    count = 1
    window = 1

    def __init__(self) -> None:
        self._executor = SerialExecutor()

    def submit(self, task: Task) -> "Future[Outcome]":
        """See `Workers.submit`; when it returns, the trial has been run."""
        return self._executor.submit(run_trial, task)

    def error_of(self, future: "Future[Outcome]") -> BaseException | None:
        """See `Workers.error_of`."""
        return future.exception()

    def renew(self) -> None:
        """Nothing can die."""

    def close(self, *, at_once: bool) -> None:
        """Nothing runs."""


class LocalPool:
    """Worker processes on this machine.

    They are spawned, not forked: a fork would copy the locks of threads that the copy does not have.

    Args:
        count: How many.
    """

    deaths_allowed = 2
    share_fate = True

    def __init__(self, count: int) -> None:
        self.count = count
        self.name = f"{count} worker processes"
        self.window = window_of(count)
        self._others = set(multiprocessing.active_children())
        self._executor = self._pool()

    def submit(self, task: Task) -> "Future[Outcome]":
        """See `Workers.submit`."""
        try:
            with _interrupt_held():
                return self._executor.submit(run_trial, task)
        except BrokenExecutor as error:
            raise _died() from error

    def error_of(self, future: "Future[Outcome]") -> BaseException | None:
        """See `Workers.error_of`."""
        error = future.exception()
        return _died() if isinstance(error, BrokenExecutor) else error

    def renew(self) -> None:
        """See `Workers.renew`."""
        self.close(at_once=True)
        self._executor = self._pool()

    def close(self, *, at_once: bool) -> None:
        """See `Workers.close`."""
        self._executor.shutdown(wait=not at_once, cancel_futures=True)
        if at_once:
            for child in set(multiprocessing.active_children()) - self._others:
                child.kill()

    def _pool(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self.count, context, initializer=prepare_worker)


@contextmanager
def _interrupt_held() -> Iterator[None]:
    """Hold a Ctrl-C back: a worker begun meanwhile inherits that, and is not hit before it is told to ignore it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def window_of(count: int) -> int:
    """How many trials to hand to so many workers at a time: few, so that the end of a study is quick when wished."""
    return count + 1 + count // 4


def _died() -> WorkerDied:
    message = "its worker died"
    return WorkerDied(message)


def usable_cores() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def local_workers(jobs: int) -> Workers:
    """This process for one job, else a pool."""
    return ThisProcess() if jobs == 1 else LocalPool(jobs)
