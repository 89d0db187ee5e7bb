"""A variable whose host died is taken over by the next of the sensors that cover its target.

Every covering sensor has the measurements of all others, so each can build the target's vertex (Chen et al. 2006, eq 14).
All know the same order of candidates, by how well they suit (`problem.hosting`), the first host in front. Who has the host
counts as dead when `suspect_after` messages in a row were not acknowledged, or as many notices did not come. The next
candidate that is not suspected then takes over; who suspects a host and is not the next tells the next, which probes the
host before it does so.

A claim is (epoch, rank in the order): the higher epoch wins, of equals the lower rank. A takeover is a claim of the next
epoch. Every node keeps the best claim it has heard, and answers a worse one, or a message from or to the wrong host,
with it; so all come to hold the same, and a host that was alive after all (a bad link, a reboot) steps down for
the one that took over. The new host tells its claim in every round to those covering sensors that have not confirmed
it; each hands it the last message that it sent on the edge. The new host computes from the next round on.

A node that was down comes back without memory. It asks its partners for their measurements, which every node tells again
for that purpose. Where it hears that it is itself the host, by a takeover that it has forgotten, it takes the
vertex over anew, with a claim of the next epoch: so it is handed the last messages again.
"""

import json
from collections import Counter
from dataclasses import dataclass, replace

from netsim.algorithms.entries import EdgeMessage, decode_entries, encode_entries
from netsim.algorithms.hosted import Hosted
from netsim.algorithms.hosting import OBSERVATIONS, Measurements
from netsim.algorithms.message_passing_parameters import MessagePassingParameters, rule_of
from netsim.api import Message, NodeHandle, Op
from netsim.codec import Record, encode_floats, float_width
from netsim.kernels.association_vertices import target_vertex
from netsim.kernels.communication import VertexSender
from netsim.kernels.semiring import FloatArray
from netsim.protocols.exchange import REQUEST
from netsim.trace.events import AlgorithmRecord
from netsim.units import s_to_ns

HOST = "host"
SUSPECT = "host-suspect"
PROBE = "host-probe"
ALIVE = "host-alive"
HANDED = "host-belief"
AGAIN = OBSERVATIONS + REQUEST
KINDS = frozenset({HOST, SUSPECT, PROBE, ALIVE, HANDED, AGAIN})
DENIAL = 4
"""Who is told that a host is alive that it does not hear believes so for this many times `suspect_after` rounds."""
_CLAIM = Record("HHH")  # target, epoch, rank


@dataclass(frozen=True, slots=True)
class Claim:
    """Who hosts a target's vertex.

    Attributes:
        target: The target.
        epoch: How often the vertex has been taken over.
        rank: Place of the host in the order of candidates.
    """

    target: int
    epoch: int
    rank: int

    def beats(self, other: "Claim") -> bool:
        """Whether this one wins against another of the same target."""
        return (self.epoch, -self.rank) > (other.epoch, -other.rank)

    def encoded(self) -> bytes:
        """As it goes over the air."""
        return _CLAIM.pack(self.target, self.epoch & 0xFFFF, self.rank)


def successor(candidates: tuple[int, ...], rank: int, suspects: set[int]) -> int | None:
    """Who comes after the candidate of a rank: round the order, without those suspected and itself; None if nobody."""
    after = [*candidates[rank + 1 :], *candidates[:rank]]
    return next((node for node in after if node not in suspects), None)


class Rehosting:
    """A node's part in it.

    Args:
        node: The node.
        hosted: What it hosts; it gains and loses vertices here.
        parameters: Of the algorithm.
        measured: What the node measured and was told.
    """

    def __init__(
        self, node: NodeHandle, hosted: Hosted, parameters: MessagePassingParameters, measured: Measurements
    ) -> None:
        self._node = node
        self._hosted = hosted
        self._parameters = parameters
        self._measured = measured
        knowledge = measured.knowledge
        shared = [covered for covered in knowledge.targets if covered.vertex is not None]
        self._candidates = {covered.target: covered.candidates for covered in shared}
        self._vertex = {covered.target: covered.vertex for covered in shared if covered.vertex is not None}
        self._target = {vertex: target for target, vertex in self._vertex.items()}
        self._claims = {target: Claim(target, 0, 0) for target in self._candidates}
        self._failures: Counter[int] = Counter()
        self._unconfirmed: dict[int, set[int]] = {}
        self._denied: dict[Claim, int] = {}  # the round until which a host is taken for alive on another's word
        self._probed: set[int] = set()
        self._round = 0

    # --- who is alive -------------------------------------------------------------------------------------------------

    def heard(self, node: int) -> None:
        """A node is alive."""
        self._failures.pop(node, None)

    def failed(self, node: int) -> None:
        """A node gave no sign of life where it should have."""
        self._failures[node] += 1

    @property
    def suspects(self) -> set[int]:
        """Nodes believed dead."""
        return {node for node, count in self._failures.items() if count >= self._parameters.suspect_after}

    def _host(self, claim: Claim) -> int:
        return self._candidates[claim.target][claim.rank]

    # --- rounds -------------------------------------------------------------------------------------------------------

    def begin_round(self, number: int) -> None:
        """Take over what is this node's to take over, and tell those who do not know yet."""
        self._round = number
        self._hosted.resting.clear()
        suspects = self.suspects
        for target, claim in sorted(self._claims.items()):
            host = self._host(claim)
            if host == self._node.id:
                self._announce(target, suspects)
            elif host in suspects and self._denied.get(claim, -1) < number:
                following = successor(self._candidates[target], claim.rank, suspects)
                if following == self._node.id:
                    self._take_over(claim)
                elif following is not None:
                    self._node.send(following, SUSPECT, claim.encoded(), causes=())

    def _take_over(self, old: Claim) -> None:
        target, here = old.target, self._node.id
        claim = Claim(target, old.epoch + 1, self._candidates[target].index(here))
        vertex = self._vertex[target]
        self._claims[target] = claim
        measured, hosted = self._measured, self._hosted
        own = measured.knowledge.sensor
        last = self._last_message(own, vertex)
        table = target_vertex(measured.knowledge, target, measured.own_m, measured.others_m)
        rule = replace(rule_of(self._parameters), first_round="both")  # its receivers hold the dead host's messages
        hosted.gain(VertexSender(table, rule), here)
        if last is not None:
            hosted.accept((self._round, own, vertex, last))
        self._unconfirmed[target] = set(self._candidates[target]) - {here}
        self._note("rehosted", claim, self._host(old))
        self._announce(target, set())

    def _announce(self, target: int, left_out: set[int]) -> None:
        for node in sorted(self._unconfirmed.get(target, set()) - left_out):
            self._node.send(node, HOST, self._claims[target].encoded(), causes=())

    def _note(self, kind: str, claim: Claim, other: int) -> None:
        fields = {"variable": self._vertex[claim.target], "epoch": claim.epoch, "round": self._round, "other": other}
        self._node.record(AlgorithmRecord(self._node.id, kind, json.dumps(fields)))

    # --- messages -----------------------------------------------------------------------------------------------------

    def serve(self) -> Op[None]:
        """Answer all that concerns hosts, for ever."""
        while True:
            message = yield from self._node.receive(kinds=KINDS)
            if message is None:
                continue
            self.heard(message.source)
            if message.kind == AGAIN:
                self._tell_again(message)
                continue
            if message.kind == HANDED:
                for entry in decode_entries(message.payload, self._parameters.payload):
                    self._hosted.accept(entry)
                continue
            claim = Claim(*map(int, _CLAIM.unpack(message.payload, 0)))
            if claim.target in self._claims and claim.rank < len(self._candidates[claim.target]):
                self._answer(message, claim)

    def _tell_again(self, message: Message) -> None:
        """Measurements for one that was down; as at the start."""
        width = float_width(self._parameters.payload)
        payload = encode_floats(self._measured.own_m.ravel(), width)
        self._node.send(message.source, OBSERVATIONS, payload, causes=[message])

    def _answer(self, message: Message, claim: Claim) -> None:
        mine = self._claims[claim.target]
        if message.kind == PROBE:
            self._node.send(message.source, ALIVE, claim.encoded(), causes=[message])
        elif message.kind == ALIVE:
            if message.source != self._host(claim):
                # the next candidate hears the host that this node does not
                self._denied[claim] = self._round + DENIAL * self._parameters.suspect_after
        elif mine.beats(claim):
            self._node.send(message.source, HOST, mine.encoded(), causes=[message])
        elif message.kind == SUSPECT:
            if claim == mine and self._host(claim) not in {self._node.id, *self._probed, *self.suspects}:
                self._node.spawn(self._probe(message, claim))
        elif claim == mine:
            self._confirm(message, claim)
        else:
            self._accept(message, claim)

    def _confirm(self, message: Message, claim: Claim) -> None:
        if self._host(claim) == self._node.id:
            self._unconfirmed.get(claim.target, set()).discard(message.source)
        elif message.source == self._host(claim):
            self._node.send(message.source, HOST, claim.encoded(), causes=[message])

    def _accept(self, message: Message, claim: Claim) -> None:
        """A better claim: from now on its host is the one; it is given this node's last message."""
        if self._host(claim) == self._node.id:
            self._take_over(claim)  # this node has forgotten its claim
            return
        hosted, own, vertex = self._hosted, self._measured.knowledge.sensor, self._vertex[claim.target]
        last = self._last_message(own, vertex)
        if vertex in hosted.senders:
            hosted.lose(vertex)
            self._unconfirmed.pop(claim.target, None)
            self._note("stepped-down", claim, self._host(claim))
        self._claims[claim.target] = claim
        host = self._host(claim)
        hosted.hosting.hosts[vertex] = host
        self._node.send(host, HOST, claim.encoded(), causes=[message])
        if last is not None:
            hosted.remember(self._round, [(own, vertex, last)])
            payload = encode_entries(self._round, [(own, vertex, last)], self._parameters.payload)
            self._node.send(host, HANDED, payload, causes=[message])

    def _last_message(self, own: int, vertex: int) -> FloatArray | None:
        """What this node's sensor last told a target's vertex, here or elsewhere."""
        if vertex in self._hosted.senders:
            return self._hosted.incoming[vertex].get(own)
        sent = self._hosted.sent.get((own, vertex))
        return None if sent is None else sent[1]

    def _probe(self, message: Message, claim: Claim) -> Op[None]:
        """Ask a suspected host for a sign of life, as often as it takes to suspect it; tell who asked if it gives one."""
        host, node = self._host(claim), self._node
        self._probed.add(host)
        for _ in range(self._parameters.suspect_after):
            self.failed(host)
            node.send(host, PROBE, claim.encoded(), causes=[message])
            yield from node.pause(s_to_ns(self._parameters.round_s))
            if host not in self._failures:
                node.send(message.source, ALIVE, claim.encoded(), causes=[message])
                break
        self._probed.discard(host)

    def is_current(self, message: Message, source: int, destination: int) -> bool:
        """Whether a graph message goes between the vertex's host and others; answers it with the right claim if not."""
        for vertex, host in ((source, message.source), (destination, self._node.id)):
            target = self._target.get(vertex)
            if target is not None and self._host(self._claims[target]) != host:
                self._node.send(message.source, HOST, self._claims[target].encoded(), causes=[message])
                return False
        return True

    def readdressed(self, entries: list[EdgeMessage]) -> dict[int, list[EdgeMessage]]:
        """Messages by the nodes that host their destinations by now."""
        by_host: dict[int, list[EdgeMessage]] = {}
        for entry in entries:
            host = self._hosted.hosting.hosts[entry[1]]
            if host != self._node.id:
                by_host.setdefault(host, []).append(entry)
        return by_host
