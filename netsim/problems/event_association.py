"""Which measurement is of which event (Oh 2010, section VI): sensors share out the measurements of a few predicted events.

A sensor measures what lies in its disc; where discs overlap, one sensor owns the measurement.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Lt, MinLen
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.kernels.event_association import (
    EventAssociationInstance,
    EventAssociationKnowledge,
    EventModel,
    PredictedEvent,
)
from netsim.kernels.semiring import FloatArray
from netsim.parameters import NonNegativeInt, PointM, Positive, PositiveInt, parameters
from netsim.problems.problem import placement
from netsim.rng import Streams
from netsim.trace.events import Event, TruthTargets, VariablePlacement

Box = tuple[float, float, float, float]
_ATTEMPTS = 10_000
PlacesM = Mapping[int, PointM]


@parameters
class DrawnEvents:
    """Predicted events anywhere in the field, independently."""

    type: Literal["uniform"] = "uniform"
    """Kind of events."""
    count: PositiveInt = 10
    """How many."""


@parameters
class ListedEvents:
    """Predicted events at given places."""

    type: Literal["listed"] = "listed"
    """Kind of events."""
    positions_m: Annotated[tuple[PointM, ...], MinLen(1)]
    """Predicted measurements, one an event."""


@parameters
class UniformMeasurements:
    """A given number of measurements anywhere in the sensors' discs, whatever the events are, as in the paper's figures."""

    type: Literal["uniform"] = "uniform"
    """Kind of measurements."""
    count: NonNegativeInt = 40
    """How many."""


@parameters
class GeneratedMeasurements:
    """Measurements as the model has them: of each event with the chance of detection, and false ones over the field.

    An event's true position is drawn around the predicted one; its measurement lies between. Those that no sensor covers
    are not seen.
    """

    type: Literal["generated"] = "generated"
    """Kind of measurements."""
    noise_share: Annotated[float, Ge(0), Lt(1)] = 0.5
    """Share of the covariance that is noise of the measurement; the rest is how far the event is from its prediction."""


@parameters
class EventAssociationParameters:
    """Measurement-to-event association: the probability that each measurement is of each predicted event."""

    type: Literal["event-association"] = "event-association"
    """Kind of problem."""
    events: DrawnEvents | ListedEvents = DrawnEvents()
    """Where events are predicted."""
    measurements: UniformMeasurements | GeneratedMeasurements = UniformMeasurements()
    """Where measurements are."""
    sensing_radius_m: Positive = 8.0
    """Radius of every sensor's disc."""
    covariance_m2: tuple[float, float, float] = (100.0, 0.0, 100.0)
    """Covariance of a measurement around its event's predicted one: xx, xy, yy."""
    gate: Positive = 4.0
    """A measurement can be of an event if its squared Mahalanobis distance from the prediction is below this."""
    detection_probability: Annotated[Positive, Lt(1)] = 0.8
    """Chance that an event has a measurement."""
    false_alarm_density_per_m2: Positive = 1e-5
    """Mean number of false measurements per area; the sensors compute with it."""
    ownership: Literal["nearest", "random"] = "nearest"
    """Which of the sensors whose discs a measurement lies in owns it."""
    event_ownership: Literal["nearest", "random"] = "nearest"
    """Which sensor answers for an event, agreed on before anybody measures: the nearest to its prediction, or any that may
    have a measurement of it (the nearest where none may)."""

    def __post_init__(self) -> None:
        """Refuse what is no covariance."""
        xx, xy, yy = self.covariance_m2
        if not (xx > 0 and yy > 0 and xx * yy > xy * xy):
            message = "covariance_m2 positive definite: xx and yy above 0, xx yy above xy^2"
            raise ValueError(message)

    @property
    def model(self) -> EventModel:
        """What the sensors know of it."""
        return EventModel(self.covariance_m2, self.gate, self.detection_probability, self.false_alarm_density_per_m2)


@dataclass(frozen=True, eq=False)
class EventAssociationProblem:
    """A problem with its truth.

    Attributes:
        instance: What is known to all together.
        sensors_m: Where the sensors are, by node id.
        radius_m: Of every sensor's disc.
        true_m: True positions of the events where they have any, shape (K, 2) or (0, 2).
    """

    instance: EventAssociationInstance
    sensors_m: PlacesM
    radius_m: float
    true_m: FloatArray

    @property
    def kind(self) -> str:
        """`event-association`."""
        return "event-association"

    def instance_json(self) -> str:
        """The instance; read it with `EventAssociationInstance.from_json`."""
        return self.instance.to_json()

    def knowledge(self, node: int) -> EventAssociationKnowledge | None:
        """What a node knows before it measures; None for a node without a sensor."""
        if node not in self.sensors_m:
            return None
        is_near = self._is_near
        own = is_near[list(self.sensors_m).index(node)]
        sharing = (is_near & own).any(axis=1)
        overlapping = self._sensors_within(node, 2 * self.radius_m)
        return EventAssociationKnowledge(
            node=node,
            first_variable=self.instance.owners.index(node) if node in self.instance.owners else 0,
            model=self.instance.model,
            events=tuple(event for event, near in zip(self.instance.events, own.tolist(), strict=True) if near),
            sensing_radius_m=self.radius_m,
            sensors_m=self.sensors_m,
            sensing_neighbours=overlapping,
            overlay_neighbours=tuple(
                sorted(other for other, shares in zip(self.sensors_m, sharing, strict=True) if shares and other != node)
            ),
        )

    def later_truth(self, end_ns: int) -> Sequence[tuple[int, Event]]:
        """Nothing: the truth stays as it is."""
        return ()

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """The measurements that a node's sensor owns, shape (n, 2).

        Raises:
            ScenarioError: When the node has no sensor.
        """
        if node not in self.sensors_m:
            text = f"node {node} has no sensor to observe with"
            raise ScenarioError(text)
        return np.array(self.instance.measurements_m[np.array(self.instance.owners, dtype=int) == node])

    def truth_events(self) -> Sequence[Event]:
        """True positions of the events, where there are any."""
        if not len(self.true_m):
            return []
        x_m, y_m = self.true_m.T.tolist()
        return [TruthTargets(list(range(len(x_m))), x_m, y_m)]

    def placement_event(self) -> VariablePlacement:
        """Measurements on their owners, events on theirs, and an edge for every gated pair."""
        count = len(self.instance.owners)
        hosts = dict(enumerate(self.instance.owners))
        hosts.update({count + event.event: event.owner for event in self.instance.events})
        names = {number: f"measurement {number}" for number in range(count)}
        names.update({count + event.event: f"event {event.event}" for event in self.instance.events})
        rows, columns = np.nonzero(self.instance.weights)
        return placement(hosts, names, [(int(j), count + int(k)) for j, k in zip(rows, columns, strict=True)])

    @cached_property
    def _is_near(self) -> NDArray[np.bool_]:
        """Whether a sensor may have a measurement of an event, shape (sensors, events)."""
        reach_m = self.radius_m + self.instance.model.reach_m
        distances_m = _distances(self.instance.predicted_m, self.sensors_m).T
        return np.asarray(distances_m < reach_m)

    def _sensors_within(self, node: int, distance_m: float) -> tuple[int, ...]:
        offsets_m = np.array(list(self.sensors_m.values())) - np.asarray(self.sensors_m[node])
        is_within = np.hypot(*offsets_m.T) < distance_m
        others = zip(self.sensors_m, is_within.tolist(), strict=True)
        return tuple(sorted(other for other, within in others if within and other != node))


def build(
    parameters: EventAssociationParameters, sensors_m: PlacesM, field_m: Box, streams: Streams
) -> EventAssociationProblem:
    """Draw a problem.

    Events come from the stream `world/events`, measurements from `world/measurements`, and who owns them, where that is
    random, from the streams `owners` under these.

    Args:
        parameters: What to draw.
        sensors_m: Where the nodes with a sensor are.
        field_m: The field.
        streams: The run's random streams.

    Raises:
        ScenarioError: When there is no sensor, or the sensors cover almost nothing of the field.
    """
    if not sensors_m:
        text = "no node has a sensor, so nothing is measured"
        raise ScenarioError(text)
    events_m = _events(parameters.events, field_m, streams)
    places = {node: sensors_m[node] for node in sorted(sensors_m)}
    points_m, true_m = _measurements(parameters, places, events_m, field_m, streams)
    owners = _owners(parameters, places, points_m, streams)
    order = np.lexsort((np.arange(len(owners)), owners))
    points_m, owners = points_m[order], owners[order]
    events = _owned_events(parameters, places, events_m, streams)
    instance = EventAssociationInstance(tuple(owners.tolist()), points_m, events, parameters.model)
    return EventAssociationProblem(instance, places, parameters.sensing_radius_m, true_m)


def _events(parameters: DrawnEvents | ListedEvents, field_m: Box, streams: Streams) -> FloatArray:
    if isinstance(parameters, ListedEvents):
        return np.array(parameters.positions_m, dtype=float)
    return _uniform(parameters.count, field_m, streams.generator("world/events"))


def _uniform(count: int, field_m: Box, rng: np.random.Generator) -> FloatArray:
    return np.asarray(rng.uniform(field_m[:2], field_m[2:], (count, 2)))


def _distances(points_m: FloatArray, places: PlacesM) -> FloatArray:
    """Of points from sensors, shape (points, sensors)."""
    offsets = points_m[:, None, :] - np.array(list(places.values()), dtype=float)[None, :, :]
    return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]))


def _measurements(
    parameters: EventAssociationParameters, places: PlacesM, events_m: FloatArray, field_m: Box, streams: Streams
) -> tuple[FloatArray, FloatArray]:
    """Measurements that some sensor covers, shape (N, 2), and the events' true positions."""
    rng = streams.generator("world/measurements")

    def seen(points_m: FloatArray) -> FloatArray:
        return np.asarray(points_m[_distances(points_m, places).min(axis=1) <= parameters.sensing_radius_m])

    if isinstance(parameters.measurements, UniformMeasurements):
        found, count = np.empty((0, 2)), parameters.measurements.count
        for _ in range(_ATTEMPTS):
            if len(found) >= count:
                return found[:count], np.empty((0, 2))
            found = np.concatenate([found, seen(_uniform(count, field_m, rng))])
        text = "the sensors cover almost nothing of the field: enlarge sensing_radius_m, or the number of sensors"
        raise ScenarioError(text)
    shape = np.linalg.cholesky(parameters.model.covariance)
    noise_share = parameters.measurements.noise_share
    drift, noise = rng.standard_normal((2, len(events_m), 2))
    true_m = events_m + np.sqrt(1 - noise_share) * drift @ shape.T
    is_detected = rng.random(len(events_m)) < parameters.detection_probability
    of_events = (true_m + np.sqrt(noise_share) * noise @ shape.T)[is_detected]
    area_m2 = (field_m[2] - field_m[0]) * (field_m[3] - field_m[1])
    false = _uniform(int(rng.poisson(parameters.false_alarm_density_per_m2 * area_m2)), field_m, rng)
    return seen(np.concatenate([of_events, false])), true_m


def _owners(
    parameters: EventAssociationParameters, places: PlacesM, points_m: FloatArray, streams: Streams
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    distances = _distances(points_m, places)
    if parameters.ownership == "random":
        lots = streams.generator("world/measurements/owners").random(distances.shape)
        distances = np.where(distances <= parameters.sensing_radius_m, lots, np.inf)
    return np.asarray(np.array(list(places), dtype=np.int64)[distances.argmin(axis=1)])


def _owned_events(
    parameters: EventAssociationParameters, places: PlacesM, events_m: FloatArray, streams: Streams
) -> tuple[PredictedEvent, ...]:
    nodes, distances = list(places), _distances(events_m, places)
    if parameters.event_ownership == "random":
        lots = streams.generator("world/events/owners").random(distances.shape)
        may_see = distances < parameters.sensing_radius_m + parameters.model.reach_m
        distances = np.where(may_see, lots - 1.0, distances)
    owners = [nodes[index] for index in distances.argmin(axis=1).tolist()]
    places_m = zip(owners, events_m.tolist(), strict=True)
    return tuple(PredictedEvent(event, owner, x_m, y_m) for event, (owner, (x_m, y_m)) in enumerate(places_m))
