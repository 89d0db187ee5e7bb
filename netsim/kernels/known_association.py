"""The part of a data association graph that a node knows.

A node puts together reports of sensors: their gated measurements with all events these may be of. So a known measurement
has all its edges, but an event may have measurements of which no report came. What still holds then is in
`netsim.kernels.decay_interval`.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from netsim.kernels.correlation_decay import DecayGraph
from netsim.kernels.event_association import EventModel, MeasurementId, PredictedEvent
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, eq=False)
class SensorReport:
    """What a sensor tells of its measurements.

    Attributes:
        node: The sensor's node.
        numbers: Numbers of its gated measurements, ascending.
        measurements_m: Where they are, shape (n, 2).
        events: The events that they may be of, ascending.
    """

    node: int
    numbers: tuple[int, ...]
    measurements_m: FloatArray
    events: tuple[PredictedEvent, ...]


def report_of(
    node: int, measurements_m: FloatArray, events: Sequence[PredictedEvent], model: EventModel
) -> SensorReport:
    """What a sensor has to tell: measurements that may be of an event, and the events they may be of.

    Args:
        node: The sensor's node.
        measurements_m: All its measurements, shape (n, 2).
        events: All events it may have a measurement of, ascending.
        model: How events show.
    """
    weights = model.weights(measurements_m, _positions(events))
    rows = np.flatnonzero(weights.any(axis=1))
    columns = np.flatnonzero(weights.any(axis=0))
    return SensorReport(
        node, tuple(rows.tolist()), measurements_m[rows], tuple(events[column] for column in columns.tolist())
    )


def _reported(reports: Iterable[SensorReport], events: Sequence[PredictedEvent]) -> NDArray[np.bool_]:
    """Which measurements may be of which events as their sensors say, shape (N, K).

    Only where positions are narrowed on the air can a gate have more in it: what the sensor does not count, nobody does.
    """
    rows = [[event in report.events for event in events] for report in reports for _ in report.numbers]
    return np.array(rows, dtype=bool).reshape(len(rows), len(events))


def _positions(events: Iterable[PredictedEvent]) -> FloatArray:
    return np.array([(event.x_m, event.y_m) for event in events], dtype=float).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class KnownAssociation:
    """The graph that some reports make.

    Attributes:
        measurements: Its measurements, ascending.
        events: Its events, ascending.
        graph: The graph, in that order.
        incomplete: Its events, as vertices, of which measurements may be missing.
    """

    measurements: tuple[MeasurementId, ...]
    events: tuple[PredictedEvent, ...]
    graph: DecayGraph
    incomplete: frozenset[int]

    @staticmethod
    def of(
        reports: Mapping[int, SensorReport], observers: Mapping[int, Iterable[int]], model: EventModel
    ) -> "KnownAssociation":
        """Put reports together.

        Args:
            reports: By node; an empty one says that the sensor has no measurement of any event.
            observers: For every event in a report the sensors that may have a measurement of it.
            model: How events show.
        """
        ordered = [reports[node] for node in sorted(reports)]
        names = tuple((report.node, number) for report in ordered for number in report.numbers)
        points = [report.measurements_m for report in ordered if report.numbers]
        events = {event.event: event for report in ordered for event in report.events}
        listed = tuple(events[number] for number in sorted(events))
        weights = model.weights(np.concatenate(points) if points else np.empty((0, 2)), _positions(listed))
        graph = DecayGraph(np.where(_reported(ordered, listed), weights, 0.0))
        incomplete = frozenset(
            graph.event(column)
            for column, event in enumerate(listed)
            if not set(observers[event.event]) <= reports.keys()
        )
        return KnownAssociation(names, listed, graph, incomplete)

    @cached_property
    def vertex_of_measurement(self) -> Mapping[MeasurementId, int]:
        """Vertex of every measurement."""
        return {name: vertex for vertex, name in enumerate(self.measurements)}

    @cached_property
    def vertex_of_event(self) -> Mapping[int, int]:
        """Vertex of every event, by its number."""
        return {event.event: self.graph.event(column) for column, event in enumerate(self.events)}
