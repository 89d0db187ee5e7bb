"""One sensor node as the simulation sees it: its devices, its network stack, the life of its algorithm."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from netsim.api import Algorithm, Message, Neighbour, NodeHandle, Op
from netsim.errors import AlgorithmError, InvariantError, NetsimError
from netsim.sim.clock import Clock
from netsim.sim.parts import Parts
from netsim.sim.tasks import RunningTask, checked, place_of
from netsim.trace.events import NodeLife
from netsim.trace.recorder import Recorder

T = TypeVar("T")
Service = Callable[[NodeHandle], Op[None]]
Observe = Callable[[], np.ndarray[Any, np.dtype[np.float64]]]


@dataclass(frozen=True, slots=True)
class Identity:
    """What distinguishes a node from the others.

    Attributes:
        id: Its number.
        name: For people.
        group: The scenario's group it belongs to.
        role: `sensor` or `sink`.
        position_m: Where it stands.
        neighbours: Nodes in direct reach.
        knowledge: What the problem lets it know at the start.
        observe: Its view of the world through its sensor.
    """

    id: int
    name: str
    group: str
    role: str
    position_m: tuple[float, float]
    neighbours: tuple[Neighbour, ...]
    knowledge: Any
    observe: Observe


class Node:
    """A sensor node.

    Args:
        clock: Simulated time.
        identity: Who it is, where, and what it knows.
        parts: Its devices and layers.
        recorder: Where its events go.
        on_end: Called once when its algorithm is over, for whatever reason.
        services: What runs beside the algorithm while it lasts, such as time synchronisation.

    Attributes:
        failure: What the algorithm raised, if it did.
        forgotten: An operation that the algorithm dropped without waiting for it.
    """

    def __init__(
        self,
        clock: Clock,
        identity: Identity,
        parts: Parts,
        recorder: Recorder,
        on_end: Callable[["Node"], None],
        services: Sequence[Service] = (),
    ) -> None:
        self._clock = clock
        self.identity = identity
        self.parts = parts
        self._recorder = recorder
        self._on_end = on_end
        self._services = services
        self._tasks: list[RunningTask[Any]] = []
        self._main: RunningTask[None] | None = None
        self._received: list[int] = []
        self.forgotten = ""
        self._answered = False
        self.failure: NetsimError | None = None
        self._is_over = False
        self._is_up = True
        self._is_dead = False

    def start(self, algorithm: Algorithm, handle: NodeHandle) -> None:
        """Power up and run the algorithm."""
        self.parts.radio.start()
        self.parts.network.start()
        self._recorder.record(NodeLife(self.identity.id, "started", type(algorithm).__name__))
        self._begin(algorithm, handle)

    @property
    def is_running(self) -> bool:
        """Whether its algorithm has started and not yet ended."""
        return self._main is not None and not self._main.finished

    def spawn(self, op: Op[T]) -> RunningTask[T]:
        """Run an operation beside the algorithm."""
        task = RunningTask(self._clock, self._guarded_beside(op))
        self._tasks = [other for other in self._tasks if not other.finished]
        self._tasks.append(task)
        self._clock.process(task.body())
        return task

    def die(self) -> None:
        """The battery is empty: every process of this node ended, every device off, at this very nanosecond.

        The processes end first: what they do while clearing up (`finally`) still happens in life. What waits to be sent
        is dropped as `died`.
        """
        self._is_dead = True
        self._shut_down("died")
        self._recorder.record(NodeLife(self.identity.id, "died", "battery empty"))
        self.parts.die()

    def crash(self, reason: str) -> bool:
        """As `die`, but `reboot` brings it back; what waits to be sent is dropped as `crashed`.

        Args:
            reason: What brought it down, for the trace.

        Returns:
            Whether there was anything to crash: False for a node that is down already.
        """
        if not self._is_up:
            return False
        self._shut_down("crashed")
        self._recorder.record(NodeLife(self.identity.id, "crashed", reason))
        self.parts.power_off()
        return True

    def reboot(self, algorithm: Algorithm, handle: NodeHandle) -> bool:
        """Come up after a crash and run the algorithm anew: of its old life it has its knowledge, and no more.

        Random streams and the counters of frames and messages go on where they were.

        Returns:
            Whether it came up: False for a node whose battery ran empty meanwhile.
        """
        if self._is_dead or self._is_up:
            return False
        self._is_up, self._is_over = True, False
        self._received, self._answered, self.forgotten = [], False, ""
        self._recorder.record(NodeLife(self.identity.id, "rebooted", type(algorithm).__name__))
        self.parts.start()
        self._begin(algorithm, handle)
        return True

    def deliver(self, message: Message) -> None:
        """The network layer hands up a message; after the algorithm's end nobody reads it."""
        if not self._is_over:
            now_ns, began_ns = self.parts.clock.now_ns, self.parts.stamps.began_ns
            self.parts.inbox.deliver(replace(message, received_ns=now_ns, frame_began_ns=began_ns))

    def forget(self, operation: str) -> None:
        """The algorithm dropped an operation without waiting for it."""
        if self.is_running:
            self.forgotten = self.forgotten or operation

    def note_received(self, message_id: int) -> None:
        """The algorithm took a message from its inbox. The first one after a send begins a new list of causes."""
        if self._answered:
            self._received, self._answered = [], False
        self._received.append(message_id)

    def causes(self) -> list[int]:
        """What a message sent now answers: everything received between the sends before it and this one."""
        self._answered = True
        return list(self._received)

    def _begin(self, algorithm: Algorithm, handle: NodeHandle) -> None:
        self._main = RunningTask(self._clock, self._guarded(algorithm, handle))
        self._clock.process(self._main.body())
        for service in self._services:
            self.spawn(service(handle))

    def abandon(self) -> None:
        """The run is over: end every process of this node here, not when Python collects it."""
        self._is_over = True
        for task in [*self._tasks, *([self._main] if self._main is not None else [])]:
            with suppress(Exception):  # raised by the user's code while it is ended; nobody is left to hear of it
                task.cancel()

    def _shut_down(self, reason: str) -> None:
        self._end(None)
        self._is_up = False
        self.parts.give_up(reason)

    def _guarded(self, algorithm: Algorithm, handle: NodeHandle) -> Op[None]:
        """Run the algorithm; what it raises ends it on this node, is recorded, and is kept for the report."""
        try:
            yield from checked(algorithm.run(handle))
            if self.forgotten:
                message = f"node.{self.forgotten}(...) was called without `yield from`: nothing happened"
                raise AlgorithmError(message)
        except InvariantError:
            raise  # a defect of the simulator, not of the algorithm
        except (Exception, SystemExit) as error:  # the boundary to the user's code: whatever it raises is its failure
            self._fail(error)
        else:
            self._recorder.record(NodeLife(self.identity.id, "finished", ""))
        self._conclude()

    def _guarded_beside(self, op: Op[T]) -> Op[T]:
        """Run a spawned operation; what it raises ends the whole algorithm on this node."""
        try:
            result: T = yield from checked(op)
        except InvariantError:
            raise
        except (Exception, SystemExit) as error:  # the boundary to the user's code, as above
            self._fail(error)
            self._clock.call_after(0, self._end)
            yield self._clock.event()  # wait to be cancelled with the rest
            raise
        else:
            return result

    def _end(self, _: object) -> None:
        if self._main is not None:
            self._main.cancel()
        self._conclude()

    def _conclude(self) -> None:
        """The algorithm is over, for the first time that somebody says so."""
        self._cancel_tasks()
        if not self._is_over:
            self._is_over = True
            self._on_end(self)

    def _fail(self, cause: BaseException) -> None:
        """Keep and record the first failure; what goes wrong after it is its consequence."""
        if self.failure is None:
            place = place_of(cause)
            what = str(cause) if isinstance(cause, NetsimError) else f"the algorithm raised {cause!r}"
            self.failure = AlgorithmError(f"{what} ({place})" if place else what)
            self.failure.__cause__ = cause
            self._recorder.record(NodeLife(self.identity.id, "failed", str(self.failure)))

    def _cancel_tasks(self) -> None:
        while self._tasks:  # what is ended may begin something new (`finally`), which is ended before it began
            task = self._tasks.pop(0)
            try:
                task.cancel()
            except Exception as error:  # raised by the user's code while it is ended
                self._fail(error)
