"""What every MAC offers and needs: jobs from the network layer, frames from the radio."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from netsim.api import Delivery
from netsim.sim.frames import LinkFrame


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

    def stop(self) -> None:
        """The node died: drop everything."""
        ...


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
