"""Data association by correlation decay, distributed (Oh 2010, Algorithms 3 and 4).

Each sensor tells its gated measurements, with the events they may be of, within some hops; when its neighbours have told
theirs it computes the probabilities of its own pairs on what it knows, by itself or with the owners of the vertices, and the
intervals that its knowledge certifies.

What the processor is charged for: the recursions' sums (see `DecayGraph.operations`, `DecayInterval.operations`) and the
weights of the pairs it knows, 20 operations each. Not charged: encoding and decoding.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters, TargetParameters
from netsim.algorithms.decay_factors import FACTORS, Factors, NamedGraph, charge
from netsim.algorithms.decay_payload import VertexName, decode_report, encode_report, narrowed
from netsim.algorithms.decay_record import Statistics, record_pairs
from netsim.api import NodeHandle, NoEnergyError, Op
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
from netsim.kernels.event_association import EventAssociationKnowledge, PredictedEvent
from netsim.kernels.known_association import DecayInterval, KnownAssociation, SensorReport, report_of
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
        self._own = b""
        self._statistics = Statistics()

    def run(self) -> Op[None]:
        node, parameters = self._node, self._parameters
        yield from self._measure()
        yield from self._flood()
        node.spawn(self._answer_asks())
        if parameters.target is not None:
            known, depth = yield from self._grow(parameters.target)
        else:
            known, depth = self._known(), parameters.depth
        names = _names(known)
        factors = Factors(node, NamedGraph(known.graph, names), depth, s_to_ns(parameters.request_s))
        node.spawn(_serve(node, factors))
        pairs = self._pairs(known)
        estimates = yield from self._estimates(known, pairs, depth, factors, {v: name for name, v in names.items()})
        interval = DecayInterval(known.graph, known.incomplete)
        bounds = [interval.pair(j, k, depth) for j, k in pairs]
        yield from charge(node, interval.operations + _WEIGHT_OPERATIONS * known.graph.weights.size)
        record_pairs(node, self._knowledge.first_variable, known, pairs, estimates, bounds, depth)
        yield from node.pause_until(s_to_ns(parameters.until_s))
        self._statistics.record(node, factors, known, pairs)

    def _measure(self) -> Op[None]:
        node, width = self._node, self._parameters.payload
        try:
            observation = yield from node.sense()
            points_m = narrowed(np.asarray(observation.values, dtype=float), width)
        except NoEnergyError:
            points_m = np.empty((0, 2))
        events = [_narrowed_event(event, self._parameters) for event in self._knowledge.events]
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
        self._reports[source] = decode_report(source, data, self._parameters.payload)

    def _answer_asks(self) -> Op[None]:
        while True:
            message = yield from self._node.receive(kinds={ASK})
            if message is not None:
                self._node.send(message.source, REPORT, self._own, causes=[message])

    def _known(self) -> KnownAssociation:
        events = {event.event: event for report in self._reports.values() for event in report.events}
        observers = {number: self._knowledge.observers(event) for number, event in events.items()}
        return KnownAssociation.of(self._reports, observers, self._knowledge.model)

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
                known = yield from self._ask_within(known, depth, target, silent)
                interval, pairs = DecayInterval(known.graph, known.incomplete), self._pairs(known)
                widths = [high - low for low, high in (interval.pair(j, k, depth) for j, k in pairs)]
                yield from charge(self._node, interval.operations)
                if max(widths, default=0.0) <= target.interval_width:
                    break
        return known, depth

    def _ask_within(
        self, known: KnownAssociation, depth: int, target: TargetParameters, silent: set[int]
    ) -> Op[KnownAssociation]:
        """Ask for what is missing of events less than `depth` steps from the node's own measurements."""
        while True:
            near = {vertex for j, _ in self._pairs(known) for vertex in members(known.graph.ball(j, depth - 1))}
            wanted = {
                observer
                for vertex in near & known.incomplete
                for observer in self._knowledge.observers(known.events[vertex - known.graph.measurements])
            }
            missing = wanted - self._reports.keys() - silent
            if not missing:
                return known
            yield from self._ask(missing, target)
            silent |= missing - self._reports.keys()
            known = self._known()

    def _ask(self, missing: Iterable[int], target: TargetParameters) -> Op[None]:
        """Ask sensors for their reports, those that do not answer again."""
        node, waiting = self._node, set(missing)
        for _ in range(target.ask_attempts):
            node.multicast(sorted(waiting), ASK, b"", causes=())
            self._statistics.asked += len(waiting)
            end_ns = node.now_ns + s_to_ns(target.answer_s)
            while waiting and node.now_ns < end_ns:
                message = yield from node.receive(kinds={REPORT}, timeout_ns=end_ns - node.now_ns)
                if message is not None:
                    self._take(message.source, message.payload)
                    waiting.discard(message.source)
            if not waiting:
                return

    def _estimates(
        self,
        known: KnownAssociation,
        pairs: Sequence[Pair],
        depth: int,
        factors: Factors,
        name_of: dict[int, VertexName],
    ) -> Op[list[float]]:
        parameters, graph = self._parameters, known.graph
        if parameters.factors == "requests":
            return (yield from _by_requests(known, pairs, self._listed(known, pairs), factors, name_of))
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
    known: KnownAssociation,
    pairs: Sequence[Pair],
    listed: Sequence[int],
    factors: Factors,
    name_of: dict[int, VertexName],
) -> Op[list[float]]:
    """The literal estimator, with each factor from the owner of its vertex (Algorithm 3, with Algorithm 4's requests)."""
    found, whole = [], None
    for j, k in pairs:
        with_pair, without_pair = literal_chains(known.graph, j, k, listed)
        if whole is None:  # the same for all pairs
            whole = yield from factors.product((), [name_of[vertex] for vertex in with_pair.vertices])
        rest = yield from factors.product(
            [name_of[vertex] for vertex in sorted(without_pair.removed)],
            [name_of[vertex] for vertex in without_pair.vertices],
        )
        found.append(literal_ratio(float(known.graph.weights[j, k]), whole, rest))
    return found


def _names(known: KnownAssociation) -> dict[VertexName, int]:
    """The vertices of the known graph by the names that all nodes share."""
    names = {VertexName(False, owner, number): row for row, (owner, number) in enumerate(known.measurements)}
    names.update(
        {VertexName(True, event.owner, event.event): known.graph.event(k) for k, event in enumerate(known.events)}
    )
    return names


def _serve(node: NodeHandle, factors: Factors) -> Op[None]:
    while True:
        message = yield from node.receive(kinds={FACTORS})
        if message is not None:
            factors.serve(message)


def _narrowed_event(event: PredictedEvent, parameters: CorrelationDecayParameters) -> PredictedEvent:
    """An event where those see it who are told of it."""
    width = parameters.payload
    x_m, y_m = decode_floats(encode_floats((event.x_m, event.y_m), width), width).tolist()
    return replace(event, x_m=x_m, y_m=y_m)
