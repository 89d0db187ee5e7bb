"""Data association by correlation decay, distributed (Oh 2010, Algorithms 3 and 4).

Each sensor tells its gated measurements, with the events they may be of, within some hops; when its neighbours have told
theirs it computes the probabilities of its own pairs on what it knows, by itself or with the owners of the vertices, and the
intervals that its knowledge certifies.

What the processor is charged for: the recursions' sums and what estimates and intervals make of them (see
`DecayGraph.operations`, `DecayInterval.operations`), and weights of measurements and events, 20 operations each. Not
charged: encoding and decoding. A node whose energy allowance refuses what its own probabilities take states none; what
others wait for, and what it looks at on the way, is computed all the same (see `charging`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from netsim.algorithms.charging import charge
from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters
from netsim.algorithms.decay_asking import Asking, answer_all
from netsim.algorithms.decay_factors import FACTORS, Factors, NamedGraph
from netsim.algorithms.decay_payload import VertexName
from netsim.algorithms.decay_record import Statistics, record_pairs
from netsim.algorithms.decay_reports import HeardReports, Pair
from netsim.algorithms.patient_compute import compute_when_allowed
from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.errors import AlgorithmError
from netsim.kernels.correlation_decay import (
    literal_chains,
    literal_pair,
    literal_ratio,
    normalised_pair,
    two_factor_pair,
    vertex_order,
)
from netsim.kernels.decay_interval import DecayInterval
from netsim.kernels.event_association import EventAssociationKnowledge
from netsim.kernels.known_association import KnownAssociation
from netsim.protocols.flood_rounds import FloodRounds, FloodSettings
from netsim.units import s_to_ns

FLOOD = "measurements"
_RATIO_OPERATIONS = 2


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
        self._heard = HeardReports(node, knowledge, parameters.payload)
        self._others = knowledge.sensors_m.keys() - {node.id}
        self._factors = Factors(node, self._others, s_to_ns(parameters.request_s), parameters.request_attempts)
        self._statistics = Statistics()

    def run(self) -> Op[None]:
        node, parameters = self._node, self._parameters
        node.spawn(self._serve())
        own = yield from self._measure()
        if own is not None:
            node.spawn(answer_all(node, self._others, own, parameters.target))
        yield from self._flood(own)
        known, depth = self._heard.known(), parameters.depth
        if parameters.target is not None:
            grown = yield from Asking(node, self._heard, parameters, parameters.target, self._statistics).grow()
            known, depth = grown.known, grown.depth
        yield from charge(node, self._heard.operations())
        names = _names(known)
        self._factors.begin(NamedGraph(known.graph, names))
        pairs = self._heard.own_pairs(known)
        estimates = yield from self._estimates(known, pairs, depth, names)
        interval = DecayInterval(known.graph, known.incomplete)
        bounds = [interval.pair(j, k, depth) for j, k in pairs]
        if parameters.target is not None:
            estimates = [min(max(p, low), high) for p, (low, high) in zip(estimates, bounds, strict=True)]
        if (yield from self._is_computed(known, interval)):
            record_pairs(node, self._knowledge.first_variable, known, pairs, estimates, bounds, depth)
        yield from node.pause_until(s_to_ns(parameters.until_s))
        self._statistics.record(node, self._factors, known, pairs)

    def _is_computed(self, known: KnownAssociation, interval: DecayInterval) -> Op[bool]:
        """Charge what is to be stated; what the energy allowance refuses until the end is not stated."""
        factors = known.graph.operations if self._parameters.factors == "local" else 0
        operations = factors + interval.operations
        if (yield from compute_when_allowed(self._node, operations, s_to_ns(self._parameters.until_s))):
            return True
        self._node.log("too little energy to compute probabilities: none are stated")
        return False

    def _measure(self) -> Op[bytes | None]:
        """The report to tell; None if there was no energy to measure, which is not a report of no measurement."""
        try:
            observation = yield from self._node.sense()
        except NoEnergyError:
            return None
        return self._heard.measured(np.asarray(observation.values, dtype=float))

    def _flood(self, own: bytes | None) -> Op[None]:
        flood, knowledge = self._parameters.flood, self._knowledge
        partners = knowledge.sensing_neighbours if flood.graph == "sensing" else knowledge.overlay_neighbours
        settings = FloodSettings(flood.hops, s_to_ns(flood.round_s), flood.attempts, s_to_ns(flood.spread_s))
        flooded = yield from FloodRounds(self._node, FLOOD, partners, settings).run(own)
        self._statistics.flooded(flooded)
        for source, data in flooded.reports.items():
            self._heard.take(source, data)

    def _serve(self) -> Op[None]:
        while True:
            message = yield from self._node.receive(kinds={FACTORS})
            if message is not None:
                self._factors.serve(message)

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
        yield from charge(self._node, _RATIO_OPERATIONS * len(found))
        return found


def _names(known: KnownAssociation) -> dict[VertexName, int]:
    """The vertices of the known graph by the names that all nodes share."""
    names = {VertexName(False, owner, number): row for row, (owner, number) in enumerate(known.measurements)}
    names.update(
        {VertexName(True, event.owner, event.event): known.graph.event(k) for k, event in enumerate(known.events)}
    )
    return names
