"""Loopy max-product and sum-product, standard and communication-sensitive, by real messages between the nodes.

Chen, Wainwright, Cetin, Willsky, "Data association based on optimization in graphical models with application to sensor
networks", Mathematical and Computer Modelling 43 (2006): messages eqs (3) and (5), communication-sensitive rule section 5.

Each node serves all vertices of the graphical model that it hosts. Messages between co-hosted vertices cost no air; those
for vertices on one other node travel together. A round: take what has arrived, compute every outgoing message, send those
the rule selects. A receiver goes on with the last message it has where none arrived, whether it was not sent or was lost.

What the processor is charged for: the sensor's reading, and in every round but the first the elementary operations of
computing all outgoing messages. Not charged: building the vertices and their compatibility functions at the start, the
divergences by which the rule selects, encoding and decoding, the decisions and beliefs that are only recorded.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from netsim.algorithms.hosting import Hosting, prepare
from netsim.algorithms.message_passing_parameters import (
    LAST_ROUND,
    SETTLED,
    MessagePassingParameters,
    rule_of,
    tolerance_of,
)
from netsim.api import Message, NodeHandle, NoEnergyError, Op, Ticket
from netsim.codec import Precision, Record, decode_floats, encode_floats, size_byte
from netsim.kernels.communication import CommunicationRule, RoundOutput, VertexSender
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.kernels.vertex import Vertex
from netsim.trace.events import Association, GraphMessages, Marginals
from netsim.units import s_to_ns

BELIEF = "belief"
_ENTRY = Record("HHHH")  # round or step modulo 65,536, source vertex, destination vertex, number of entries


def encode_entries(round_number: int, entries: Iterable[tuple[int, int, FloatArray]], width: Precision) -> bytes:
    """Messages for one node as one payload: (source vertex, destination vertex, log message) each."""
    return b"".join(
        _ENTRY.pack(round_number & LAST_ROUND, source, destination, len(message)) + encode_floats(message, width)
        for source, destination, message in entries
    )


def decode_entries(payload: bytes, width: Precision) -> list[tuple[int, int, int, FloatArray]]:
    """The (round, source, destination, log message) that `encode_entries` put into a payload."""
    entries = []
    offset = 0
    while offset < len(payload):
        round_number, source, destination, size = _ENTRY.unpack(payload, offset)
        begin = offset + _ENTRY.size_byte
        offset = begin + size_byte(size, width)
        entries.append((round_number, source, destination, decode_floats(payload[begin:offset], width)))
    return entries


@dataclass(slots=True)
class Hosted:
    """What a node keeps of the vertices it hosts: the vertices, their memory, the last messages received.

    `fresh` are the messages taken since the last send: what is sent next answers them, and so does what of it is sent again.
    `taken` counts all messages taken.
    """

    hosting: Hosting
    senders: Mapping[int, VertexSender]
    incoming: Mapping[int, dict[int, FloatArray]]
    newest: dict[tuple[int, int], int]
    fresh: list[Message]
    taken: int = 0

    @classmethod
    def of(cls, hosting: Hosting, rule: CommunicationRule) -> "Hosted":
        """At the start nothing has been received."""
        senders = {vertex.id: VertexSender(vertex, rule) for vertex in hosting.vertices}
        return cls(hosting, senders, {vertex: {} for vertex in senders}, {}, [])

    def accept(self, entry: tuple[int, int, int, FloatArray]) -> bool:
        """Take a received message, unless a newer one came first; False for one that does not fit.

        It does not fit where its sender lacked our measurements.
        """
        number, source, destination, message = entry
        sender = self.senders.get(destination)
        if sender is None or source not in sender.vertex.neighbours:
            return False
        if len(message) != sender.vertex.incoming_size(source):
            return False
        last = self.newest.get((source, destination))
        if last is None or (number - last) & LAST_ROUND <= LAST_ROUND // 2:
            self.newest[source, destination] = number
            self.incoming[destination][source] = message
        return True

    def causes_again(self, answered: Sequence[Message] | None) -> Sequence[Message] | None:
        """What a message names as its causes when it is sent again: those of the first time, not what came meanwhile.

        Args:
            answered: The messages taken before it was sent; None for a start message, which answers the measurements. The
                node knows these itself until something else is taken; then such a message names none.
        """
        return () if answered is None and self.taken else answered

    @property
    def operations(self) -> int:
        """Cost of one round of computing."""
        return sum(sender.vertex.operations() for sender in self.senders.values())


class MessagePassing:
    """See the module.

    Args:
        parameters: Schedule and rule.
        semiring: Max-product or sum-product.
    """

    def __init__(self, parameters: MessagePassingParameters, semiring: Semiring) -> None:
        self._parameters = parameters
        self._semiring = semiring

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        parameters = self._parameters
        start_ns = s_to_ns(parameters.setup_s)
        setup = parameters.setup_attempts, parameters.setup_exchange
        hosting = yield from prepare(node, parameters.payload, start_ns, *setup)
        hosted = Hosted.of(hosting, rule_of(parameters))
        if parameters.schedule == "synchronous":
            yield from self._rounds(node, hosted, start_ns)
        else:
            yield from self._whenever(node, hosted, start_ns)
        self._report(node, hosted, parameters.rounds)

    def _rounds(self, node: NodeHandle, hosted: Hosted, start_ns: int) -> Op[None]:
        """Synchronous rounds; round 0 sends the start messages."""
        round_ns = s_to_ns(self._parameters.round_s)
        begun = (node.now_ns - start_ns) // round_ns  # above 0 for a node that was down and comes back among the others
        for number in [0, *range(max(1, begun), self._parameters.rounds + 1)]:
            yield from node.pause_until(start_ns + number * round_ns)
            late_ns = node.now_ns - (start_ns + number * round_ns)
            yield from self._collect(node, hosted, number)
            if number > 0:
                self._report(node, hosted, number - 1)
            outputs = yield from self._computed(node, hosted, number)
            yield from self._send(node, hosted, number, outputs, late_ns)
        yield from node.pause_until(start_ns + (self._parameters.rounds + 1) * round_ns)
        yield from self._collect(node, hosted, self._parameters.rounds + 1)

    def _whenever(self, node: NodeHandle, hosted: Hosted, start_ns: int) -> Op[None]:
        """Asynchronous: compute when something has arrived, until the time is over."""
        end_ns = start_ns + (self._parameters.rounds + 1) * s_to_ns(self._parameters.round_s)
        yield from self._send(node, hosted, 0, (yield from self._computed(node, hosted, 0)), 0)
        number = 0
        news = True
        while node.now_ns < end_ns:
            if not news:
                message = yield from node.receive(kinds={BELIEF}, timeout_ns=end_ns - node.now_ns)
                if message is None:
                    break
                self._take(node, hosted, message)
            yield from node.pause(s_to_ns(self._parameters.hold_s))
            yield from self._collect(node, hosted, None)
            number += 1
            outputs = yield from self._computed(node, hosted, number)
            news = yield from self._send(node, hosted, number, outputs, 0)

    def _computed(self, node: NodeHandle, hosted: Hosted, number: int) -> Op[dict[int, RoundOutput]]:
        """What each hosted vertex sends in a round, from what was received before it, after the time that takes to compute.

        Nothing, if the node's energy allowance refuses the computation.
        """
        if number == 0:
            return {vertex: sender.start() for vertex, sender in hosted.senders.items()}
        tolerance = tolerance_of(self._parameters, node.budget.is_short)
        try:
            yield from node.compute(hosted.operations)
        except NoEnergyError:
            return {}
        return {
            vertex: sender.step(hosted.incoming[vertex], self._semiring, tolerance)
            for vertex, sender in hosted.senders.items()
        }

    def _send(
        self, node: NodeHandle, hosted: Hosted, number: int, outputs: Mapping[int, RoundOutput], late_ns: int
    ) -> Op[bool]:
        """Hand over what was selected; returns whether a co-hosted vertex got something new."""
        self._count(node, hosted, number, outputs, late_ns)
        by_host: dict[int, list[tuple[int, int, FloatArray]]] = {}
        for source, output in sorted(outputs.items()):
            for destination, message in output.sent.items():
                by_host.setdefault(hosted.hosting.hosts[destination], []).append((source, destination, message))
        local = by_host.pop(node.id, [])
        for source, destination, message in local:
            hosted.accept((number & LAST_ROUND, source, destination, message))
        if by_host:
            yield from node.pause(int(node.rng("spread").random() * s_to_ns(self._parameters.spread_s)))
            answered, hosted.fresh = (hosted.fresh if number > 0 else None), []
            for host, entries in sorted(by_host.items()):
                payload = encode_entries(number, entries, self._parameters.payload)
                ticket = node.send(host, BELIEF, payload)
                node.spawn(self._post(node, hosted, host, payload, ticket, answered))
        return any(outputs[source].largest_change > SETTLED for source, _, _ in local)

    def _post(
        self,
        node: NodeHandle,
        hosted: Hosted,
        host: int,
        payload: bytes,
        ticket: Ticket,
        answered: Sequence[Message] | None,
    ) -> Op[None]:
        """See a message off: send it again if the link layer gives it up and its round is not over yet."""
        last_ns = node.now_ns + s_to_ns(self._parameters.round_s - self._parameters.spread_s)
        for _ in range(self._parameters.resend):
            delivery = yield from ticket.wait()
            if delivery.acknowledged:
                return
            wait_ns = int(node.rng("resend").random() * s_to_ns(self._parameters.hold_s))
            if node.now_ns + wait_ns > last_ns:
                return
            yield from node.pause(wait_ns)
            ticket = node.send(host, BELIEF, payload, causes=hosted.causes_again(answered))

    def _collect(self, node: NodeHandle, hosted: Hosted, number: int | None) -> Op[None]:
        """Take everything that has arrived; what belongs to this round or a later one stays in the inbox until its turn."""
        due = None if number is None else partial(_is_due, number)
        while (message := (yield from node.receive(kinds={BELIEF}, match=due, timeout_ns=0))) is not None:
            self._take(node, hosted, message)

    def _take(self, node: NodeHandle, hosted: Hosted, message: Message) -> None:
        hosted.fresh.append(message)
        hosted.taken += 1
        for entry in decode_entries(message.payload, self._parameters.payload):
            if not hosted.accept(entry):
                node.log(f"message from vertex {entry[1]} to {entry[2]} does not fit and is left out")

    def _count(
        self, node: NodeHandle, hosted: Hosted, number: int, outputs: Mapping[int, RoundOutput], late_ns: int
    ) -> None:
        """Record the graph messages of a round."""
        if not outputs:
            return
        edges = [(source, to) for source, output in sorted(outputs.items()) for to in output.sent]
        node.record(
            GraphMessages(
                node=node.id,
                round=number,
                source=[source for source, _ in edges],
                destination=[to for _, to in edges],
                remote=[int(hosted.hosting.hosts[to] != node.id) for _, to in edges],
                computed=sum(output.computed for output in outputs.values()),
                largest_change=max(output.largest_change for output in outputs.values()),
                is_synchronous=int(self._parameters.schedule == "synchronous"),
                late_ns=late_ns,
            )
        )

    def _report(self, node: NodeHandle, hosted: Hosted, number: int) -> None:
        """Record what the node believes after a round."""
        for vertex_id, sender in sorted(hosted.senders.items()):
            vertex: Vertex = sender.vertex
            if isinstance(vertex, SensorVertex):
                decision = vertex.decide(hosted.incoming[vertex_id], self._semiring)
                node.record(Association(node.id, decision.tolist(), number))
                if number == self._parameters.rounds:
                    self._report_origins(node, vertex, hosted.incoming[vertex_id])
            elif not isinstance(vertex, FactorVertex):
                belief = np.exp(vertex.belief(hosted.incoming[vertex_id], self._semiring))
                is_max = int(self._semiring is Semiring.MAX)
                node.record(Marginals(node.id, vertex_id, belief, number, is_max))

    def _report_origins(self, node: NodeHandle, vertex: SensorVertex, incoming: Mapping[int, FloatArray]) -> None:
        """Record where a sensor believes in the end that its measurements came from; max-product has only its decision."""
        if self._semiring is Semiring.SUM and vertex.measurement_count:
            belief = np.exp(vertex.belief(incoming, self._semiring))
            node.record(Marginals(node.id, vertex.id, belief, self._parameters.rounds, 0))


def _is_due(number: int, message: Message) -> bool:
    """Whether a message belongs to a round before this one; all its entries are of one round."""
    return not message.payload or int(_ENTRY.unpack(message.payload, 0)[0]) < number
