"""The network layer's door to the MAC below, and its waiting room in front of it."""

from collections.abc import Callable

from netsim.api import Delivery
from netsim.sim.clock import Clock
from netsim.sim.mac.link import LinkJob, Submits
from netsim.sim.net.book import Origin, Reporter
from netsim.trace.events import BROADCAST

Done = Callable[[Delivery], None]
Draw = Callable[[str], float]
"""A uniform number in [0, 1) by name: the same name gives the same number."""
Lost = Callable[[str], None]
"""Told why a packet was given up."""


class LinkPort:
    """Hands packets to the MAC.

    Args:
        node: This node's id.
        reporter: Where control frames that were given up are counted.
    """

    def __init__(self, node: int, reporter: Reporter) -> None:
        self._node = node
        self._reporter = reporter
        self._mac: Submits | None = None

    def attach(self, mac: Submits) -> None:
        """Connect the MAC below."""
        self._mac = mac

    def submit(self, hop: int, packet: bytes, origin: Origin, done: Done) -> None:
        """Send a packet of a message to a neighbour, or to all."""
        if self._mac is None:
            done(Delivery(acknowledged=False, reason="no_route", attempts=0))
        else:
            self._mac.submit(LinkJob(hop, packet, origin.kind, origin.message_id, done))

    def control(self, packet: bytes, kind: str) -> None:
        """Send control traffic to all neighbours."""

        def done(delivery: Delivery) -> None:
            if not delivery.acknowledged:
                self._reporter.frame_dropped(self._node, BROADCAST, kind, delivery.reason)

        self.submit(BROADCAST, packet, Origin(0, kind, 0), done)


class WaitingRoom:
    """Packets that are to be sent a little later; there is room for so many.

    Args:
        clock: Simulated time.
        draw: The node's random numbers by name.
        most: How many packets can wait.
    """

    def __init__(self, clock: Clock, draw: Draw, most: int) -> None:
        self._clock = clock
        self._draw = draw
        self._most = most
        self._waiting: dict[int, Lost] = {}
        self._count = 0
        self._is_closed = False

    @property
    def waiting(self) -> int:
        """How many packets wait."""
        return len(self._waiting)

    def later(self, longest_ns: int, name: str, action: Callable[[], None], lost: Lost) -> bool:
        """Act after a random time from 0 to below `longest_ns`, drawn by name.

        Args:
            longest_ns: Longest time to wait.
            name: Of the draw.
            action: What to do then.
            lost: Told the reason if the packet is given up while it waits.

        Returns:
            Whether there is room.
        """
        if self._is_closed or len(self._waiting) >= self._most:
            return False
        self._count += 1
        number = self._count
        self._waiting[number] = lost

        def act(_: object) -> None:
            if self._waiting.pop(number, None) is not None:
                action()

        self._clock.call_after(int(self._draw(name) * longest_ns), act)
        return True

    def close(self, reason: str) -> None:
        """The node is about to stop: give up what waits, and take nothing more until `clear`."""
        self._is_closed = True
        waiting, self._waiting = self._waiting, {}
        for lost in waiting.values():
            lost(reason)

    def clear(self) -> None:
        """The node stopped: nothing of this is sent."""
        self._waiting.clear()
        self._is_closed = False
