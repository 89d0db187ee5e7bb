"""Everyone's report to all within so many hops of a given graph, round by round, with a barrier after each.

In round r a node tells its partners the reports it got in round r - 1, its own in the first; so after h rounds it holds
those of all nodes within h hops. It begins a round when every partner's bundle of the round before has come (a synchroniser,
Awerbuch 1985): whatever the delays, nobody goes on too early. A partner that stays silent for a whole round is given up; who
missed a bundle asks for it again, and every bundle sent is kept for that.

A bundle has the round (1 byte) and for each report its node (2 bytes), length (2 bytes) and bytes.
"""

import struct
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from netsim.api import Message, NodeHandle, Op
from netsim.codec import Record
from netsim.errors import AlgorithmError

REQUEST = "-request"
"""What the kind of a request adds to the kind of the bundle asked for."""
_ROUND = Record("B")
_REPORT = Record("HH")
_LONGEST = 65_535

Reports = Mapping[int, bytes]


def encode_bundle(number: int, reports: Reports) -> bytes:
    """A bundle as it goes over the air."""
    parts = [_ROUND.pack(number)]
    for node, report in sorted(reports.items()):
        parts += [_REPORT.pack(node, len(report)), report]
    return b"".join(parts)


def decode_bundle(data: bytes) -> tuple[int, dict[int, bytes]]:
    """The inverse of `encode_bundle`: the round and its reports.

    Raises:
        ValueError: If it is cut short.
        struct.error: If it is cut short.
    """
    (number,), offset, reports = _ROUND.unpack(data), _ROUND.size_byte, {}
    while offset < len(data):
        node, length = _REPORT.unpack(data, offset)
        offset += _REPORT.size_byte
        if offset + length > len(data):
            message = f"a report of {length} bytes, of which {len(data) - offset} are there"
            raise ValueError(message)
        reports[node] = data[offset : offset + length]
        offset += length
    return number, reports


@dataclass(frozen=True, slots=True)
class FloodSettings:
    """How a flood goes.

    Attributes:
        hops: How far, at most 255.
        round_ns: How long a partner is waited for in one round, besides a spread for each round so far.
        attempts: How often a missing bundle is asked for in that time.
        spread_ns: Each bundle is sent at a random moment of so much time after it could be, so that nodes do not all speak
            at once: a barrier ends for all of them together.
    """

    hops: int
    round_ns: int
    attempts: int = 3
    spread_ns: int = 0


@dataclass(slots=True)
class Flooded:
    """What a flood brought.

    Attributes:
        reports: By node, the own one included if there is one.
        passed_on: Reports sent, in all bundles, the own one included; a bundle sent again on request does not count.
        given_up: Partners that were silent for a whole round.
    """

    reports: dict[int, bytes]
    passed_on: int = 0
    given_up: set[int] = field(default_factory=set)


class FloodRounds:
    """One node's part of a flood.

    Args:
        node: The node.
        kind: Kind of the bundles.
        partners: The node's neighbours in the graph; theirs must name it too.
        settings: How it goes.
    """

    def __init__(self, node: NodeHandle, kind: str, partners: Collection[int], settings: FloodSettings) -> None:
        self._node, self._kind, self._settings = node, kind, settings
        self._partners = tuple(sorted(partners))
        self._sent: dict[int, bytes] = {}
        self._rounds_of: dict[int, set[int]] = {partner: set() for partner in self._partners}
        self._heard_in: dict[int, int] = {}
        """Least round of the bundles in which each report came that is not passed on yet."""

    def run(self, own: bytes | None) -> Op[Flooded]:
        """Flood, with all rounds; then go on answering those who ask, until the node ends.

        Args:
            own: The node's own report, at most 65,535 bytes; None for a node that has none and passes on those of others.

        Raises:
            AlgorithmError: For a report that is too long.
        """
        if own is not None and len(own) > _LONGEST:
            message = f"a report of {len(own)} bytes: at most {_LONGEST} can be flooded"
            raise AlgorithmError(message)
        node, spread_ns = self._node, self._settings.spread_ns
        flooded = Flooded({} if own is None else {node.id: own})
        self._heard_in = dict.fromkeys(flooded.reports, 0)
        for number in range(1, self._settings.hops + 1):
            if spread_ns:
                yield from node.pause(int(node.rng("flood").random() * spread_ns))
            self._tell(number, flooded)
            yield from self._hear(number, flooded)
        node.spawn(self._serve())
        return flooded

    def _tell(self, number: int, flooded: Flooded) -> None:
        fresh = [source for source, heard_in in self._heard_in.items() if heard_in < number]
        bundle = encode_bundle(number, {source: flooded.reports[source] for source in fresh})
        for source in fresh:
            del self._heard_in[source]
        flooded.passed_on += len(fresh)
        self._sent[number] = bundle
        self._node.multicast(self._partners, self._kind, bundle)

    def _missing(self, number: int, flooded: Flooded) -> list[int]:
        return [p for p in self._partners if number not in self._rounds_of[p] and p not in flooded.given_up]

    def _hear(self, number: int, flooded: Flooded) -> Op[None]:
        """Until every partner's bundle of this round has come, or the round's time is over; ask for what is missing."""
        node, settings = self._node, self._settings
        begin_ns = node.now_ns
        wait_ns = (
            settings.round_ns + number * settings.spread_ns
        )  # others have paused as often, and waited for the dead
        for attempt in range(1, settings.attempts + 2):
            end_ns = begin_ns + attempt * wait_ns // (settings.attempts + 1)
            while self._missing(number, flooded) and node.now_ns < end_ns:
                message = yield from node.receive(
                    kinds={self._kind, self._kind + REQUEST}, timeout_ns=end_ns - node.now_ns
                )
                self._take(message, number, flooded)
            missing = self._missing(number, flooded)
            if not missing:
                return
            if attempt <= settings.attempts:
                node.multicast(missing, self._kind + REQUEST, _ROUND.pack(number), causes=())
        flooded.given_up.update(self._missing(number, flooded))

    def _take(self, message: Message | None, number: int, flooded: Flooded) -> None:
        if message is None or message.source not in self._rounds_of:
            return
        if message.kind != self._kind:
            self._answer(message)
            return
        try:
            told, reports = decode_bundle(message.payload)
        except (ValueError, struct.error) as error:
            self._node.log(f"a bundle of node {message.source} that cannot be read: {error}")
            return
        self._rounds_of[message.source].add(told)
        if told >= number:
            flooded.given_up.discard(message.source)
        for source, report in reports.items():
            if source not in flooded.reports:
                flooded.reports[source] = report
                self._heard_in[source] = told
            elif source in self._heard_in:  # a partner ahead of this node told it first: it waits for its round
                self._heard_in[source] = min(self._heard_in[source], told)

    def _answer(self, request: Message) -> None:
        """With the bundle asked for; one not sent yet will come by itself."""
        number = request.payload[0] if request.payload else 0
        if number in self._sent:
            self._node.send(request.source, self._kind, self._sent[number], causes=[request])

    def _serve(self) -> Op[None]:
        """Answer; bundles that come now are of no use, and are not to fill the inbox."""
        while True:
            message = yield from self._node.receive(kinds={self._kind, self._kind + REQUEST})
            if message is not None and message.kind != self._kind and message.source in self._rounds_of:
                self._answer(message)
