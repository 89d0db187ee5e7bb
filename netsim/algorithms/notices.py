"""Notices: in every round each node tells each partner, by one bit an edge, whether a new message comes.

Chen et al. 2006, end of section 5: a kept message and a lost one look the same to the receiver unless one extra bit tells
them apart. Here the bits of all edges between two nodes travel in one message with the new messages themselves. Who hears
nothing from a partner in a round knows that something was lost, and asks for all that came since it last knew. The
answer holds the last message of every edge on which one was sent since then, so that what was lost in several rounds is
made good at once.
"""

from collections.abc import Collection, Iterable, Sequence
from math import ceil

from netsim.algorithms.entries import EdgeMessage, decode_entries, encode_entries
from netsim.algorithms.hosted import Hosted
from netsim.algorithms.message_passing_parameters import MessagePassingParameters
from netsim.api import Message, NodeHandle, Op
from netsim.codec import Precision, Record
from netsim.kernels.semiring import FloatArray
from netsim.trace.events import AlgorithmRecord

BELIEF = "belief"
NOTICE = "notice"
"""Kind of a notice with which no message comes; with messages it is a `belief`."""
REQUEST = "request"
_HEAD = Record("HHH")  # round, first round of which it tells, number of edges
_FIRST = Record("H")


def encode_notice(
    number: int, first: int, edges: Sequence[tuple[int, int]], entries: Iterable[EdgeMessage], width: Precision
) -> bytes:
    """Bits and messages for one node as one payload.

    Args:
        number: The round.
        first: The round from which on it tells what was sent: the same, or an earlier one in answer to a request.
        edges: (Source vertex, destination vertex) of every edge to that node, ascending.
        entries: The new messages, each of one of these edges.
        width: Precision on the air.
    """
    known = {(source, destination): message for source, destination, message in entries}
    bits = sum(1 << position for position, edge in enumerate(edges) if edge in known)
    told = [(*edge, known[edge]) for edge in edges if edge in known]
    head = _HEAD.pack(number, first, len(edges)) + bits.to_bytes(ceil(len(edges) / 8), "little")
    return head + encode_entries(number, told, width)


def decode_notice(
    payload: bytes, width: Precision
) -> tuple[int, int, list[bool], list[tuple[int, int, int, FloatArray]]]:
    """The round, the first round told of, each edge's bit, and the entries of a payload of `encode_notice`."""
    number, first, edges = _HEAD.unpack(payload, 0)
    begin = _HEAD.size_byte + ceil(edges / 8)
    field = int.from_bytes(payload[_HEAD.size_byte : begin], "little")
    return number, first, [bool(field >> each & 1) for each in range(edges)], decode_entries(payload[begin:], width)


class Notices:
    """A node's side of the notices.

    Args:
        node: The node.
        hosted: What it hosts.
        parameters: Of the algorithm.
    """

    def __init__(self, node: NodeHandle, hosted: Hosted, parameters: MessagePassingParameters) -> None:
        self._node = node
        self._hosted = hosted
        self._parameters = parameters
        self._round = -1  # of the last notice given
        self._complete: dict[int, int] = {}  # by partner the round up to which all it sent is known
        self._missed = self._asked = self._answered = 0

    def payload(self, number: int, host: int, entries: Iterable[EdgeMessage]) -> bytes:
        """What a round's notice for a node holds."""
        self._round = number
        return self._encoded(number, host, entries)

    def _encoded(self, first: int, host: int, entries: Iterable[EdgeMessage]) -> bytes:
        return encode_notice(self._round, first, self._hosted.edges_to(host), entries, self._parameters.payload)

    def read(self, message: Message) -> list[tuple[int, int, int, FloatArray]]:
        """The entries of a notice; what the partner sent up to its round is known now, unless rounds before were missed."""
        number, first, _, entries = decode_notice(message.payload, self._parameters.payload)
        known = self._complete.get(message.source, -1)
        if first <= known + 1:
            self._complete[message.source] = max(known, number)
        return entries

    def missing(self, number: int) -> list[int]:
        """Partners of which not all is known that they sent up to a round."""
        return [partner for partner in self._hosted.partners if self._complete.get(partner, -1) < number]

    def ask(self, number: int, left_out: Collection[int]) -> None:
        """Ask those that were not heard, but for those believed dead."""
        for partner in sorted(set(self.missing(number)) - set(left_out)):
            self._asked += 1
            self._node.send(partner, REQUEST, _FIRST.pack(self._complete.get(partner, -1) + 1), causes=())

    def close(self, number: int) -> list[int]:
        """A round is over: count what was missed in it. Returns the partners that were."""
        missing = self.missing(number)
        self._missed += len(missing)
        if self._parameters.asks == 0:
            self._complete.update(dict.fromkeys(missing, number))
        return missing

    def serve(self) -> Op[None]:
        """Answer requests, for ever."""
        while True:
            message = yield from self._node.receive(kinds={REQUEST})
            if message is not None and message.source in self._hosted.partners:
                self._answer(message)

    def _answer(self, message: Message) -> None:
        (first,) = _FIRST.unpack(message.payload, 0)
        if first > self._round:
            return  # this node's notice is still to come
        sent, host = self._hosted.sent, message.source
        edges = [edge for edge in self._hosted.edges_to(host) if edge in sent and sent[edge][0] >= first]
        payload = self._encoded(first, host, [(*edge, sent[edge][1]) for edge in edges])
        self._answered += 1
        self._node.send(host, BELIEF if edges else NOTICE, payload, causes=[message])

    def report(self) -> None:
        """Record what was missed, asked for and sent again."""
        fields = f'{{"missed": {self._missed}, "asked": {self._asked}, "answered": {self._answered}}}'
        self._node.record(AlgorithmRecord(self._node.id, "notices", fields))
