"""The way down: from an algorithm's message to packets that are launched one after the other."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from netsim.api import Delivery, Region
from netsim.errors import AlgorithmError
from netsim.sim.net.book import Origin, Reporter
from netsim.sim.net.context import NetContext
from netsim.sim.net.link_port import Done
from netsim.sim.net.outgoing import Outgoing
from netsim.sim.net.packet import HEADER_BYTE, MAX_FRAGMENTS, Form, Packet, encode_ids, fragments
from netsim.sim.net.reassembly import SequenceNumbers
from netsim.sim.net.regions import contains, decode_region, encode_region
from netsim.sim.net.router import Router
from netsim.trace.events import BROADCAST
from netsim.units import s_to_ns


class Sending(ABC):
    """What a network layer offers to the algorithm above it.

    Args:
        context: The node.
        router: Next hops.
        by_position: Next hops towards a region; None where nobody knows positions.
    """

    def __init__(self, context: NetContext, router: Router, by_position: Router | None) -> None:
        self._context = context
        self._router = router
        self._by_position = by_position
        self._sequence = SequenceNumbers(s_to_ns(context.settings.memory_s))
        self._reporter = Reporter(context.node, context.book, context.recorder)

    @abstractmethod
    def _launch(self, packet: Packet, origin: Origin, done: Done) -> None:
        """Send a packet on its way; `done` is called once with what became of it here."""

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
        is_inside = contains(decode_region(fields), self._context.position_m())
        form = Form.GEOCAST if is_inside else Form.GEOCAST_WAY
        # only what is on its way to the region carries the fields of routing by position
        reserve_byte = 0 if is_inside or self._by_position is None else self._by_position.fields_byte
        return self._originate(form, BROADCAST, fields, reserve_byte, kind, payload, causes, done)

    def send_to_sink(self, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Send to a sink: the one the collection tree leads to, elsewhere the nearest.

        Raises:
            AlgorithmError: If there is no sink, or this node is one.
        """
        sink = self._context.sink()
        if sink is None:
            message = "there is no sink to send to: give a group of nodes `role: sink`"
            raise AlgorithmError(message)
        if sink == self._context.node:
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
        chunks = self._cut(payload, self._context.packet_byte - HEADER_BYTE - len(fields) - reserve_byte)
        code = self._context.book.kinds.code(kind)
        now_ns = self._context.clock.now_ns
        origin = self._context.book.number(kind, now_ns)
        self._reporter.sent(origin, destination, len(payload), len(chunks), causes)
        sequence = self._sequence.next(now_ns)
        packets = [
            Packet(self._context.node, destination, sequence or 0, code, 1, index, len(chunks), chunk, form, fields)
            for index, chunk in enumerate(chunks)
        ]
        if sequence is None:
            self._reporter.dropped(packets[0], origin, "no_sequence")
            done(Delivery(acknowledged=False, reason="no_sequence", attempts=0))
        else:
            self._context.book.origins[self._context.node, sequence] = origin
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
