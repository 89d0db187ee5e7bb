"""The network layer of one node: fragmentation, forwarding, reassembly."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from netsim.api import Delivery, Message
from netsim.errors import AlgorithmError
from netsim.sim.clock import Clock
from netsim.sim.mac.link import LinkJob, Submits
from netsim.sim.net.packet import HEADER_BYTE, KindTable, Packet, fragments
from netsim.sim.net.routes import Routes
from netsim.trace.events import BROADCAST, MessageDelivered, MessageDropped, MessageSent
from netsim.trace.recorder import Recorder

REASSEMBLY_TIMEOUT_NS = 30_000_000_000
MAX_HOPS = 255
MAX_FRAGMENTS = 0xFFFF


@dataclass(slots=True)
class Origin:
    """What the trace knows of a message besides its bytes: its number there, and when it was sent."""

    message_id: int
    kind: str
    sent_ns: int


@dataclass(slots=True)
class MessageBook:
    """Names of messages for the trace, kept apart from the packets: no node reads it to decide anything."""

    kinds: KindTable = field(default_factory=KindTable)
    origins: dict[tuple[int, int], Origin] = field(default_factory=dict)
    sent: int = 0

    def register(self, origin: int, sequence: int, kind: str, now_ns: int) -> Origin:
        """Number a new message."""
        self.sent += 1
        entry = self.origins[origin, sequence] = Origin(self.sent, kind, now_ns)
        return entry


@dataclass(slots=True)
class Assembly:
    """A message whose fragments are coming in."""

    chunks: dict[int, bytes]
    begun_ns: int


class Outgoing:
    """Sends a message's fragments one after the other and sums up what became of them.

    The next fragment enters the MAC's queue when the one before has left it: a long message does not fill the queue, and
    after a fragment is lost the rest is not sent, for without it the message cannot be whole.
    """

    def __init__(
        self,
        packets: Sequence[Packet],
        submit: Callable[[Packet, Callable[[Delivery], None]], None],
        done: Callable[[Delivery], None],
    ) -> None:
        self._packets = packets
        self._submit = submit
        self._done = done
        self._next = 0
        self._attempts = 0

    def proceed(self) -> None:
        """Send the next fragment."""
        packet = self._packets[self._next]
        self._next += 1
        self._submit(packet, self._fragment_done)

    def _fragment_done(self, delivery: Delivery) -> None:
        self._attempts += delivery.attempts
        if delivery.acknowledged and self._next < len(self._packets):
            self.proceed()
        else:
            self._done(Delivery(delivery.acknowledged, delivery.reason, self._attempts))


class Network:
    """Sends messages as packets over one or more hops and hands up those that arrive whole.

    Args:
        clock: Simulated time.
        node: This node's id.
        routes: Next hops.
        book: Message numbers for the trace.
        recorder: Where message events go.
        packet_byte: Largest packet the MAC takes, header included.
        deliver: Called with each whole message for this node.
    """

    def __init__(
        self,
        clock: Clock,
        node: int,
        routes: Routes,
        book: MessageBook,
        recorder: Recorder,
        packet_byte: int,
        deliver: Callable[[Message], None],
    ) -> None:
        self._clock = clock
        self._node = node
        self._routes = routes
        self._book = book
        self._recorder = recorder
        self._chunk_byte = packet_byte - HEADER_BYTE
        self._deliver = deliver
        self._mac: Submits | None = None
        self.filter: Callable[[bytes, int], Sequence[tuple[int, bytes]]] | None = None
        self._life = 0
        self._sequence = 0
        self._assemblies: dict[tuple[int, int], Assembly] = {}

    def give_up(self, reason: str) -> None:
        """See `NetworkLayer.give_up`: what has come in parts will not be whole."""
        for key in list(self._assemblies):
            self._give_up(key, reason)

    def start(self) -> None:
        """See `NetworkLayer.start`. The sequence number goes on after a crash: no message is taken for another."""

    def stop(self) -> None:
        """See `NetworkLayer.stop`."""
        self._life += 1
        self._assemblies.clear()

    def attach(self, mac: Submits) -> None:
        """Connect the MAC below."""
        self._mac = mac

    def send(
        self,
        destination: int,
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Callable[[Delivery], None],
    ) -> int:
        """Send a message; `done` is called when this node's MAC has finished with all its fragments.

        Returns:
            The message's number in the trace.

        Raises:
            AlgorithmError: If the payload needs more than 65,535 fragments.
        """
        chunks = list(fragments(payload, self._chunk_byte))
        if len(chunks) > MAX_FRAGMENTS:
            message = f"a payload of {len(payload)} bytes needs {len(chunks)} fragments, more than {MAX_FRAGMENTS}"
            raise AlgorithmError(message)
        self._sequence = (self._sequence + 1) % 0x10000
        origin = self._book.register(self._node, self._sequence, kind, self._clock.now_ns)
        self._recorder.record(
            MessageSent(origin.message_id, self._node, destination, kind, len(payload), len(chunks), causes)
        )
        code = self._book.kinds.code(kind)
        packets = [
            Packet(self._node, destination, self._sequence, code, 1, index, len(chunks), chunk)
            for index, chunk in enumerate(chunks)
        ]
        Outgoing(packets, lambda packet, sent: self._forward(packet, origin, sent), done).proceed()
        return origin.message_id

    def on_packet(self, data: bytes, neighbour: int) -> None:
        """A packet arrived from a neighbour; rules about packets come first."""
        for delay_ns, copy in [(0, data)] if self.filter is None else self.filter(data, neighbour):
            if delay_ns <= 0:
                self._receive(copy)
            else:
                self._receive_later(delay_ns, copy)

    def _receive_later(self, delay_ns: int, data: bytes) -> None:
        life = self._life
        self._clock.call_after(delay_ns, lambda _: self._receive(data) if self._life == life else None)

    def _receive(self, data: bytes) -> None:
        """A packet for this node, or to be passed on."""
        packet = Packet.decode(data)
        origin = self._book.origins[packet.origin, packet.sequence]
        if packet.destination in (self._node, BROADCAST):
            self._collect(packet, origin)
        elif packet.hops < MAX_HOPS:
            onward = Packet(
                packet.origin,
                packet.destination,
                packet.sequence,
                packet.kind_code,
                packet.hops + 1,
                packet.index,
                packet.count,
                packet.chunk,
            )
            self._forward(onward, origin, lambda delivery: None)
        else:
            self._dropped(packet, origin, "hop_limit")

    def _forward(self, packet: Packet, origin: Origin, done: Callable[[Delivery], None]) -> None:
        hop = BROADCAST if packet.destination == BROADCAST else self._routes.next_hop(self._node, packet.destination)

        def finished(delivery: Delivery) -> None:
            if not delivery.acknowledged:
                self._dropped(packet, origin, delivery.reason)
            done(delivery)

        if hop is None or self._mac is None:
            finished(Delivery(acknowledged=False, reason="no_route", attempts=0))
        else:
            self._mac.submit(LinkJob(hop, packet.encode(), origin.kind, origin.message_id, finished))

    def _collect(self, packet: Packet, origin: Origin) -> None:
        """Reassemble; a message is handed up once, when its last missing fragment has come."""
        key = (packet.origin, packet.sequence)
        now_ns = self._clock.now_ns
        self._expire(now_ns)
        assembly = self._assemblies.setdefault(key, Assembly({}, now_ns))
        assembly.chunks[packet.index] = packet.chunk
        if len(assembly.chunks) < packet.count:
            return
        del self._assemblies[key]
        payload = b"".join(assembly.chunks[index] for index in range(packet.count))
        kind = self._book.kinds.name(packet.kind_code)
        self._recorder.record(
            MessageDelivered(
                origin.message_id,
                packet.origin,
                self._node,
                kind,
                len(payload),
                packet.hops,
                now_ns - origin.sent_ns,
            )
        )
        self._deliver(Message(origin.message_id, packet.origin, packet.destination, kind, payload, now_ns, packet.hops))

    def _expire(self, now_ns: int) -> None:
        """Give up messages whose fragments have stopped coming; looked at when a packet arrives."""
        for key, assembly in list(self._assemblies.items()):
            if now_ns - assembly.begun_ns > REASSEMBLY_TIMEOUT_NS:
                self._give_up(key, "reassembly_timeout")

    def _give_up(self, key: tuple[int, int], reason: str) -> None:
        """What has come of a message is of no use any more."""
        del self._assemblies[key]
        origin = self._book.origins[key]
        self._recorder.record(MessageDropped(origin.message_id, key[0], self._node, self._node, origin.kind, reason))

    def _dropped(self, packet: Packet, origin: Origin, reason: str) -> None:
        self._recorder.record(
            MessageDropped(origin.message_id, packet.origin, packet.destination, self._node, origin.kind, reason)
        )
