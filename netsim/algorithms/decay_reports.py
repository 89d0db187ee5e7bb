"""The reports that a correlation-decay sensor has, its own and others', and the graph that they make."""

import struct
from collections.abc import Iterable, Set
from dataclasses import replace

import numpy as np

from netsim.algorithms.decay_payload import decode_report, encode_report, narrowed, rounding_m
from netsim.api import NodeHandle
from netsim.codec import FloatWidth
from netsim.kernels.correlation_decay import members
from netsim.kernels.event_association import EventAssociationKnowledge, PredictedEvent
from netsim.kernels.known_association import KnownAssociation, SensorReport, report_of
from netsim.kernels.semiring import FloatArray

_WEIGHT_OPERATIONS = 20

Pair = tuple[int, int]
"""Measurement and event, as row and column of the known graph."""


class HeardReports:
    """What a node knows of the sensors' measurements.

    Args:
        node: The node.
        knowledge: What it knew before.
        width: Precision of positions on the air.
    """

    def __init__(self, node: NodeHandle, knowledge: EventAssociationKnowledge, width: FloatWidth) -> None:
        self._node, self._knowledge, self._width = node, knowledge, width
        self._reports: dict[int, SensorReport] = {}
        self._events: dict[int, PredictedEvent] = {}
        self._known: KnownAssociation | None = None
        self._weighed = 0
        self._operations = 0

    @property
    def sensors(self) -> Set[int]:
        """Sensors of which there is a report."""
        return self._reports.keys()

    def measured(self, points_m: FloatArray) -> bytes:
        """Take the node's own measurements, shape (n, 2).

        Returns:
            The report to tell others.
        """
        points_m, events = narrowed(points_m, self._width), [self._narrowed(each) for each in self._knowledge.events]
        self._events = {event.event: event for event in events}
        self._known = None
        report = self._reports[self._node.id] = report_of(self._node.id, points_m, events, self._knowledge.model)
        self._operations += _WEIGHT_OPERATIONS * len(points_m) * len(events)
        self._weighed = len(report.numbers) * len(report.events)
        return encode_report(report, self._width)

    def _narrowed(self, event: PredictedEvent) -> PredictedEvent:
        """An event where those see it who are told of it."""
        ((x_m, y_m),) = narrowed(np.array([(event.x_m, event.y_m)]), self._width).tolist()
        return replace(event, x_m=x_m, y_m=y_m)

    def take(self, source: int, data: bytes) -> None:
        """Take a sensor's report, if it can be read and can be that sensor's."""
        try:
            report = decode_report(source, data, self._width)
        except (ValueError, struct.error) as error:
            self._node.log(f"a report of node {source} that cannot be read: {error}")
            return
        knowledge = self._knowledge
        reach_m = knowledge.sensing_radius_m + knowledge.model.reach_m
        margin_m = rounding_m(knowledge.sensors_m.get(source, (0.0, 0.0)), self._width, reach_m)
        if knowledge.is_possible(source, report.measurements_m, report.events, margin_m):
            events = tuple(self._events.get(event.event, event) for event in report.events)  # one's own are no hearsay
            self._reports[source], self._known = replace(report, events=events), None
        else:
            self._node.log(f"a report of node {source} that cannot be its own")

    def known(self) -> KnownAssociation:
        """The graph that the reports make."""
        if self._known is None:
            events = {event.event: event for report in self._reports.values() for event in report.events}
            observers = {number: self.observers(event) for number, event in events.items()}
            self._known = KnownAssociation.of(self._reports, observers, self._knowledge.model)
            new = max(0, self._known.graph.weights.size - self._weighed)
            self._weighed += new
            self._operations += _WEIGHT_OPERATIONS * new
        return self._known

    def operations(self) -> int:
        """Elementary operations for weights since this was asked last: 20 for a measurement and an event, once."""
        spent, self._operations = self._operations, 0
        return spent

    def observers(self, event: PredictedEvent) -> tuple[int, ...]:
        """All who may have a measurement of an event that one of them told of."""
        return self._knowledge.observers(event, rounding_m((event.x_m, event.y_m), self._width))

    def own_pairs(self, known: KnownAssociation) -> list[Pair]:
        """Gated pairs of the node's own measurements."""
        rows = [row for row, (owner, _) in enumerate(known.measurements) if owner == self._node.id]
        return [(row, vertex - known.graph.measurements) for row in rows for vertex in known.graph.neighbours(row)]

    def missing(self, known: KnownAssociation, vertices: Iterable[int]) -> dict[int, set[int]]:
        """Sensors that may have measurements of events and of which there is no report.

        Args:
            known: The graph.
            vertices: Some of it.

        Returns:
            By the vertex of an event; whole events are left out.
        """
        return {
            vertex: set(self.observers(known.events[vertex - known.graph.measurements])) - self._reports.keys()
            for vertex in known.incomplete.intersection(vertices)
        }

    def near(self, known: KnownAssociation, depth: int) -> set[int]:
        """Vertices within `depth` steps of the node's own measurements that are of a pair."""
        return {vertex for j, _ in self.own_pairs(known) for vertex in members(known.graph.ball(j, depth))}
