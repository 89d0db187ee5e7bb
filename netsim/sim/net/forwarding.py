"""One hop after the other: asks the router, hands to the MAC, and tries again where it may."""

from collections.abc import Callable

from netsim.api import Delivery
from netsim.sim.net.book import Origin
from netsim.sim.net.link_port import Done, LinkPort, WaitingRoom
from netsim.sim.net.packet import Packet
from netsim.sim.net.router import Router

Feedback = Callable[[int, Delivery], None]
"""Told what became of each packet handed to the MAC for a neighbour."""


class Forwarder:
    """Sends packets to the next hop of their way.

    A packet that the MAC gave up, or that finds no way, is routed anew after a random time; so it may take another way
    once the router has learned of the failure. After `no_ack` the packet may have arrived all the same: then a second
    copy of it is under way, which its destination tells by its number.

    Args:
        port: The MAC.
        room: Where packets wait for their next try.
        retries: How many tries there are after the first.
        delay_ns: Longest time before a new try.
        feedback: Learns of links from what became of data.
    """

    def __init__(self, port: LinkPort, room: WaitingRoom, retries: int, delay_ns: int, feedback: Feedback) -> None:
        self._port = port
        self._room = room
        self._retries = retries
        self._delay_ns = delay_ns
        self._feedback = feedback

    def forward(self, router: Router, packet: Packet, previous: int | None, origin: Origin, done: Done) -> None:
        """Send a packet on; `done` is called once with what became of it."""
        self._try(router, packet, previous, origin, done, 0, 0)

    def _try(
        self, router: Router, packet: Packet, previous: int | None, origin: Origin, done: Done, number: int, spent: int
    ) -> None:
        way = router.route(packet, previous)

        def finished(delivery: Delivery) -> None:
            if way.hop is not None:
                self._feedback(way.hop, delivery)
            attempts = spent + delivery.attempts
            again = lambda: self._try(router, packet, previous, origin, done, number + 1, attempts)  # noqa: E731
            name = f"retry/{packet.origin}/{packet.sequence}/{packet.index}/{packet.hops}/{number}"
            may = not delivery.acknowledged and number < self._retries
            lost = lambda reason: done(Delivery(False, reason, attempts))  # noqa: E731
            if not (may and self._room.later(self._delay_ns, name, again, lost)):
                done(Delivery(delivery.acknowledged, delivery.reason, attempts))

        if way.hop is None:
            finished(Delivery(acknowledged=False, reason="no_route", attempts=0))
        else:
            self._port.submit(way.hop, way.packet.encode(), origin, finished)
