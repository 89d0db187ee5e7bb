"""What the trace knows of messages besides their bytes; no node reads it to decide anything."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from netsim.sim.net.packet import KindTable, Packet
from netsim.trace.events import MessageDelivered, MessageDropped, MessageSent
from netsim.trace.recorder import Recorder


@dataclass(slots=True)
class Origin:
    """A message: its number in the trace, its kind, and when it was sent. Number 0 is a message nobody knows of."""

    message_id: int
    kind: str
    sent_ns: int


@dataclass(slots=True)
class MessageBook:
    """Names of the messages of one run.

    An entry is replaced when its origin's sequence numbers have come round. A packet with a broken header may find no
    entry, or another message's: then the trace is wrong about it, and nothing else.
    """

    kinds: KindTable = field(default_factory=KindTable)
    origins: dict[tuple[int, int], Origin] = field(default_factory=dict)
    sent: int = 0

    def number(self, kind: str, now_ns: int) -> Origin:
        """Number a new message."""
        self.sent += 1
        return Origin(self.sent, kind, now_ns)

    def find(self, packet: Packet, now_ns: int) -> Origin:
        """The message a packet belongs to."""
        known = self.origins.get((packet.origin, packet.sequence))
        return known or Origin(0, self.kinds.name(packet.kind_code) or "", now_ns)


class Reporter:
    """Records what becomes of messages at one node.

    Args:
        node: Its id.
        book: Names of messages.
        recorder: Where the events go.
    """

    def __init__(self, node: int, book: MessageBook, recorder: Recorder) -> None:
        self._node = node
        self._book = book
        self._recorder = recorder

    def sent(self, origin: Origin, destination: int, size_byte: int, count: int, causes: Sequence[int]) -> None:
        """An algorithm handed over a message."""
        self._recorder.record(
            MessageSent(origin.message_id, self._node, destination, origin.kind, size_byte, count, causes)
        )

    def delivered(self, packet: Packet, kind: str, size_byte: int, origin: Origin, now_ns: int) -> None:
        """A message came whole; `packet` is its last fragment."""
        latency_ns = now_ns - origin.sent_ns
        number = origin.message_id
        self._recorder.record(
            MessageDelivered(number, packet.origin, self._node, kind, size_byte, packet.hops, latency_ns)
        )

    def dropped(self, packet: Packet, origin: Origin, reason: str) -> None:
        """A message, or a fragment of it, was given up."""
        self._recorder.record(
            MessageDropped(origin.message_id, packet.origin, packet.destination, self._node, origin.kind, reason)
        )

    def frame_dropped(self, source: int, destination: int, kind: str, reason: str) -> None:
        """A frame was given up that belongs to no message: control traffic, or bytes that make no sense."""
        self._recorder.record(MessageDropped(0, source, destination, self._node, kind, reason))
