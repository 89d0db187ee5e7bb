"""The network layer of one node: messages down, packets up, and what passes through."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from netsim.api import Delivery, Message, Neighbour
from netsim.sim.mac.link import Submits
from netsim.sim.net.book import Origin
from netsim.sim.net.context import NetContext
from netsim.sim.net.flooding import Flooding
from netsim.sim.net.forwarding import Forwarder
from netsim.sim.net.link_port import Done, LinkPort, WaitingRoom
from netsim.sim.net.packet import Form, Packet, decode_ids
from netsim.sim.net.reassembly import Reassembly, Recent
from netsim.sim.net.regions import contains, decode_region, region_byte
from netsim.sim.net.router import Router
from netsim.sim.net.sending import Sending
from netsim.trace.events import BROADCAST
from netsim.units import s_to_ns

SPREAD = (Form.FLOOD, Form.GEOCAST)
TO_ALL = (*SPREAD, Form.MULTICAST)

Filter = Callable[[bytes, int], Sequence[tuple[int, bytes]]]
"""What becomes of a received packet (bytes, neighbour): the copies that are handled, each after its delay in ns."""


class Service(Protocol):
    """Something beside the messages that the network layer does for itself: discovery, the spreading of routes."""

    def start(self) -> None:
        """The node begins to live, or lives again."""
        ...

    def stop(self) -> None:
        """The node stopped: be silent, and forget what was learned."""
        ...

    def on_packet(self, data: bytes, neighbour: int) -> bool:
        """A packet of this service's form arrived; False if it makes no sense."""
        ...


class Network(Sending):
    """Sends messages as packets over one or more hops and hands up those that arrive whole, each once.

    Args:
        context: The node.
        router: Next hops.
        deliver: Called with each whole message for this node.
        by_position: Next hops towards a region; None where nobody knows positions.

    Attributes:
        filter: Rules for received packets, for faults and tests; None lets all pass as they are.
        port: The way to the MAC, for services.
        services: Takers of control packets by form.
    """

    def __init__(
        self,
        context: NetContext,
        router: Router,
        deliver: Callable[[Message], None],
        by_position: Router | None = None,
    ) -> None:
        super().__init__(context, router, by_position)
        settings = context.settings
        self._clock = context.clock
        self._node = context.node
        self._deliver = deliver
        self.filter: Filter | None = None
        self.services: Mapping[int, Service] = {}
        self.port = LinkPort(context.node, self._reporter)
        self._life = 0
        self._delayed = 0
        memory_ns = s_to_ns(settings.memory_s)
        self._forwarded = Recent(memory_ns)
        self._room = WaitingRoom(context.clock, context.draw, settings.waiting_packets)
        self._forwarder = Forwarder(
            self.port, self._room, settings.retries, s_to_ns(settings.retry_delay_s), context.surroundings.on_sent
        )
        self._flooding = Flooding(
            self._room,
            self._forwarded,
            s_to_ns(settings.forward_delay_s),
            settings.hop_limit,
            lambda packet: self._pass_on(packet, None),
            self._dropped,
        )
        timeout_ns = s_to_ns(settings.reassembly_timeout_s)
        most = settings.reassembly_messages
        self._reassembly = Reassembly(context.clock, timeout_ns, most, memory_ns, self._dropped)

    def give_up(self, reason: str) -> None:
        """See `NetworkLayer.give_up`: what waits here, and what has come in parts."""
        self._room.close(reason)
        self._reassembly.give_up_all(reason)

    def attach(self, mac: Submits) -> None:
        """Connect the MAC below."""
        self.port.attach(mac)

    @property
    def discovered(self) -> Sequence[Neighbour] | None:
        """Neighbours found so far; None where they were given."""
        return self._context.surroundings.discovered

    @property
    def pending(self) -> int:
        """Packets of messages that wait in this layer; beacons and routes do not count."""
        return self._room.waiting + self._delayed

    def start(self) -> None:
        """The node begins to live, or lives again after `stop`."""
        for service in self.services.values():
            service.start()

    def stop(self) -> None:
        """See `NetworkLayer.stop`; the count of messages goes on, so that none is taken for another."""
        self._life += 1
        self._delayed = 0
        for service in self.services.values():
            service.stop()
        self._room.clear()
        self._reassembly.clear()
        self._forwarded.clear()

    def _launch(self, packet: Packet, origin: Origin, done: Done) -> None:
        if packet.form in SPREAD:
            self._flooding.begin(packet, self._clock.now_ns)
        self._pass_on(packet, None, origin, done)

    # --- up and through -----------------------------------------------------------------------------------------------

    def on_packet(self, data: bytes, neighbour: int) -> None:
        """A packet arrived from a neighbour; it may be any bytes."""
        if self.filter is None:
            self._receive(data, neighbour)
            return
        for delay_ns, copy in self.filter(data, neighbour):
            if delay_ns <= 0:
                self._receive(copy, neighbour)
            else:
                self._receive_later(delay_ns, copy, neighbour)

    def _receive_later(self, delay_ns: int, data: bytes, neighbour: int) -> None:
        self._delayed += 1
        life = self._life

        def act(_: object) -> None:
            if life == self._life:
                self._delayed -= 1
                self._receive(data, neighbour)

        self._clock.call_after(delay_ns, act)

    def _receive(self, data: bytes, neighbour: int) -> None:
        form = data[0] >> 4 if data else -1
        service = self.services.get(form)
        if service is not None:
            if not service.on_packet(data, neighbour):
                self._reporter.frame_dropped(neighbour, self._node, "", "malformed")
            return
        packet = Packet.decode(data)
        if packet is None or self._context.book.kinds.name(packet.kind_code) is None:
            self._reporter.frame_dropped(neighbour, self._node, "", "malformed")
        elif packet.form in SPREAD:
            self._spread(packet)
        elif self._is_for_me(packet):
            self._collect(packet)
        elif packet.form == Form.GEOCAST_WAY and self._is_inside(packet.fields):
            region = packet.fields[: region_byte(packet.fields)]
            self._spread(replace(packet, form=Form.GEOCAST, fields=region))
        elif packet.form != Form.MULTICAST:
            self._relay(packet, neighbour)

    def _is_for_me(self, packet: Packet) -> bool:
        if packet.form == Form.MULTICAST:
            return self._node in decode_ids(packet.fields)
        if packet.form == Form.COLLECT and self._context.sink() == self._node:
            return True
        return packet.destination == self._node or (packet.form == Form.DATA and packet.destination == BROADCAST)

    def _is_inside(self, fields: bytes) -> bool:
        return contains(decode_region(fields), self._context.position_m())

    def _spread(self, packet: Packet) -> None:
        """A flooded packet: deliver and pass on, in a geocast only inside the region."""
        if packet.form == Form.GEOCAST and not self._is_inside(packet.fields):
            return
        if self._flooding.take(packet, self._clock.now_ns):
            self._collect(packet)

    def _relay(self, packet: Packet, neighbour: int) -> None:
        if packet.hops >= self._context.settings.hop_limit:
            self._dropped(packet, "hop_limit")
        elif self._forwarded.add((packet.hops, *packet.key), self._clock.now_ns):
            self._pass_on(replace(packet, hops=packet.hops + 1), neighbour)

    def _pass_on(
        self, packet: Packet, previous: int | None, origin: Origin | None = None, done: Done = lambda delivery: None
    ) -> None:
        """Send a packet to all neighbours, or to the next hop of its way."""
        known = origin or self._context.book.find(packet, self._clock.now_ns)

        def finished(delivery: Delivery) -> None:
            if not delivery.acknowledged:
                self._reporter.dropped(packet, known, delivery.reason)
            done(delivery)

        router = self._by_position if packet.form == Form.GEOCAST_WAY else self._router
        if packet.form in TO_ALL or (packet.form == Form.DATA and packet.destination == BROADCAST):
            self.port.submit(BROADCAST, packet.encode(), known, finished)
        elif router is None:
            finished(Delivery(acknowledged=False, reason="no_route", attempts=0))
        else:
            self._forwarder.forward(router, packet, previous, known, finished)

    def _collect(self, packet: Packet) -> None:
        """Reassemble; a message is handed up once, when its last missing fragment has come."""
        payload = self._reassembly.add(packet)
        if payload is None:
            return
        now_ns = self._clock.now_ns
        origin = self._context.book.find(packet, now_ns)
        kind = self._context.book.kinds.name(packet.kind_code) or ""
        self._reporter.delivered(packet, kind, len(payload), origin, now_ns)
        to = self._node if packet.form == Form.MULTICAST else packet.destination
        self._deliver(Message(origin.message_id, packet.origin, to, kind, payload, now_ns, packet.hops))

    def _dropped(self, packet: Packet, reason: str) -> None:
        self._reporter.dropped(packet, self._context.book.find(packet, self._clock.now_ns), reason)
