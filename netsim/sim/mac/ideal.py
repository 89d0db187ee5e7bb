"""The ideal MAC: a queue in front of the radio. No contention, no acknowledgement, no retry."""

from collections import deque
from typing import Literal

from netsim.api import Delivery
from netsim.parameters import parameters
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.link import Deliver, LinkJob
from netsim.sim.radio import Radio


@parameters
class IdealMacParameters:
    """Frames go out one after the other, at once; what the medium loses stays lost."""

    type: Literal["ideal"] = "ideal"


class IdealMac:
    """See `IdealMacParameters`."""

    def __init__(self, clock: Clock, radio: Radio, deliver: Deliver) -> None:
        self._clock = clock
        self._radio = radio
        self.deliver = deliver
        self._queue: deque[LinkJob] = deque()
        self._sending: LinkJob | None = None
        self._wants_sleep = False
        radio.on_receive = self.on_receive
        radio.on_transmitted = self.on_transmitted
        radio.on_ready = self._next

    @property
    def pending(self) -> int:
        """See `Mac.pending`."""
        return len(self._queue) + (self._sending is not None)

    def submit(self, job: LinkJob) -> None:
        """See `Mac.submit`; the ideal queue has no bound."""
        self._queue.append(job)
        self._next()

    def on_receive(self, frame: LinkFrame) -> None:
        """See `Mac.on_receive`."""
        if frame.is_for(self._radio.node):
            self.deliver(frame.packet, frame.source)

    def on_transmitted(self, frame: LinkFrame) -> None:
        """See `Mac.on_transmitted`."""
        job, self._sending = self._sending, None
        if job is not None:
            job.done(Delivery(acknowledged=True, reason="", attempts=1))
        self._next()

    def sleep(self) -> None:
        """Put the radio to sleep once the queue is empty."""
        self._wants_sleep = True
        self._next()

    def wake(self) -> None:
        """Wake the radio, or forget that it was to sleep."""
        self._wants_sleep = False
        self._radio.wake()

    def stop(self) -> None:
        """See `Mac.stop`."""
        self._queue.clear()
        self._sending = None

    def _next(self) -> None:
        if self._sending is not None:
            return
        if self._queue and not self._radio.is_awake:
            self._radio.wake()
        elif self._queue:
            self._sending = job = self._queue.popleft()
            node = self._radio.node
            self._radio.transmit(
                LinkFrame(node, job.destination, 0, False, False, job.packet, job.kind, job.message_id)
            )
        elif self._wants_sleep and self._radio.is_awake:
            self._radio.sleep()
