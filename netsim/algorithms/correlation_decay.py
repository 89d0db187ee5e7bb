"""Data association by correlation decay, distributed (Oh 2010, Algorithms 3 and 4).

Each sensor tells its gated measurements, with the events they may be of, within some hops; when its neighbours have told
theirs it computes the probabilities of its own pairs on what it knows, by itself or with the owners of the vertices, and the
intervals that its knowledge certifies.

What the processor is charged for: the recursions' sums (see `DecayGraph.operations`, `DecayInterval.operations`) and the
weights of the pairs it knows, 20 operations each. Not charged: encoding and decoding.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from netsim.algorithms.charging import charge
from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters, TargetParameters
from netsim.algorithms.decay_factors import FACTORS, Factors, NamedGraph
from netsim.algorithms.decay_payload import VertexName, decode_report, encode_report, narrowed, rounding_m
from netsim.algorithms.decay_record import Statistics, record_pairs
from netsim.api import EnergyTask, Message, NodeHandle, NoEnergyError, Op
from netsim.codec import decode_floats, encode_floats
from netsim.errors import AlgorithmError
from netsim.kernels.correlation_decay import (
    literal_chains,
    literal_pair,
    literal_ratio,
    members,
    normalised_pair,
    two_factor_pair,
    vertex_order,
)
from netsim.kernels.decay_interval import DecayInterval
from netsim.kernels.event_association import EventAssociationKnowledge, PredictedEvent
from netsim.kernels.known_association import KnownAssociation, SensorReport, report_of
from netsim.protocols.flood_rounds import FloodRounds, FloodSettings
from netsim.units import s_to_ns

FLOOD = "measurements"
ASK = "ask"
REPORT = "report"
_WEIGHT_OPERATIONS = 20

Pair = tuple[int, int]
"""Measurement and event, as row and column of the known graph."""


class CorrelationDecay:
    """See `CorrelationDecayParameters`."""

    def __init__(self, parameters: CorrelationDecayParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = node.knowledge
        if isinstance(knowledge, EventAssociationKnowledge):
            yield from _Sensor(node, knowledge, self._parameters).run()
        elif knowledge is not None:
            message = f"this algorithm needs an event-association problem, not {type(knowledge).__name__}"
            raise AlgorithmError(message)
        yield from node.pause_until(s_to_ns(self._parameters.until_s))


class _Sensor:
    """One node with a sensor, from measuring to its answer."""

    def __init__(
        self, node: NodeHandle, knowledge: EventAssociationKnowledge, parameters: CorrelationDecayParameters
    ) -> None:
        self._node, self._knowledge, self._parameters = node, knowledge, parameters
        self._reports: dict[int, SensorReport] = {}
        self._events: dict[int, PredictedEvent] = {}
        self._own: bytes | None = None
        self._others = knowledge.sensors_m.keys() - {node.id}
        self._factors = Factors(node, self._others, s_to_ns(parameters.request_s), parameters.request_attempts)
        self._statistics = Statistics()

    def run(self) -> Op[None]:
        node, parameters = self._node, self._parameters
        node.spawn(self._serve())
        yield from self._measure()
        node.spawn(self._answer_asks())
        yield from self._flood()
        if parameters.target is not None:
            known, depth = yield from self._grow(parameters.target)
        else:
            known, depth = self._known(), parameters.depth
        names = _names(known)
        self._factors.begin(NamedGraph(known.graph, names))
        pairs = self._pairs(known)
        estimates = yield from self._estimates(known, pairs, depth, names)
        interval = DecayInterval(known.graph, known.incomplete)
        bounds = [interval.pair(j, k, depth) for j, k in pairs]
        if parameters.target is not None:
            estimates = [min(max(p, low), high) for p, (low, high) in zip(estimates, bounds, strict=True)]
        yield from charge(node, interval.operations + _WEIGHT_OPERATIONS * known.graph.weights.size)
        record_pairs(node, self._knowledge.first_variable, known, pairs, estimates, bounds, depth)
        yield from node.pause_until(s_to_ns(parameters.until_s))
        self._statistics.record(node, self._factors, known, pairs)

    def _measure(self) -> Op[None]:
        node, width = self._node, self._parameters.payload
        try:
            observation = yield from node.sense()
            points_m = narrowed(np.asarray(observation.values, dtype=float), width)
        except NoEnergyError:
            return  # it has nothing to report, which is not a report of no measurement
        events = [_narrowed_event(event, self._parameters) for event in self._knowledge.events]
        self._events = {event.event: event for event in events}
        report = report_of(node.id, points_m, events, self._knowledge.model)
        self._reports[node.id] = report
        self._own = encode_report(report, width)

    def _flood(self) -> Op[None]:
        flood, knowledge = self._parameters.flood, self._knowledge
        partners = knowledge.sensing_neighbours if flood.graph == "sensing" else knowledge.overlay_neighbours
        settings = FloodSettings(flood.hops, s_to_ns(flood.round_s), flood.attempts, s_to_ns(flood.spread_s))
        flooded = yield from FloodRounds(self._node, FLOOD, partners, settings).run(self._own)
        self._statistics.flooded(flooded)
        for source, data in flooded.reports.items():
            self._take(source, data)

    def _take(self, source: int, data: bytes) -> None:
        try:
            report = decode_report(source, data, self._parameters.payload)
        except (ValueError, struct.error) as error:
            self._node.log(f"a report of node {source} that cannot be read: {error}")
            return
        knowledge = self._knowledge
        reach_m = knowledge.sensing_radius_m + knowledge.model.reach_m
        margin_m = rounding_m(knowledge.sensors_m.get(source, (0.0, 0.0)), self._parameters.payload, reach_m)
        if knowledge.is_possible(source, report.measurements_m, report.events, margin_m):
            events = tuple(self._events.get(event.event, event) for event in report.events)  # one's own are no hearsay
            self._reports[source] = replace(report, events=events)
        else:
            self._node.log(f"a report of node {source} that cannot be its own")

    def _answer_asks(self) -> Op[None]:
        while True:
            message = yield from self._node.receive(kinds={ASK})
            if message is not None and message.source in self._others and self._own is not None:
                self._node.spawn(self._answer(message, self._own))

    def _answer(self, question: Message, own: bytes) -> Op[None]:
        """The report asked for, at a random moment: one question has many answers."""
        yield from self._pause_before_speaking()
        self._node.send(question.source, REPORT, own, causes=[question])

    def _pause_before_speaking(self) -> Op[None]:
        target = self._parameters.target
        if target is not None and target.spread_s:
            yield from self._node.pause(int(self._node.rng("asking").random() * s_to_ns(target.spread_s)))

    def _serve(self) -> Op[None]:
        while True:
            message = yield from self._node.receive(kinds={FACTORS})
            if message is not None:
                self._factors.serve(message)

    def _known(self) -> KnownAssociation:
        events = {event.event: event for report in self._reports.values() for event in report.events}
        observers = {number: self._observers(event) for number, event in events.items()}
        return KnownAssociation.of(self._reports, observers, self._knowledge.model)

    def _observers(self, event: PredictedEvent) -> tuple[int, ...]:
        """All who may have a measurement of an event that one of them told of."""
        return self._knowledge.observers(event, rounding_m((event.x_m, event.y_m), self._parameters.payload))

    def _pairs(self, known: KnownAssociation) -> list[Pair]:
        """Gated pairs of the node's own measurements."""
        rows = [row for row, (owner, _) in enumerate(known.measurements) if owner == self._node.id]
        return [(row, vertex - known.graph.measurements) for row in rows for vertex in known.graph.neighbours(row)]

    def _grow(self, target: TargetParameters) -> Op[tuple[KnownAssociation, int]]:
        """Grow t by two, with what it takes to know, until every interval is narrow enough."""
        silent: set[int] = set()
        known, depth = self._known(), 0
        with self._node.task("association", allowance_j=target.allowance_j) as task:
            while depth < self._parameters.depth and not task.is_short:
                depth = min(depth + 2, self._parameters.depth)
                known = yield from self._ask_within(known, depth, target, silent, task)
                interval, pairs = DecayInterval(known.graph, known.incomplete), self._pairs(known)
                widths = [high - low for low, high in (interval.pair(j, k, depth) for j, k in pairs)]
                yield from charge(self._node, interval.operations)
                if max(widths, default=0.0) <= target.interval_width:
                    break
        return known, depth

    def _ask_within(
        self, known: KnownAssociation, depth: int, target: TargetParameters, silent: set[int], task: EnergyTask
    ) -> Op[KnownAssociation]:
        """Ask for what is missing of events within `depth` steps of the node's own measurements."""
        while True:
            near = {vertex for j, _ in self._pairs(known) for vertex in members(known.graph.ball(j, depth))}
            wanted = {
                observer
                for vertex in near & known.incomplete
                for observer in self._observers(known.events[vertex - known.graph.measurements])
            }
            missing = wanted - self._reports.keys() - silent
            if not missing:
                return known
            yield from self._ask(missing, target, task)
            silent |= missing - self._reports.keys()
            known = self._known()

    def _ask(self, missing: Iterable[int], target: TargetParameters, task: EnergyTask) -> Op[None]:
        """Ask sensors for their reports, those that do not answer again."""
        node, waiting = self._node, set(missing)
        for _ in range(target.ask_attempts):
            if not waiting or task.is_short:
                return
            yield from self._pause_before_speaking()
            node.multicast(sorted(waiting), ASK, b"", causes=())
            self._statistics.asked += len(waiting)
            end_ns = node.now_ns + s_to_ns(target.answer_s)
            while waiting and node.now_ns < end_ns:
                message = yield from node.receive(kinds={REPORT}, timeout_ns=end_ns - node.now_ns)
                if message is not None:
                    self._take(message.source, message.payload)
                    waiting.discard(message.source)

    def _estimates(
        self, known: KnownAssociation, pairs: Sequence[Pair], depth: int, names: Mapping[VertexName, int]
    ) -> Op[list[float]]:
        parameters, graph = self._parameters, known.graph
        if parameters.factors == "requests":
            return (yield from self._by_requests(known, pairs, depth, names))
        if parameters.estimator == "literal":
            listed = self._listed(known, pairs)
            found = [literal_pair(graph, j, k, depth, listed) for j, k in pairs]
        elif parameters.estimator == "two_factor":
            found = [two_factor_pair(graph, j, k, depth, parameters.side) for j, k in pairs]
        else:
            found = [normalised_pair(graph, j, k, depth, parameters.side) for j, k in pairs]
        yield from charge(self._node, graph.operations)
        return found

    def _listed(self, known: KnownAssociation, pairs: Sequence[Pair]) -> list[int]:
        """The list of vertices that both chains of a pair run over."""
        mine = {j for j, _ in pairs} | {known.graph.event(k) for _, k in pairs}
        order = vertex_order(known.graph, self._parameters.order)
        return [vertex for vertex in order if self._parameters.vertices == "known" or vertex in mine]

    def _by_requests(
        self, known: KnownAssociation, pairs: Sequence[Pair], depth: int, names: Mapping[VertexName, int]
    ) -> Op[list[float]]:
        """The literal estimator, each factor from the owner of its vertex (Algorithm 3, with Algorithm 4's requests)."""
        named, name_of = NamedGraph(known.graph, names), {vertex: name for name, vertex in names.items()}
        listed, found, whole = self._listed(known, pairs), [], None
        for j, k in pairs:
            chains = literal_chains(known.graph, j, k, listed)
            asked = [
                ([name_of[v] for v in sorted(chain.removed)], [name_of[v] for v in chain.vertices]) for chain in chains
            ]
            if whole is None:  # the same for all pairs
                whole = yield from self._factors.product(named, *asked[0], depth)
            rest = yield from self._factors.product(named, *asked[1], depth)
            found.append(literal_ratio(float(known.graph.weights[j, k]), whole, rest))
        return found


def _names(known: KnownAssociation) -> dict[VertexName, int]:
    """The vertices of the known graph by the names that all nodes share."""
    names = {VertexName(False, owner, number): row for row, (owner, number) in enumerate(known.measurements)}
    names.update(
        {VertexName(True, event.owner, event.event): known.graph.event(k) for k, event in enumerate(known.events)}
    )
    return names


def _narrowed_event(event: PredictedEvent, parameters: CorrelationDecayParameters) -> PredictedEvent:
    """An event where those see it who are told of it."""
    width = parameters.payload
    x_m, y_m = decode_floats(encode_floats((event.x_m, event.y_m), width), width).tolist()
    return replace(event, x_m=x_m, y_m=y_m)
