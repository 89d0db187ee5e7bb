"""The part of a data association graph that a node knows, and what that part still certifies.

A node puts together reports of sensors: their gated measurements with all events these may be of. So a known measurement
has all its edges, but an event may have measurements of which no report came. Bounds that hold whatever is missing follow
from the recursion of Oh 2010, eq 13, taken for both ends of an interval:

    upper(u, t) = 1 / (1 + sum_v w_uv lower(v, t - 1)),   lower(u, t) = 1 / (1 + sum_v w_uv upper(v, t - 1)),

with upper(., 0) = 1 and lower(., 0) = 0; and lower(u, .) = 0 where u may have edges that are not known, as every further
edge makes Phi smaller and nothing bounds their number. Where everything is known these are Phi at the last even and odd
depths.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from netsim.kernels.correlation_decay import DecayGraph, mask
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
        graph = DecayGraph(weights)
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


class DecayInterval:
    """Bounds on association probabilities that hold whatever the missing edges are.

    Args:
        graph: What is known.
        incomplete: Vertices that may have edges which are not in it.
    """

    def __init__(self, graph: DecayGraph, incomplete: Iterable[int] = ()) -> None:
        self._graph = graph
        self._incomplete = frozenset(incomplete)
        self._known: dict[tuple[int, int, int], tuple[float, float]] = {}
        self.operations = 0
        """Elementary operations so far: six for every term of a sum that was not known yet, four for every sum."""

    def factor(self, vertex: int, depth: int, removed: int = 0) -> tuple[float, float]:
        """Lower and upper bound of P_{G without removed}(the vertex is in no pair).

        Args:
            vertex: Not in `removed`.
            depth: t, at least 0.
            removed: Missing vertices, as bits (see `correlation_decay.mask`).
        """
        if depth == 0:
            return 0.0, 1.0
        key = vertex, depth, removed & self._graph.ball(vertex, depth)
        if key not in self._known:
            self._known[key] = self._computed(vertex, depth, removed)
        return self._known[key]

    def _computed(self, vertex: int, depth: int, removed: int) -> tuple[float, float]:
        low_total = high_total = 1.0
        without = removed | 1 << vertex
        self.operations += 4
        for other, weight in self._graph.edges(vertex):
            if not without >> other & 1:
                low, high = self.factor(other, depth - 1, without)
                low_total += weight * low
                high_total += weight * high
                self.operations += 6
        lower = 0.0 if vertex in self._incomplete else 1.0 / high_total
        return lower, 1.0 / low_total

    def pair(self, measurement: int, event: int, depth: int) -> tuple[float, float]:
        """Bounds of the pair's probability, from either end; the better ones count.

        beta_uv = w_uv P(v) / (1 + sum_v' w_uv' P(v')), P(v) = P_{G without u}(v is in no pair), rises with P(v) and
        falls with all the others. It is never wider than the two-factor form w_uv Phi_G(u, t + 1) Phi_{G without u}(v, t),
        in which P(v) appears twice.

        Args:
            measurement: Row of the weights.
            event: Column of the weights.
            depth: t of the factors, at least 1.
        """
        ends = measurement, self._graph.event(event)
        bounds = [self._from_end(u, v, depth) for u, v in (ends, ends[::-1])]
        return max(low for low, _ in bounds), min(high for _, high in bounds)

    def _from_end(self, u: int, v: int, depth: int) -> tuple[float, float]:
        """The bounds with u as the vertex whose pairs exclude each other."""
        removed = mask((u,))
        own_low = own_high = others_low = others_high = 0.0
        for other, weight in self._graph.edges(u):
            low, high = self.factor(other, depth, removed)
            if other == v:
                own_low, own_high = weight * low, weight * high
            else:
                others_low, others_high = others_low + weight * low, others_high + weight * high
        lower = 0.0 if u in self._incomplete else own_low / (1.0 + own_low + others_high)
        return lower, own_high / (1.0 + own_high + others_low)
