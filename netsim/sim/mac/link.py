"""What every MAC offers and needs: jobs from the network layer, frames from the radio."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from netsim.api import Delivery
from netsim.sim.frames import LinkFrame
from netsim.sim.radio import Radio


@dataclass(slots=True, eq=False)
class LinkJob:
    """One packet to be sent to one neighbour, or to all of them.

    Attributes:
        destination: Next hop or `BROADCAST`.
        packet: Network-layer bytes.
        kind: Kind of the message served.
        message_id: Number of the message served.
        done: Called once with what became of it.
    """

    destination: int
    packet: bytes
    kind: str
    message_id: int
    done: Callable[[Delivery], None]


Deliver = Callable[[bytes, int], None]
"""Called with a packet and the neighbour it came from."""


class Submits(Protocol):
    """Takes packets to be sent: a MAC, or what stands before it."""

    def submit(self, job: LinkJob) -> None:
        """Take a job; its `done` is called once."""
        ...


class Mac(Protocol):
    """Medium access of one node."""

    @property
    def pending(self) -> int:
        """Jobs accepted and not yet done."""
        ...

    def submit(self, job: LinkJob) -> None:
        """Queue a job; a full queue ends it at once with `queue_full`."""
        ...

    def sleep(self) -> None:
        """Put the radio to sleep whenever the queue is empty; a job wakes it for as long as the job takes."""
        ...

    def wake(self) -> None:
        """Keep the radio awake."""
        ...

    def give_up(self, reason: str) -> None:
        """The node is about to stop: end every job, also the one under way, with this reason."""
        ...

    def stop(self) -> None:
        """The node died or crashed: forget everything. When its radio is powered up again (`Radio.start`) it begins anew."""
        ...


class QueuedMac(ABC):
    """What MACs with a queue share: jobs wait, one at a time is under way, and the radio sleeps between them if wished.

    A MAC that lets the radio rest by itself defines when: `_rest` is called whenever there is nothing to send.

    Args:
        radio: This node's radio.
        most_waiting: How many jobs can wait; None for any number.
    """

    _begins_awake = True
    """Whether a job is begun only when the radio is on."""

    def __init__(self, radio: Radio, most_waiting: int | None) -> None:
        self._radio = radio
        self._most_waiting = most_waiting
        self._waiting: deque[LinkJob] = deque()
        self._job: LinkJob | None = None
        self._wants_sleep = False
        radio.on_receive = self._on_receive
        radio.on_transmitted = self._on_transmitted
        radio.on_ready = self._on_ready
        radio.on_started = self._on_started

    @property
    def pending(self) -> int:
        """See `Mac.pending`."""
        return len(self._waiting) + (self._job is not None)

    def submit(self, job: LinkJob) -> None:
        """See `Mac.submit`."""
        if self._most_waiting is not None and len(self._waiting) >= self._most_waiting:
            job.done(Delivery(acknowledged=False, reason="queue_full", attempts=0))
            return
        self._waiting.append(job)
        self._proceed()

    def sleep(self) -> None:
        """See `Mac.sleep`."""
        self._wants_sleep = True
        self._proceed()

    def wake(self) -> None:
        """See `Mac.wake`."""
        self._wants_sleep = False
        self._radio.wake()

    def give_up(self, reason: str) -> None:
        """See `Mac.give_up`."""
        under_way, self._job = self._job, None
        waiting = list(self._waiting)
        self._waiting.clear()
        if under_way is not None:
            under_way.done(Delivery(acknowledged=False, reason=reason, attempts=self._attempts_made))
        for job in waiting:
            job.done(Delivery(acknowledged=False, reason=reason, attempts=0))

    def stop(self) -> None:
        """See `Mac.stop`."""
        self._waiting.clear()
        self._job = None
        self._wants_sleep = False

    @abstractmethod
    def _begin(self, job: LinkJob) -> None:
        """Start with a job; `_finish` ends it."""

    @abstractmethod
    def _on_receive(self, frame: LinkFrame) -> None:
        """See `Radio.on_receive`."""

    @abstractmethod
    def _on_transmitted(self, frame: LinkFrame) -> None:
        """See `Radio.on_transmitted`."""

    @property
    def _attempts_made(self) -> int:
        """Transmissions of the job under way so far."""
        return 0

    def _on_ready(self) -> None:
        """See `Radio.on_ready`."""
        self._proceed()

    def _on_started(self) -> None:
        """See `Radio.on_started`."""
        self._proceed()

    def _rest(self) -> None:
        """Nothing is to be sent: let the radio sleep if that is wished."""
        if self._wants_sleep and self._radio.can_transmit:
            self._radio.sleep()

    def _finish(self, reason: str, attempts: int) -> None:
        """The job under way is done, or given up for a reason."""
        job, self._job = self._job, None
        if job is not None:
            job.done(Delivery(acknowledged=not reason, reason=reason, attempts=attempts))
        self._proceed()

    def _proceed(self) -> None:
        """Begin the next job, or let the radio rest, if it is time for that."""
        if self._job is not None:
            return
        if not self._waiting:
            self._rest()
        elif self._radio.is_awake or not self._begins_awake:
            self._job = self._waiting.popleft()
            self._begin(self._job)
        else:
            self._radio.wake()


class Duplicates:
    """Link-layer duplicate suppression: a retry that repeats a frame whose acknowledgement was lost is not new.

    A neighbour sends one frame at a time, so remembering its last one is enough. The packet is compared besides the
    sequence number: a number that has come round again after 256 frames to others does not make a repeat.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[int, bytes]] = {}

    def is_new(self, frame: LinkFrame) -> bool:
        """Whether this frame was not received before; remembers it."""
        seen, now = self._last.get(frame.source), (frame.sequence, frame.packet)
        self._last[frame.source] = now
        return seen != now
