"""Messages that all arrive, in whatever order: numbered, kept by their sender, and sent again when they are missing.

Links that acknowledge frames lose little, so at first nothing is confirmed from end to end: a receiver that has heard
nothing new for a while asks its peers for what it lacks, each time after a pause twice as long. A sender that is asked for
what its link layer took for delivered trusts it no more: its messages want to be confirmed from then on, and are sent again
where that takes longer than a round trip should (see `netsim.protocols.round_trip`). Who receives such a message does the
same with its own. So the first loss on links that do not acknowledge costs the long silence, later ones a round trip.

A node that crashes and comes up again has forgotten what it sent and received. Every life has a number of its own, drawn at
random; a message names the lives of both ends. Where one of them is another than before, the two have nothing more to say
to each other: neither could make up for what the old life knew. Each gets to know it, and its algorithm is told once.
"""

from collections.abc import Collection
from dataclasses import dataclass

from netsim.api import Delivery, Message, NodeHandle, Op, Task
from netsim.protocols.courier_peer import HEAD, NUMBERS, STATUS, Peer
from netsim.protocols.round_trip import RoundTrip

_LONGEST_PAUSES = 5  # doublings
_LIVES = 1 << 16


@dataclass(frozen=True, slots=True)
class Arrival:
    """What a courier has to tell.

    Attributes:
        peer: Which peer.
        payload: Its message; None if this node or the peer has begun a new life, and nothing more will come.
    """

    peer: int
    payload: bytes | None


class Courier:
    """One node's messages of one kind to and from its peers.

    Args:
        node: The node.
        kind: Kind of the messages; requests and confirmations are of the kind with `-repeat` after it.
        peers: Nodes that it exchanges messages with.
        stall_ns: How long without news before it asks; also the longest wait for a confirmation.
        resend: How often a message that the link layer gave up, or that was not confirmed, is sent again.
        resend_ns: Longest pause before a message goes again that the link layer gave up; twice this is the first guess of a
            round trip.
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
        self._peers = {peer: Peer() for peer in sorted(peers)}
        self._life = int(node.rng("life").integers(1, _LIVES))
        self._trip = RoundTrip(2 * resend_ns, resend_ns // 10, max(stall_ns, 2 * resend_ns))
        self._confirms = False
        self._asked = 0
        self._posts: list[Task[None]] = []

    def send(self, peer: int, payload: bytes) -> None:
        """Send, and keep what was sent; nothing to a peer that is lost."""
        other = self._peers[peer]
        if not other.is_lost:
            other.kept.append(payload)
            self._start(peer, len(other.kept) - 1)

    def is_lost(self, peer: int) -> bool:
        """Whether nothing more goes to or comes from a peer, because one of the two began a new life."""
        return self._peers[peer].is_lost

    def receive(self, timeout_ns: int, *, asks: bool = True) -> Op[Arrival | None]:
        """The next new message, or the news that a peer is lost; None after the time-out.

        Args:
            timeout_ns: Longest wait.
            asks: Whether to ask the peers for what is missing while nothing comes.
        """
        node, end_ns = self._node, self._node.now_ns + timeout_ns
        # requests are no news: two that ask each other must not keep each other from asking
        quiet_since_ns = node.now_ns
        while True:
            ask_ns = quiet_since_ns + (self._stall_ns << min(self._asked, _LONGEST_PAUSES))
            wait_ns = (min(end_ns, ask_ns) if asks else end_ns) - node.now_ns
            message = yield from node.receive(kinds={self._kind, self._repeat}, timeout_ns=max(0, wait_ns))
            if message is None and node.now_ns >= end_ns:
                return None
            if message is None:
                self._ask()
                quiet_since_ns = node.now_ns
            elif (arrival := self._taken(message)) is not None:
                self._asked = 0
                return arrival

    def see_off(self) -> Op[None]:
        """Wait until everything has been sent: tasks end with the algorithm."""
        while self._posts:
            yield from self._posts.pop().join()

    def _taken(self, message: Message) -> Arrival | None:
        """Look at a message that has come; what is new for the algorithm."""
        peer = message.source
        if peer not in self._peers:
            return None
        is_status = message.kind == self._repeat
        fields = (STATUS if is_status else HEAD).unpack(message.payload, 0)
        if not self._is_same_life(peer, *fields[:2]):
            return self._parted(peer, answers=not is_status or bool(fields[-1]))
        if is_status:
            self._on_status(peer, *fields[2:])
            return None
        is_new = self._peers[peer].takes(fields[2])
        if fields[3]:
            self._confirms = True
            self._tell(peer, wants=False)
        return Arrival(peer, message.payload[HEAD.size_byte :]) if is_new else None

    def _is_same_life(self, peer: int, life: int, own: int) -> bool:
        other = self._peers[peer]
        if other.is_lost or own not in (0, self._life) or other.life not in (0, life):
            return False
        other.life = life
        return True

    def _parted(self, peer: int, *, answers: bool) -> Arrival | None:
        """One of the two is not who it was: let the other end know, and the algorithm once."""
        other = self._peers[peer]
        if answers:
            self._tell(peer, wants=False)
        if other.is_lost:
            return None
        other.is_lost = True
        return Arrival(peer, None)

    def _on_status(self, peer: int, first: int, have: int, wanted: int) -> None:
        other, now_ns = self._peers[peer], self._node.now_ns
        once_ns = {number: other.delivered_ns.get(number) for number in other.under_way - other.repeated}
        confirmed, missing = other.confirm(first, have)
        measured_ns = [sent_ns for number in confirmed if (sent_ns := once_ns.get(number)) is not None]
        if measured_ns:
            self._trip.measured(now_ns - max(measured_ns))
        for number in missing if wanted else ():
            if number in other.under_way:
                continue
            if now_ns - other.delivered_ns.get(number, now_ns) > self._resend_ns:
                self._confirms = True  # it was taken for delivered, and had time enough to arrive
            other.repeated.add(number)
            self._start(peer, number)

    def _ask(self) -> None:
        self._asked += 1
        for peer, other in self._peers.items():
            if not other.is_lost:
                self._tell(peer, wants=True)

    def _tell(self, peer: int, *, wants: bool) -> None:
        """What has come from a peer; with `wants` it is to send the rest, and is told again where the link gives up."""
        other = self._peers[peer]
        status = STATUS.pack(self._life, other.life, *other.received(), wants)
        if wants:
            self._spawn(self._request(peer, status))
        else:
            self._node.send(peer, self._repeat, status, causes=())

    def _request(self, peer: int, status: bytes) -> Op[None]:
        for attempt in range(self._resend + 1):
            delivery = yield from self._node.send(peer, self._repeat, status, causes=()).wait()
            if delivery.acknowledged or attempt == self._resend:
                return
            yield from self._pause_after(delivery)

    def _pause_after(self, delivery: Delivery) -> Op[None]:
        """Wait before a message goes again: at random, where the energy allowance refused it from when that comes back."""
        node, back_ns = self._node, self._node.budget.replenishes_ns
        if delivery.reason == "no_energy" and back_ns is not None:
            # no longer than the longest silence: then it is asked for
            yield from node.pause(min(max(0, back_ns - node.now_ns), self._stall_ns << _LONGEST_PAUSES))
        yield from node.pause(int(node.rng("resend").random() * self._resend_ns))

    def _spawn(self, op: Op[None]) -> None:
        self._posts.append(self._node.spawn(op))

    def _start(self, peer: int, number: int) -> None:
        self._peers[peer].under_way.add(number)
        self._spawn(self._post(peer, number))

    def _post(self, peer: int, number: int) -> Op[None]:
        """Send a message until the link layer has delivered it, or if that is not enough until it is confirmed."""
        node, other, causes = self._node, self._peers[peer], None
        for attempt in range(self._resend + 1):
            if other.is_lost or (attempt and other.is_confirmed(number)):
                break
            if attempt:
                other.repeated.add(number)
            confirms = self._confirms
            head = HEAD.pack(self._life, other.life, number % NUMBERS, confirms)
            delivery = yield from node.send(peer, self._kind, head + other.kept[number], causes=causes).wait()
            causes = ()
            if delivery.acknowledged:
                if not other.is_confirmed(number):
                    other.delivered_ns[number] = node.now_ns
                if not confirms:
                    break
                yield from node.pause(self._trip.timeout_ns(attempt))
            elif attempt < self._resend:
                yield from self._pause_after(delivery)
        other.under_way.discard(number)
