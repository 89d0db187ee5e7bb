"""Records of measurement-to-event association (Oh 2010): what a node knows of it, and the whole of it.

A measurement is named by the node that owns it and its number there, an event by its number. Both orders are the same
everywhere, so that sums over neighbours have the same order wherever they are computed.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from netsim.kernels.event_gating import gated_weights
from netsim.kernels.semiring import FloatArray

MeasurementId = tuple[int, int]
"""Owner's node id and the measurement's number there."""


@dataclass(frozen=True, slots=True)
class EventModel:
    """How events show in measurements, the same for all sensors.

    Attributes:
        covariance_m2: Of a measurement around the predicted one of its event: xx, xy, yy.
        gate: Squared Mahalanobis distance below which a measurement can be of an event.
        detection_probability: Chance that an event has a measurement.
        false_alarm_density_per_m2: Mean number of false measurements per area.
    """

    covariance_m2: tuple[float, float, float]
    gate: float
    detection_probability: float
    false_alarm_density_per_m2: float

    @property
    def covariance(self) -> FloatArray:
        """The covariance as a matrix, shape (2, 2), m^2."""
        xx, xy, yy = self.covariance_m2
        return np.array([[xx, xy], [xy, yy]])

    @property
    def reach_m(self) -> float:
        """No measurement farther from an event's predicted position than this can be of it."""
        return float(np.sqrt(self.gate * np.linalg.eigvalsh(self.covariance)[-1]))

    def weights(self, measurements_m: FloatArray, predicted_m: FloatArray) -> FloatArray:
        """Alpha L_jk of every gated pair, zero for others, shape (N, K) (Oh 2010, eq 8)."""
        return gated_weights(
            measurements_m,
            predicted_m,
            self.covariance,
            self.gate,
            self.detection_probability,
            self.false_alarm_density_per_m2,
        )


@dataclass(frozen=True, slots=True)
class PredictedEvent:
    """Where an event is expected to show.

    Attributes:
        event: Its number.
        owner: Node that answers for it.
        x_m: Predicted measurement.
        y_m: Predicted measurement.
    """

    event: int
    owner: int
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class EventAssociationKnowledge:
    """What a sensor's node legitimately knows before it measures.

    Attributes:
        node: Its node id.
        first_variable: Number of its first measurement among all, a label for the trace.
        model: How events show.
        events: Predicted events of which it may have a measurement: their gates meet its sensing disc. Ascending.
        sensing_radius_m: Radius of every sensor's disc.
        sensors_m: The deployment plan: where the sensors are, by node id.
        sensing_neighbours: Sensors whose discs overlap its own, ascending.
        overlay_neighbours: Sensors that may have a measurement of an event of which it may have one, ascending.
    """

    node: int
    first_variable: int
    model: EventModel
    events: tuple[PredictedEvent, ...]
    sensing_radius_m: float
    sensors_m: Mapping[int, tuple[float, float]]
    sensing_neighbours: tuple[int, ...]
    overlay_neighbours: tuple[int, ...]

    def observers(self, event: PredictedEvent) -> tuple[int, ...]:
        """Sensors that may have a measurement of an event, ascending."""
        reach_m = self.sensing_radius_m + self.model.reach_m
        return tuple(
            node
            for node, (x_m, y_m) in sorted(self.sensors_m.items())
            if (x_m - event.x_m) ** 2 + (y_m - event.y_m) ** 2 < reach_m**2
        )


@dataclass(frozen=True, eq=False)
class EventAssociationInstance:
    """A whole problem without its truth.

    Attributes:
        owners: Node that owns each measurement, ascending, shape (N,).
        measurements_m: Shape (N, 2).
        events: All events, ascending.
        model: How events show.
    """

    owners: tuple[int, ...]
    measurements_m: FloatArray
    events: tuple[PredictedEvent, ...]
    model: EventModel

    @property
    def predicted_m(self) -> FloatArray:
        """Predicted measurements of the events, shape (K, 2)."""
        return np.array([(event.x_m, event.y_m) for event in self.events], dtype=float).reshape(-1, 2)

    @property
    def weights(self) -> FloatArray:
        """Alpha L_jk, shape (N, K)."""
        return self.model.weights(self.measurements_m, self.predicted_m)

    def to_json(self) -> str:
        """The instance as JSON; floats survive the round trip bit for bit."""
        content = {
            "owners": self.owners,
            "measurements_m": self.measurements_m.tolist(),
            "events": [asdict(event) for event in self.events],
            "model": asdict(self.model),
        }
        return json.dumps(content, allow_nan=False)

    @staticmethod
    def from_json(text: str) -> "EventAssociationInstance":
        """The inverse of `to_json`."""
        content = json.loads(text)
        model = content["model"]
        return EventAssociationInstance(
            owners=tuple(content["owners"]),
            measurements_m=np.array(content["measurements_m"], dtype=float).reshape(-1, 2),
            events=tuple(PredictedEvent(**fields) for fields in content["events"]),
            model=EventModel(**{**model, "covariance_m2": tuple(model["covariance_m2"])}),
        )
