"""Messages: each is sent once, then travels in frames, then arrives at a node at most once, whole and as it was sent.

Kept of each message, so that a trace of any length is checked in little memory: 22 bytes (when, whence, whither, how long,
of which kind), and two bits a node (a frame of it came in; it was delivered).
"""

from array import array
from collections.abc import Mapping, Sequence

from netsim.audit.columns import Marks, plain
from netsim.audit.rule import GARBLED, End, Run
from netsim.audit.tally import Tally
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    Event,
    Frame,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    NodeTable,
)
from netsim.trace.recorder import Handler

_MOST_SKIPPED = 1_000_000
_RECEIVED = OUTCOME_CODE["received"]


class _Book:
    """What was sent, by number; message 0 is what nobody sent."""

    def __init__(self) -> None:
        self.sent_ns = array("q", [0])
        self.source, self.destination, self.size_byte = array("I", [0]), array("I", [0]), array("I", [0])
        self.kind = array("H", [0])
        self._kinds = {"": 0}
        self._names = [""]

    @property
    def count(self) -> int:
        """Numbers below this are known."""
        return len(self.sent_ns)

    def add(self, event: MessageSent, now_ns: int) -> None:
        """One more message."""
        self.sent_ns.append(now_ns)
        self.source.append(event.source)
        self.destination.append(event.destination)
        self.size_byte.append(event.size_byte)
        code = self._kinds.setdefault(event.kind, len(self._names))
        if code == len(self._names):
            self._names.append(event.kind)
        self.kind.append(code)

    def kind_of(self, number: int) -> str:
        """The kind of a message."""
        return self._names[self.kind[number]]


class Messages:
    """Numbered 1, 2, 3, ... as they are sent; whatever is said of one afterwards agrees with what was sent."""

    def __init__(self, run: Run) -> None:
        self._sent = Tally("messages are numbered", "messages sent")
        self._causes = Tally("causes were received", "causes")
        self._delivered = Tally("delivered as sent", "deliveries")
        self._once = Tally("delivered once", "deliveries")
        self._arrived = Tally("delivered by frames", "deliveries")
        self._dropped = Tally("dropped as sent", "drops")
        self._frames = Tally("frames carry messages", "frames")
        self._has_rows = run.detail != "summary"
        if not self._has_rows:
            self._arrived.note = "not checked of broadcasts at detail summary, which does not say who received them"
        self._garbles = run.garbles
        if self._garbles:
            for tally in (self._causes, self._delivered, self._once, self._arrived, self._dropped):
                tally.note = GARBLED
        self._book = _Book()
        self._came, self._has = Marks(()), Marks(())
        self._sinks: set[int] = set()

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._sent, self._causes, self._frames, self._arrived, self._delivered, self._once, self._dropped)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        found: dict[type[Event], Handler] = {
            NodeTable: self._introduce,
            NodeLife: self._live,
            MessageSent: self._send,
            Frame: self._carry,
        }
        return found if self._garbles else {**found, MessageDelivered: self._deliver, MessageDropped: self._drop}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _introduce(self, event: NodeTable, _: int) -> None:
        nodes = plain(event.node)
        self._came, self._has = Marks(nodes), Marks(nodes)
        self._sinks = {node for node, role in zip(nodes, event.role, strict=False) if role == "sink"}

    def _live(self, event: NodeLife, _: int) -> None:
        """A node that goes down forgets what it has received: after a reboot a message may come again."""
        if event.event in ("crashed", "died"):
            self._has.clear(event.node)

    def _send(self, event: MessageSent, now_ns: int) -> None:
        book, number = self._book, event.message_id
        self._sent.looked += 1
        if number != book.count:
            self._sent.found(f"expected message {book.count}, got {number}", now_ns, event.source)
        if not self._garbles:
            self._check_causes(event, now_ns)
        if (
            book.count <= number < book.count + _MOST_SKIPPED
        ):  # else it has been sent already, or its number is nonsense
            while book.count < number:
                book.add(MessageSent(book.count, 0, 0, "", 0, 0, []), now_ns)
            book.add(event, now_ns)
            self._came.grow(book.count)
            self._has.grow(book.count)

    def _check_causes(self, event: MessageSent, now_ns: int) -> None:
        causes = plain(event.causes)
        self._causes.looked += len(causes)
        for cause in causes:
            if cause and not self._has.has(cause, event.source):
                what = (
                    f"message {event.message_id} names as its cause message {cause}, which its sender has not received"
                )
                self._causes.found(what, now_ns, event.source)

    def _carry(self, event: Frame, now_ns: int) -> None:
        number = event.message_id
        if not number:
            return  # control traffic
        self._frames.looked += 1
        if number >= self._book.count:
            self._frames.found(
                f"frame {event.frame_id} carries message {number}, which was not sent", now_ns, event.source
            )
            return
        if self._book.sent_ns[number] > event.t_start_ns:
            self._frames.found(
                f"frame {event.frame_id} carries message {number} before it was sent", now_ns, event.source
            )
        if self._book.kind_of(number) != event.kind:
            what = (
                f"frame {event.frame_id} carries message {number} as `{event.kind}`, not `{self._book.kind_of(number)}`"
            )
            self._frames.found(what, now_ns, event.source)
        if not event.is_ack and not event.is_strobe:
            for node, outcome in zip(plain(event.rx_node), plain(event.rx_outcome), strict=False):
                if outcome == _RECEIVED:
                    self._came.mark(number, node)

    def _deliver(self, event: MessageDelivered, now_ns: int) -> None:
        number, node = event.message_id, event.node
        if not number:
            return  # nobody knows which message that was
        for tally in (self._delivered, self._once):
            tally.looked += 1
        what = self._unlike(event, now_ns)
        if what:
            self._delivered.found(f"message {number}: {what}", now_ns, node)
        if self._has.mark(number, node):
            self._once.found(f"message {number} was delivered to the node before", now_ns, node)
        is_broadcast = number < self._book.count and self._book.destination[number] == BROADCAST
        if self._has_rows or not is_broadcast:
            self._arrived.looked += 1
            if not self._came.has(number, node):
                self._arrived.found(f"message {number}: the node has received no frame of it", now_ns, node)

    def _unlike(self, event: MessageDelivered, now_ns: int) -> str:
        """In what a delivery differs from what was sent; empty for nothing."""
        book, number = self._book, event.message_id
        if number >= book.count:
            return "it was not sent"
        told = (event.source, event.kind, event.size_byte, event.latency_ns)
        known = (
            book.source[number],
            book.kind_of(number),
            book.size_byte[number],
            now_ns - book.sent_ns[number],
        )
        if told != known:
            return f"expected source, kind, bytes, latency in ns {known}, got {told}"
        destination = book.destination[number]
        if event.node not in (destination, *self._sinks) and destination != BROADCAST:
            return f"it was sent to node {destination}"
        return ""

    def _drop(self, event: MessageDropped, now_ns: int) -> None:
        number, book = event.message_id, self._book
        if not number:
            return
        self._dropped.looked += 1
        if number >= book.count:
            self._dropped.found(f"message {number} was dropped, but not sent", now_ns, event.node)
        elif (event.source, event.kind) != (book.source[number], book.kind_of(number)):
            what = f"message {number}: expected source and kind {(book.source[number], book.kind_of(number))}, got "
            self._dropped.found(f"{what}{(event.source, event.kind)}", now_ns, event.node)
