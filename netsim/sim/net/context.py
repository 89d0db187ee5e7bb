"""What every part of a node's network layer needs to know of its node."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from netsim.api import Delivery, Neighbour
from netsim.sim.clock import Clock
from netsim.sim.net.book import MessageBook
from netsim.sim.net.link_port import Draw
from netsim.sim.net.regions import Point
from netsim.sim.net.settings import NetworkSettings
from netsim.trace.recorder import Recorder


class Surroundings(Protocol):
    """What a node knows of its neighbours."""

    @property
    def discovered(self) -> Sequence[Neighbour] | None:
        """Neighbours found so far; None where they were given."""
        ...

    def on_sent(self, hop: int, delivery: Delivery) -> None:
        """Learn of a link from what became of a packet."""
        ...


class Given:
    """See `Surroundings`: nothing is discovered and nothing learned."""

    discovered: Final = None

    def on_sent(self, hop: int, delivery: Delivery) -> None:
        """See `Surroundings.on_sent`."""


@dataclass(frozen=True, slots=True)
class NetContext:
    """A node, as its network layer sees it.

    Attributes:
        clock: Simulated time.
        node: Its id.
        book: Message numbers for the trace.
        recorder: Where events go.
        packet_byte: Largest packet the MAC takes, header included.
        settings: Time-outs and limits.
        draw: Its random numbers by name.
        position_m: Where it believes it is.
        surroundings: What it knows of its neighbours.
        sink: Where a message to a sink goes now; None without sinks. A sink names itself.
    """

    clock: Clock
    node: int
    book: MessageBook
    recorder: Recorder
    packet_byte: int
    settings: NetworkSettings = field(default_factory=NetworkSettings)
    draw: Draw = lambda name: 0.0
    position_m: Callable[[], Point] = lambda: (0.0, 0.0)
    surroundings: Surroundings = field(default_factory=Given)
    sink: Callable[[], int | None] = lambda: None
