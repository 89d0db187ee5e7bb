"""Trials on a Dask cluster: any machines that reach its scheduler and have the same netsim; no shared disk is needed.

    dask scheduler --port 8786                                # on one machine
    dask worker tcp://HOST:8786 --nworkers 8 --nthreads 1     # on each machine that helps
    netsim study STUDY --scheduler tcp://HOST:8786

A task takes its variant's files along.
"""

import re
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import replace
from typing import Any

from netsim.errors import NetsimError, ScenarioError
from netsim.study.build_id import build_id, versions
from netsim.study.executors import WorkerDied, window_of
from netsim.study.trial import Outcome, Task, files_of, run_trial

CONNECT_S = 5.0
"""How long a scheduler may take to answer."""
COUNT_EVERY_S = 5.0
"""How often to look whether workers came or went."""


ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://(\[[0-9a-fA-F:.]+\]|[^:/\s]+):[0-9]{1,5}")
"""Of a scheduler: protocol, host, port."""


class ClusterLost(NetsimError):
    """The scheduler went away while a study ran."""


class DaskWorkers:
    """The workers of a Dask scheduler, as many as there are at the time.

    Args:
        address: Of the scheduler, such as `tcp://host:8786`.

    Raises:
        NetsimError: If Dask is not installed, no scheduler answers there, it has no workers, or they have another netsim.

    Attributes:
        warnings: Where the workers' Python and packages are not those of this process, in words.
    """

    deaths_allowed = 1
    """Dask itself tries a task on several workers before it gives it up."""
    share_fate = False

    def __init__(self, address: str) -> None:
        self._address = address
        self._client = _client(address)
        self._executor = self._client.get_executor(pure=False)
        self._counted_s = 0.0
        self._count = 0
        try:
            self.warnings = _check_versions(self._client, address)
            self.name = f"{self.count} workers of {address}"
        except BaseException:
            self.close(at_once=True)
            raise

    @property
    def count(self) -> int:
        """Threads of all workers, each of which runs a trial at a time."""
        now_s = time.monotonic()
        if now_s - self._counted_s > COUNT_EVERY_S:
            self._counted_s = now_s
            self._count = self._asked(lambda: sum(self._client.nthreads().values()))
        return self._count

    @property
    def window(self) -> int:
        """See `Workers.window`."""
        return window_of(self.count)

    def submit(self, task: Task) -> "Future[Outcome]":
        """See `Workers.submit`; the task takes its files along."""
        packed = replace(task, files=files_of(task))
        future: Future[Outcome] = self._asked(lambda: self._executor.submit(run_trial, packed))
        return future

    def error_of(self, future: "Future[Outcome]") -> BaseException | None:
        """See `Workers.error_of`."""
        from distributed import KilledWorker

        try:
            error = future.exception()
        except CancelledError as cancelled:
            error = cancelled
        if isinstance(error, KilledWorker):
            message = "its worker died"
            return WorkerDied(message)
        if isinstance(error, CancelledError | OSError | TimeoutError):
            return self._lost(error)
        return error

    def renew(self) -> None:
        """Dask looks after its workers itself."""

    def close(self, *, at_once: bool) -> None:
        """Leave the cluster; trials that still run there are cancelled."""
        with suppress(Exception):  # whatever a lost connection gives rise to
            self._executor.shutdown(wait=not at_once)
        with suppress(Exception):
            self._client.close(timeout=2)

    def _asked(self, ask: Callable[[], Any]) -> Any:
        try:
            return ask()
        except (OSError, TimeoutError, RuntimeError, CancelledError) as error:
            raise self._lost(error) from error

    def _lost(self, error: BaseException) -> ClusterLost:
        why = f": {error}" if str(error) else ""
        return ClusterLost(f"lost the Dask scheduler at {self._address}{why}")


def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        message = "--scheduler needs Dask, which is not installed: pip install dask distributed"
        raise ScenarioError(message) from error
    if not ADDRESS.fullmatch(address):  # Dask would leave a client behind that complains when it is collected
        message = f"--scheduler: expected an address such as tcp://host:8786, got `{address}`"
        raise ScenarioError(message)
    _quieten()
    connect: Any = Client
    try:
        return connect(address, timeout=CONNECT_S, name="netsim-study", set_as_default=False)
    except ValueError as error:
        message = f"--scheduler {address}: expected an address such as tcp://host:8786 ({error})"
        raise ScenarioError(message) from error
    except (OSError, TimeoutError) as error:
        message = f"no Dask scheduler answers at {address}; start one: dask scheduler --port 8786"
        raise NetsimError(message) from error


def _check_versions(client: Any, address: str) -> tuple[str, ...]:
    """Every worker must have this netsim: figures of another one must not get into the table unnoticed.

    Returns:
        Where their packages differ from those here, in words.
    """

    def versions_there() -> dict[str, str]:  # goes to the workers by value, as it is no function of a module
        try:
            from netsim.study.build_id import versions
        except ImportError:
            return {}
        return versions()

    try:
        found = client.run(versions_there)
    except OSError as error:
        message = f"lost the Dask scheduler at {address}: {error}"
        raise ClusterLost(message) from error
    if not found:
        message = f"the Dask scheduler at {address} has no workers; start some: dask worker {address} --nthreads 1"
        raise NetsimError(message)
    for worker, there in sorted(found.items()):
        version = there.get("netsim", "")
        if version != build_id():
            has = f"has netsim {version}" if version else "has no netsim, or an old one"
            message = f"the worker {worker} {has}, this is netsim {build_id()}: install the same on all machines"
            raise NetsimError(message)

    return tuple(_other_packages(list(found.values()), address))


def _other_packages(found: Sequence[Mapping[str, str]], address: str) -> Iterator[str]:
    """One line if packages of workers differ from those here."""
    told = []
    for name, own in versions().items():
        others = Counter(there[name] for there in found if there[name] != own)
        told += [f"{name} {each} on {count} of {len(found)} (here {own})" for each, count in sorted(others.items())]
    if told:
        yield f"figures may depend on it that workers of {address} have other packages: {', '.join(told)}"


def _quieten() -> None:
    """Dask's own log would tell of lost connections line by line, beside our one line."""
    import logging

    names = ("distributed", "distributed.client", "distributed.comm", "tornado", "tornado.application", "asyncio")
    for name in names:  # each by itself: Dask gives some of them levels of their own
        logging.getLogger(name).setLevel(logging.CRITICAL)
