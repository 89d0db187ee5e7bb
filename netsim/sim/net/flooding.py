"""Flooding: every node that hears a packet for the first time passes it on once, after a small random delay."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from netsim.sim.net.link_port import WaitingRoom
from netsim.sim.net.packet import Form, Packet
from netsim.sim.net.reassembly import Recent

FLOOD_LIMIT = 16
"""Hops a flood makes where nothing else is said."""


class Flooding:
    """Passes floods on.

    Args:
        room: Where packets wait for their random moment.
        seen: Fragments that came before.
        delay_ns: Longest delay.
        hop_limit: No packet makes more hops than this.
        transmit: Sends a packet to all neighbours.
        dropped: Told of a packet that found no room to wait.
    """

    def __init__(
        self,
        room: WaitingRoom,
        seen: Recent,
        delay_ns: int,
        hop_limit: int,
        transmit: Callable[[Packet], None],
        dropped: Callable[[Packet, str], None],
    ) -> None:
        self._room = room
        self._seen = seen
        self._delay_ns = delay_ns
        self._hop_limit = hop_limit
        self._transmit = transmit
        self._dropped = dropped

    def begin(self, packet: Packet, now_ns: int) -> None:
        """Remember a packet that begins here, so that its echo is not passed on."""
        self._seen.add(("flood", *packet.key), now_ns)

    def take(self, packet: Packet, now_ns: int) -> bool:
        """A flooded packet was heard; returns whether for the first time. If so it will be passed on."""
        if not self._seen.add(("flood", *packet.key), now_ns):
            return False
        limit = packet.fields[0] if packet.form == Form.FLOOD else self._hop_limit
        if packet.hops < min(limit, self._hop_limit):
            onward = replace(packet, hops=packet.hops + 1)
            name = "flood/{}/{}/{}".format(*packet.key)
            transmit, lost = partial(self._transmit, onward), partial(self._dropped, packet)
            if not self._room.later(self._delay_ns, name, transmit, lost):
                lost("queue_full")
        return True
