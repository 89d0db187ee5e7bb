"""Messages that all arrive, in whatever order: numbered, kept by their sender, and asked for again when they are missing.

Links that acknowledge frames lose little, so nothing is confirmed from end to end. A receiver that has heard nothing new for
a while asks its peers for what it lacks, each time after a pause twice as long, until something new comes.
"""

from collections.abc import Collection

from netsim.api import Message, NodeHandle, Op, Task
from netsim.codec import Record

_NUMBER = Record("H")
_WANTED = Record("HQ")  # first number that is missing, and which of the 64 after it have come
_WINDOW = 64
_LONGEST_PAUSES = 5  # doublings


class Courier:
    """One node's messages of one kind to and from its peers; numbers below 65,536 for each peer.

    Args:
        node: The node.
        kind: Kind of the messages; requests are of the kind with `-repeat` after it.
        peers: Nodes that it exchanges messages with.
        stall_ns: How long without news before it asks.
        resend: How often a message that the link layer gave up is sent again at once.
        resend_ns: Longest pause before that.
    """

    def __init__(
        self, node: NodeHandle, kind: str, peers: Collection[int], stall_ns: int, resend: int, resend_ns: int
    ) -> None:
        self._node = node
        self._kind = kind
        self._repeat = f"{kind}-repeat"
        self._stall_ns = stall_ns
        self._resend = resend
        self._resend_ns = resend_ns
        self._kept: dict[int, list[bytes]] = {peer: [] for peer in peers}
        self._seen: dict[int, set[int]] = {peer: set() for peer in peers}
        self._first: dict[int, int] = dict.fromkeys(peers, 0)
        self._asked = 0
        self._posts: list[Task[None]] = []

    def send(self, peer: int, payload: bytes) -> None:
        """Send, and keep what was sent."""
        numbered = _NUMBER.pack(len(self._kept[peer])) + payload
        self._kept[peer].append(numbered)
        self._spawn(self._post(peer, numbered, None))

    def receive(self, timeout_ns: int, *, asks: bool = True) -> Op[tuple[Message, bytes] | None]:
        """The next new message and its payload without the number; None after the time-out.

        Args:
            timeout_ns: Longest wait.
            asks: Whether to ask the peers for what is missing while nothing comes.
        """
        node, end_ns = self._node, self._node.now_ns + timeout_ns
        quiet_since_ns = (
            node.now_ns
        )  # requests are no news: two that ask each other must not keep each other from asking
        while True:
            ask_ns = quiet_since_ns + (self._stall_ns << min(self._asked, _LONGEST_PAUSES))
            wait_ns = (min(end_ns, ask_ns) if asks else end_ns) - node.now_ns
            message = yield from node.receive(kinds={self._kind, self._repeat}, timeout_ns=max(0, wait_ns))
            if message is None and node.now_ns >= end_ns:
                return None
            if message is None:
                self._ask()
                quiet_since_ns = node.now_ns
            elif message.kind == self._repeat:
                self._answer(message)
            elif self._is_new(message):
                self._asked = 0
                return message, message.payload[_NUMBER.size_byte :]

    def see_off(self) -> Op[None]:
        """Wait until everything has been sent: tasks end with the algorithm."""
        while self._posts:
            yield from self._posts.pop().join()

    def _is_new(self, message: Message) -> bool:
        seen, source = self._seen[message.source], message.source
        (number,) = _NUMBER.unpack(message.payload, 0)
        if number < self._first[source] or number in seen:
            return False
        seen.add(number)
        while self._first[source] in seen:
            seen.remove(self._first[source])
            self._first[source] += 1
        return True

    def _ask(self) -> None:
        self._asked += 1
        for peer, first in sorted(self._first.items()):
            have = sum(1 << (number - first - 1) for number in self._seen[peer] if number - first <= _WINDOW)
            self._spawn(self._post(peer, _WANTED.pack(first, have), self._repeat))

    def _answer(self, message: Message) -> None:
        first, have = _WANTED.unpack(message.payload, 0)
        kept = self._kept[message.source]
        for number in range(first, min(len(kept), first + _WINDOW + 1)):
            if number == first or not have >> (number - first - 1) & 1:
                self._spawn(self._post(message.source, kept[number], None))

    def _spawn(self, op: Op[None]) -> None:
        self._posts.append(self._node.spawn(op))

    def _post(self, peer: int, payload: bytes, kind: str | None) -> Op[None]:
        node, causes = self._node, None
        for attempt in range(self._resend + 1):
            ticket = node.send(peer, kind or self._kind, payload, causes=causes)
            delivery = yield from ticket.wait()
            if delivery.acknowledged or attempt == self._resend:
                return
            causes = ()
            yield from node.pause(int(node.rng("resend").random() * self._resend_ns))
