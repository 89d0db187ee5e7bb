"""The network layer of one node: messages down, packets up, and what passes through."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final, Protocol

from netsim.api import Delivery, Message, Neighbour, Region
from netsim.errors import AlgorithmError
from netsim.sim.clock import Clock
from netsim.sim.mac.link import Mac
from netsim.sim.net.book import MessageBook, Origin, Reporter
from netsim.sim.net.flooding import Flooding
from netsim.sim.net.forwarding import Forwarder
from netsim.sim.net.link_port import Done, Draw, LinkPort, WaitingRoom
from netsim.sim.net.outgoing import Outgoing
from netsim.sim.net.packet import (
    HEADER_BYTE,
    MAX_FRAGMENTS,
    Form,
    Packet,
    decode_ids,
    encode_ids,
    fragments,
)
from netsim.sim.net.reassembly import Reassembly, Recent, SequenceNumbers
from netsim.sim.net.regions import Point, contains, decode_region, encode_region, region_byte
from netsim.sim.net.router import Router
from netsim.sim.net.settings import NetworkSettings
from netsim.trace.events import BROADCAST
from netsim.trace.recorder import Recorder
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


class Network:
    """Sends messages as packets over one or more hops and hands up those that arrive whole, each once.

    Args:
        clock: Simulated time.
        node: This node's id.
        router: Next hops.
        book: Message numbers for the trace.
        recorder: Where message events go.
        packet_byte: Largest packet the MAC takes, header included.
        deliver: Called with each whole message for this node.
        settings: Time-outs and limits.
        draw: The node's random numbers by name.
        surroundings: What it knows of its neighbours.
        by_position: Next hops towards a region.
        position_m: Where the node believes it is.
        sink: Where a message to a sink goes now; None without sinks. A sink names itself.

    Attributes:
        filter: Rules for received packets, for faults and tests; None lets all pass as they are.
        port: The way to the MAC, for services.
        services: Takers of control packets by form.
    """

    def __init__(
        self,
        clock: Clock,
        node: int,
        router: Router,
        book: MessageBook,
        recorder: Recorder,
        packet_byte: int,
        deliver: Callable[[Message], None],
        *,
        settings: NetworkSettings | None = None,
        draw: Draw = lambda name: 0.0,
        surroundings: Surroundings | None = None,
        by_position: Router | None = None,
        position_m: Callable[[], Point] = lambda: (0.0, 0.0),
        sink: Callable[[], int | None] = lambda: None,
    ) -> None:
        settings = settings or NetworkSettings()
        self._clock = clock
        self._node = node
        self._router = router
        self._book = book
        self._packet_byte = packet_byte
        self._deliver = deliver
        self._hop_limit = settings.hop_limit
        self._surroundings = surroundings or Given()
        self._by_position = by_position
        self._position_m = position_m
        self._sink = sink
        self.filter: Filter | None = None
        self.services: Mapping[int, Service] = {}
        self._reporter = Reporter(node, book, recorder)
        self.port = LinkPort(node, self._reporter)
        self._make_parts(settings, draw)
        self._life = 0
        self._delayed = 0

    def _make_parts(self, settings: NetworkSettings, draw: Draw) -> None:
        memory_ns = s_to_ns(settings.memory_s)
        self._sequence = SequenceNumbers(memory_ns)
        self._room = WaitingRoom(self._clock, draw, settings.waiting_packets)
        self._forwarded = Recent(memory_ns)
        self._forwarder = Forwarder(
            self.port, self._room, settings.retries, s_to_ns(settings.retry_delay_s), self._surroundings.on_sent
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
        self._reassembly = Reassembly(self._clock, timeout_ns, most, memory_ns, self._dropped)

    def attach(self, mac: Mac) -> None:
        """Connect the MAC below."""
        self.port.attach(mac)

    @property
    def discovered(self) -> Sequence[Neighbour] | None:
        """Neighbours found so far; None where they were given."""
        return self._surroundings.discovered

    @property
    def pending(self) -> int:
        """Packets of messages that wait in this layer; beacons and routes do not count."""
        return self._room.waiting + self._delayed

    def start(self) -> None:
        """The node begins to live, or lives again after `stop`."""
        for service in self.services.values():
            service.start()

    def stop(self) -> None:
        """The node died or lost its memory: forget everything but the count of messages."""
        self._life += 1
        self._delayed = 0
        for service in self.services.values():
            service.stop()
        self._room.clear()
        self._reassembly.clear()
        self._forwarded.clear()

    # --- down ---------------------------------------------------------------------------------------------------------

    def send(self, destination: int, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Send to one node, or to all in reach; `done` is called when this node has finished with all fragments.

        Returns:
            The message's number in the trace.

        Raises:
            AlgorithmError: If the payload needs more than 16,383 fragments.
        """
        reserve_byte = 0 if destination == BROADCAST else self._router.fields_byte
        return self._originate(Form.DATA, destination, b"", reserve_byte, kind, payload, causes, done)

    def is_direct(self, destination: int) -> bool:
        """Whether a message to this node would go straight to it."""
        return self._router.is_direct(destination)

    def multicast(
        self, destinations: Sequence[int], kind: str, payload: bytes, causes: Sequence[int], done: Done
    ) -> int:
        """Send once to several neighbours; not acknowledged."""
        fields = encode_ids(sorted(destinations))
        return self._originate(Form.MULTICAST, BROADCAST, fields, 0, kind, payload, causes, done)

    def flood(self, hop_limit: int, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Send to every node within so many hops."""
        return self._originate(Form.FLOOD, BROADCAST, bytes([hop_limit]), 0, kind, payload, causes, done)

    def geocast(self, region: Region, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Send to every node in a region: by position until one of its nodes is reached, then flooded inside."""
        fields = encode_region(region)
        form = Form.GEOCAST if contains(decode_region(fields), self._position_m()) else Form.GEOCAST_WAY
        reserve_byte = 0 if self._by_position is None else self._by_position.fields_byte
        return self._originate(form, BROADCAST, fields, reserve_byte, kind, payload, causes, done)

    def send_to_sink(self, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Send to a sink: the one the collection tree leads to, elsewhere the nearest.

        Raises:
            AlgorithmError: If there is no sink, or this node is one.
        """
        sink = self._sink()
        if sink is None:
            message = "there is no sink to send to: give a group of nodes `role: sink`"
            raise AlgorithmError(message)
        if sink == self._node:
            message = f"a sink sent a {kind!r} message to the sink: it is there already"
            raise AlgorithmError(message)
        return self.send(sink, kind, payload, causes, done)

    def _originate(
        self,
        form: Form,
        destination: int,
        fields: bytes,
        reserve_byte: int,
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Done,
    ) -> int:
        chunks = self._cut(payload, self._packet_byte - HEADER_BYTE - len(fields) - reserve_byte)
        code = self._book.kinds.code(kind)
        now_ns = self._clock.now_ns
        origin = self._book.number(kind, now_ns)
        self._reporter.sent(origin, destination, len(payload), len(chunks), causes)
        sequence = self._sequence.next(now_ns)
        packets = [
            Packet(self._node, destination, sequence or 0, code, 1, index, len(chunks), chunk, form, fields)
            for index, chunk in enumerate(chunks)
        ]
        if sequence is None:
            self._reporter.dropped(packets[0], origin, "no_sequence")
            done(Delivery(acknowledged=False, reason="no_sequence", attempts=0))
        else:
            self._book.origins[self._node, sequence] = origin
            Outgoing(packets, lambda packet, sent: self._launch(packet, origin, sent), done).proceed()
        return origin.message_id

    @staticmethod
    def _cut(payload: bytes, chunk_byte: int) -> list[bytes]:
        if chunk_byte < 1:
            message = f"the radio's frames are {1 - chunk_byte} bytes too short for the header of such a message"
            raise AlgorithmError(message)
        chunks = list(fragments(payload, chunk_byte))
        if len(chunks) > MAX_FRAGMENTS:
            message = f"a payload of {len(payload)} bytes needs {len(chunks)} fragments, more than {MAX_FRAGMENTS}"
            raise AlgorithmError(message)
        return chunks

    def _launch(self, packet: Packet, origin: Origin, sent: Done) -> None:
        if packet.form in SPREAD:
            self._flooding.begin(packet, self._clock.now_ns)
        self._pass_on(packet, None, origin, sent)

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
        if packet is None or self._book.kinds.name(packet.kind_code) is None:
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
        if packet.form == Form.COLLECT and self._sink() == self._node:
            return True
        return packet.destination == self._node or (packet.form == Form.DATA and packet.destination == BROADCAST)

    def _is_inside(self, fields: bytes) -> bool:
        return contains(decode_region(fields), self._position_m())

    def _spread(self, packet: Packet) -> None:
        """A flooded packet: deliver and pass on, in a geocast only inside the region."""
        if packet.form == Form.GEOCAST and not self._is_inside(packet.fields):
            return
        if self._flooding.take(packet, self._clock.now_ns):
            self._collect(packet)

    def _relay(self, packet: Packet, neighbour: int) -> None:
        if packet.hops >= self._hop_limit:
            self._dropped(packet, "hop_limit")
        elif self._forwarded.add((packet.hops, *packet.key), self._clock.now_ns):
            self._pass_on(replace(packet, hops=packet.hops + 1), neighbour)

    def _pass_on(
        self, packet: Packet, previous: int | None, origin: Origin | None = None, done: Done = lambda delivery: None
    ) -> None:
        """Send a packet to all neighbours, or to the next hop of its way."""
        known = origin or self._book.find(packet, self._clock.now_ns)

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
        origin = self._book.find(packet, now_ns)
        kind = self._book.kinds.name(packet.kind_code) or ""
        self._reporter.delivered(packet, kind, len(payload), origin, now_ns)
        to = self._node if packet.form == Form.MULTICAST else packet.destination
        self._deliver(Message(origin.message_id, packet.origin, to, kind, payload, now_ns, packet.hops))

    def _dropped(self, packet: Packet, reason: str) -> None:
        self._reporter.dropped(packet, self._book.find(packet, self._clock.now_ns), reason)
