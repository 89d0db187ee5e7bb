"""Loopy max-product and sum-product, standard and communication-sensitive, by real messages between the nodes.

Chen, Wainwright, Cetin, Willsky, "Data association based on optimization in graphical models with application to sensor
networks", Mathematical and Computer Modelling 43 (2006): messages eqs (3) and (5), communication-sensitive rule section 5.

Each node serves all vertices of the graphical model that it hosts. Messages between co-hosted vertices cost no air; those
for vertices on one other node travel together. A round: take what has arrived, compute every outgoing message, send those
the rule selects. A receiver goes on with the last message it has where none arrived, whether it was not sent or was lost,
unless notices tell it (`netsim.algorithms.notices`). Radios may sleep between rounds (`netsim.algorithms.windows`).

What the processor is charged for: the sensor's reading, and in every round but the first the elementary operations of
computing all outgoing messages. Not charged: building the vertices and their compatibility functions at the start, the
divergences by which the rule selects, encoding and decoding, the decisions and beliefs that are only recorded.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from netsim.algorithms.association_report import check_hybrid, report_associations
from netsim.algorithms.entries import EdgeMessage, decode_entries, encode_entries, is_due
from netsim.algorithms.hosted import Hosted
from netsim.algorithms.hosting import prepare
from netsim.algorithms.message_passing_parameters import (
    LAST_ROUND,
    SETTLED,
    MessagePassingParameters,
    rule_of,
    takes_back,
    tolerance_of,
)
from netsim.algorithms.notices import BELIEF, NOTICE, Notices
from netsim.algorithms.rehosting import Rehosting
from netsim.algorithms.reports import Reports
from netsim.algorithms.windows import Quietness
from netsim.api import Message, NodeHandle, NoEnergyError, Op, Ticket
from netsim.kernels.communication import RoundOutput
from netsim.kernels.semiring import Semiring
from netsim.units import s_to_ns

KINDS = frozenset({BELIEF, NOTICE})


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
        late_ns = s_to_ns(parameters.round_s) if parameters.rehost else 0
        hosting = yield from prepare(node, parameters.payload, start_ns, *setup, late_ns=late_ns)
        hosted = Hosted.of(hosting, rule_of(parameters))
        life = _Life(node, hosted, parameters, self._semiring)
        if parameters.schedule == "synchronous":
            yield from life.rounds(start_ns)
        else:
            yield from life.whenever(start_ns)
        life.conclude()
        yield from report_associations(node, hosted, parameters, self._semiring)


class _Life:
    """Message passing on one node, from the start round to the end.

    Args:
        node: The node.
        hosted: What it hosts.
        parameters: Schedule and rule.
        semiring: Max-product or sum-product.
    """

    def __init__(
        self, node: NodeHandle, hosted: Hosted, parameters: MessagePassingParameters, semiring: Semiring
    ) -> None:
        self._node = node
        self._hosted = hosted
        self._parameters = parameters
        self._semiring = semiring
        self._reports = Reports(node, hosted, parameters, semiring)
        self._notices = Notices(node, hosted, parameters) if parameters.silence == "notice" else None
        self._quiet: Quietness | None = None
        self._rehosting: Rehosting | None = None
        if parameters.rehost and hosted.hosting.measured is not None:
            check_hybrid(hosted.hosting.measured.knowledge)
            self._rehosting = Rehosting(node, hosted, parameters, hosted.hosting.measured)

    def rounds(self, start_ns: int) -> Op[None]:
        """Synchronous rounds; round 0 sends the start messages."""
        node, parameters = self._node, self._parameters
        round_ns = s_to_ns(parameters.round_s)
        begun = (node.now_ns - start_ns) // round_ns  # above 0 for a node that was down and comes back among the others
        if parameters.sleep == "when_quiet":
            self._quiet = Quietness(parameters, max(0, begun))
        servers = [node.spawn(each.serve()) for each in (self._notices, self._rehosting) if each is not None]
        for number in [0, *range(max(1, begun), parameters.rounds + 1)]:
            begin_ns = start_ns + number * round_ns
            yield from self._until(number, begin_ns)
            late_ns = node.now_ns - begin_ns
            yield from self._collect(number)
            self._conclude_round(number - 1)
            if self._rehosting is not None:
                self._rehosting.begin_round(number)
            outputs = yield from self._computed(number)
            yield from self._send(number, outputs, late_ns)
            if self._notices is not None:
                yield from self._hear(number, begin_ns)
        end = parameters.rounds + 1
        yield from self._until(end, start_ns + end * round_ns)
        yield from self._collect(end)
        for server in servers:
            server.cancel()

    def _until(self, number: int, begin_ns: int) -> Op[None]:
        """Wait for a round to begin; where radios sleep, so does this one, if it may, between the windows."""
        node, parameters = self._node, self._parameters
        if parameters.sleep != "never" and number > 0:
            yield from node.pause_until(begin_ns - s_to_ns(parameters.round_s - parameters.window_s))
            node.radio_sleep()
            yield from node.pause_until(begin_ns - s_to_ns(parameters.guard_s))
            yield from self._collect(number)
            if number <= parameters.rounds and (self._quiet is None or self._quiet.listens(number)):
                node.radio_wake()
        yield from node.pause_until(begin_ns)

    def _conclude_round(self, number: int) -> None:
        """A round is over, and all that came in it is taken."""
        if number < 0:
            return
        if self._notices is not None:
            self._without_notice(self._notices.close(number))
        self._reports.beliefs(number)

    def _without_notice(self, partners: Sequence[int]) -> None:
        if self._rehosting is not None:
            for partner in partners:
                self._rehosting.failed(partner)

    def conclude(self) -> None:
        """The last round is over."""
        self._conclude_round(self._parameters.rounds)
        if self._notices is not None:
            self._notices.report()

    def whenever(self, start_ns: int) -> Op[None]:
        """Asynchronous: compute when something has arrived, until the time is over."""
        node = self._node
        end_ns = start_ns + (self._parameters.rounds + 1) * s_to_ns(self._parameters.round_s)
        yield from self._send(0, (yield from self._computed(0)), 0)
        number = 0
        news = True
        while node.now_ns < end_ns:
            if not news:
                message = yield from node.receive(kinds={BELIEF}, timeout_ns=end_ns - node.now_ns)
                if message is None:
                    break
                self._take(message)
            yield from node.pause(s_to_ns(self._parameters.hold_s))
            yield from self._collect(None)
            number += 1
            outputs = yield from self._computed(number)
            news = yield from self._send(number, outputs, 0)

    def _computed(self, number: int) -> Op[dict[int, RoundOutput]]:
        """What each hosted vertex sends in a round, from what was received before it, after the time that takes to compute.

        Nothing, if the node's energy allowance refuses the computation.
        """
        node, hosted = self._node, self._hosted
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
            if vertex not in hosted.resting
        }

    def _send(self, number: int, outputs: Mapping[int, RoundOutput], late_ns: int) -> Op[bool]:
        """Hand over what was selected; returns whether a co-hosted vertex got something new."""
        node, hosted = self._node, self._hosted
        by_host: dict[int, list[EdgeMessage]] = {}
        for source, output in sorted(outputs.items()):
            for destination, message in output.sent.items():
                by_host.setdefault(hosted.hosting.hosts[destination], []).append((source, destination, message))
        local = by_host.pop(node.id, [])
        edges = [(source, to) for source, output in sorted(outputs.items()) for to in output.sent]
        if self._quiet is not None:
            by_host = self._quiet.passed(number, by_host)
            passed = [entry for entries in (local, *by_host.values()) for entry in entries]
            edges = sorted((source, destination) for source, destination, _ in passed)
        self._reports.messages(number, outputs, edges, late_ns)
        for source, destination, message in local:
            hosted.accept((number & LAST_ROUND, source, destination, message))
        if by_host or self._notices is not None:
            yield from self._hand_over(number, by_host)
        return any(outputs[source].largest_change > SETTLED for source, _, _ in local)

    def _hand_over(self, number: int, by_host: Mapping[int, Sequence[EdgeMessage]]) -> Op[None]:
        """Send to each node what is for it, at a random moment of the time for that."""
        node, hosted = self._node, self._hosted
        notices = self._notices
        yield from node.pause(int(node.rng("spread").random() * s_to_ns(self._parameters.spread_s)))
        answered, hosted.fresh = (hosted.fresh if number > 0 else None), []
        if self._rehosting is not None:
            by_host = self._rehosting.readdressed([entry for entries in by_host.values() for entry in entries])
        if notices is not None:
            by_host = {partner: by_host.get(partner, ()) for partner in hosted.partners}
        for host, entries in sorted(by_host.items()):
            hosted.remember(number, entries)
            if notices is None:
                payload = encode_entries(number, entries, self._parameters.payload)
            else:
                payload = notices.payload(number, host, entries)
            kind = BELIEF if entries else NOTICE
            ticket = node.send(host, kind, payload)
            again = partial(node.send, host, kind, payload)
            node.spawn(self._post(number, host, entries, ticket, again, answered))

    def _post(
        self,
        number: int,
        host: int,
        entries: Sequence[EdgeMessage],
        ticket: Ticket,
        again: Callable[..., Ticket],
        answered: Sequence[Message] | None,
    ) -> Op[None]:
        """See a message off: send it again if the link layer gives it up and its round is not over yet."""
        delivered = yield from self._delivered(ticket, again, answered)
        if delivered and self._quiet is not None:
            self._quiet.exchanged(host, number)
        if not delivered and takes_back(self._parameters):
            self._hosted.take_back(number, entries)
        if self._rehosting is not None and self._notices is None:
            (self._rehosting.heard if delivered else self._rehosting.failed)(host)

    def _delivered(self, ticket: Ticket, again: Callable[..., Ticket], answered: Sequence[Message] | None) -> Op[bool]:
        """Wait for the outcome of a message, with its repetitions."""
        node, parameters = self._node, self._parameters
        long_s = parameters.round_s if parameters.sleep == "never" else parameters.window_s
        last_ns = node.now_ns + s_to_ns(long_s - parameters.spread_s)
        for _ in range(parameters.resend):
            delivery = yield from ticket.wait()
            if delivery.acknowledged:
                return True
            wait_ns = int(node.rng("resend").random() * s_to_ns(parameters.hold_s))
            if node.now_ns + wait_ns > last_ns:
                return False
            yield from node.pause(wait_ns)
            ticket = again(causes=self._hosted.causes_again(answered))
        if self._quiet is None and self._rehosting is None and not takes_back(parameters):
            return False  # nobody wants to know
        return bool((yield from ticket.wait()).acknowledged)

    def _hear(self, number: int, begin_ns: int) -> Op[None]:
        """With notices: take what comes in the rest of the round, and ask those that were not heard."""
        parameters, node = self._parameters, self._node
        end_s = parameters.round_s if parameters.sleep == "never" else parameters.window_s
        share_ns = s_to_ns(end_s - parameters.spread_s) // (parameters.asks + 1)
        for attempt in range(parameters.asks):
            offset_ns = int((attempt + 0.5 + 0.5 * node.rng("asks").random()) * share_ns)
            yield from self._hear_until(number, begin_ns + s_to_ns(parameters.spread_s) + offset_ns)
            self._ask(number)

    def _ask(self, number: int) -> None:
        if self._notices is not None:
            self._notices.ask(number, () if self._rehosting is None else self._rehosting.suspects)

    def _hear_until(self, number: int, end_ns: int) -> Op[None]:
        node, due = self._node, partial(is_due, number + 1)
        while node.now_ns < end_ns:
            message = yield from node.receive(kinds=KINDS, match=due, timeout_ns=end_ns - node.now_ns)
            if message is not None:
                self._take(message)

    def _collect(self, number: int | None) -> Op[None]:
        """Take everything that has arrived; what belongs to this round or a later one stays in the inbox until its turn."""
        due = None if number is None else partial(is_due, number)
        while (message := (yield from self._node.receive(kinds=KINDS, match=due, timeout_ns=0))) is not None:
            self._take(message)

    def _take(self, message: Message) -> None:
        hosted = self._hosted
        hosted.fresh.append(message)
        hosted.taken += 1
        if self._notices is None:
            entries = decode_entries(message.payload, self._parameters.payload)
        else:
            entries = self._notices.read(message)
        if self._rehosting is not None:
            self._rehosting.heard(message.source)
            entries = [entry for entry in entries if self._rehosting.is_current(message, entry[1], entry[2])]
        for entry in entries:
            if self._quiet is not None:
                self._quiet.exchanged(message.source, entry[0])
            if not hosted.accept(entry):
                self._node.log(f"message from vertex {entry[1]} to {entry[2]} does not fit and is left out")
