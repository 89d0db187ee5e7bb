"""What an algorithm waits for: operations that run beside it, and the fate of what it sent."""

import traceback
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any, Generic, TypeVar

from simpy.events import Event as SimEvent

from netsim.api import Delivery, Op
from netsim.errors import AlgorithmError
from netsim.sim.clock import Clock

T = TypeVar("T")


class Waiting(Generic[T]):
    """A value that is not known yet, and those who wait for it."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiters: list[SimEvent] = []
        self.known = False
        self._value: T | None = None

    def set(self, value: T | None) -> None:
        """Make the value known and wake who waits for it. Only the first value counts."""
        if self.known:
            return
        self.known = True
        self._value = value
        waiters, self._waiters = self._waiters, []
        for event in waiters:
            event.succeed()

    def get(self) -> Op[Any]:
        """Wait for the value; `set(None)` (something cancelled) yields None."""
        if not self.known:
            event = self._clock.event()
            self._waiters.append(event)
            yield event
        return self._value


class RunningTask(Generic[T]):
    """See `netsim.api.Task`; a cancelled task's result is None."""

    def __init__(self, clock: Clock, op: Op[T]) -> None:
        self._op = op
        self._result: Waiting[T] = Waiting(clock)

    @property
    def finished(self) -> bool:
        """Whether it has ended or was cancelled."""
        return self._result.known

    def body(self) -> Generator[Any, Any, None]:
        """The SimPy process: the operation, then whoever waits for it."""
        result = yield from self._op
        self._result.set(result)

    def join(self) -> Op[T]:
        """See `Task.join`."""
        return self._result.get()

    def cancel(self) -> None:
        """See `Task.cancel`."""
        if getattr(self._op, "gi_running", False):
            message = "a task cannot cancel itself: let it return"
            raise AlgorithmError(message)
        if not self.finished:
            self._op.close()
            self._result.set(None)


class SentMessage:
    """See `netsim.api.Ticket`.

    Attributes:
        message_id: Number of the message in the trace.
        is_done: Whether the link layer has finished with it.
        on_done: Called when that happens.
    """

    def __init__(self, clock: Clock) -> None:
        self._delivery: Waiting[Delivery] = Waiting(clock)
        self.message_id = 0
        self.is_done = False
        self.on_done: Callable[[], None] = lambda: None

    def done(self, delivery: Delivery) -> None:
        """The link layer has finished with the message."""
        self.is_done = True
        self._delivery.set(delivery)
        self.on_done()

    def wait(self) -> Op[Delivery]:
        """See `Ticket.wait`."""
        return self._delivery.get()


class Operation(Generic[T]):
    """What a handle gives for something that takes time; dropped without `yield from`, it tells.

    `yield from` and `spawn` take the generator out of it: waiting costs no more than without it.
    """

    __slots__ = ("_forgotten", "_op")

    def __init__(self, op: Op[T], forgotten: Callable[[], None]) -> None:
        self._op = op
        self._forgotten: Callable[[], None] | None = forgotten

    def __iter__(self) -> Op[T]:
        self._forgotten = None
        return self._op

    def __del__(self) -> None:
        if self._forgotten is not None:
            self._op.close()
            self._forgotten()


def started(op: Any) -> Any:
    """The generator of an operation, about to be waited for."""
    return iter(op) if isinstance(op, Operation) else op


def checked(op: Any) -> Op[Any]:
    """Run an operation of an algorithm, and refuse whatever it yields that is not something to wait for.

    Raises:
        AlgorithmError: For a function that is no generator, or a yielded value that is no event of the simulation.
    """
    op = started(op)
    if not isinstance(op, Generator):
        message = f"run(node) gave {op!r}, not a generator: wait for something with `yield from`"
        raise AlgorithmError(message)
    value = None
    try:
        while True:
            event = op.send(value)
            if not isinstance(event, SimEvent):
                what = "an operation" if isinstance(started(event), Generator) else repr(event)
                message = f"yielded {what}: write `yield from`, as in `yield from node.pause(...)`"
                raise AlgorithmError(message)
            value = yield event
    except StopIteration as stop:
        return stop.value
    finally:
        op.close()


def place_of(error: BaseException) -> str:
    """Where an error was raised: the innermost line outside netsim, as `file.py, line 12`; empty if there is none."""
    package = str(Path(__file__).resolve().parent.parent)
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not frame.filename.startswith(package):
            return f"{Path(frame.filename).name}, line {frame.lineno}"
    return ""
