"""Records of the data-association problem: what a node knows of it, and the whole of it.

Sensors are numbered 0 .. N-1 in ascending order of their node ids; that number is also the id of the sensor's vertex.
Targets are numbered 0 .. M-1; target t has a vertex of its own, N + t, when three or more sensors cover it.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from netsim.kernels.semiring import FloatArray

FalseAlarms = Literal["strict", "geometric"]
Matrix2 = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class SensorModel:
    """How sensors see targets, the same for all.

    Attributes:
        noise_m2: Covariance of a position measurement.
        detection_probability: Chance that a covered target gives a measurement.
        false_alarm_probability: Chance of a false alarm at a sensor.
        false_alarms: `strict`: at most one a sensor, probabilities 1 - P_F and P_F; `geometric`: a factor P_F for each
            (Chen et al. 2006, eq 16).
        detection_radius_m: Range of a sensor; false alarms are uniform within it.
    """

    noise_m2: Matrix2
    detection_probability: float
    false_alarm_probability: float
    false_alarms: FalseAlarms
    detection_radius_m: float


@dataclass(frozen=True, slots=True)
class CoveredTarget:
    """What a sensor knows of a target it covers.

    Attributes:
        target: The target's number.
        mean_m: Prior mean of its position.
        covariance_m2: Prior covariance.
        sensors: All sensors that cover it, ascending.
        vertex: Id of its vertex; None when fewer than three sensors cover it.
        host: Node that hosts the vertex; None without one.
        candidates: Nodes that can host it, in order of preference, the host first; empty without a vertex.
    """

    target: int
    mean_m: tuple[float, float]
    covariance_m2: Matrix2
    sensors: tuple[int, ...]
    vertex: int | None
    host: int | None
    candidates: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class AssociationKnowledge:
    """What one sensor node legitimately knows in an organised network, before anything is measured.

    Attributes:
        node: Its node id.
        sensor: Its sensor number, the id of its vertex.
        targets: The targets it covers, ascending.
        sensor_nodes: Node of each sensor it shares a target with, and its own.
        covered: How many targets each of those sensors covers.
        model: How all sensors see.
    """

    node: int
    sensor: int
    targets: tuple[CoveredTarget, ...]
    sensor_nodes: Mapping[int, int]
    covered: Mapping[int, int]
    model: SensorModel

    @property
    def partners(self) -> tuple[int, ...]:
        """Sensors it shares a target with, ascending: it needs their measurements, and they need its own."""
        return tuple(sorted(set(self.sensor_nodes) - {self.sensor}))

    @property
    def hosted(self) -> tuple[CoveredTarget, ...]:
        """Targets whose vertices this node hosts."""
        return tuple(covered for covered in self.targets if covered.host == self.node)

    @property
    def hosts(self) -> dict[int, int]:
        """Node of every vertex that a vertex hosted here exchanges messages with, and of those hosted here."""
        places = dict(self.sensor_nodes)
        places.update({c.vertex: c.host for c in self.targets if c.vertex is not None and c.host is not None})
        return places


@dataclass(frozen=True, eq=False)
class AssociationInstance:
    """A whole data-association problem without its truth: what exact methods solve.

    Attributes:
        sensor_nodes: Node id of each sensor, ascending.
        measurements_m: Position measurements of each sensor, shape (q, 2).
        means_m: Prior means of the targets, shape (M, 2).
        covariances_m2: Their prior covariances, shape (M, 2, 2).
        coverage: For each target the sensors that cover it, ascending.
        hosts: For each target the node that hosts its vertex; None when fewer than three sensors cover it.
        model: How the sensors see.
        preferences: For each target the nodes that can host its vertex, in order of preference, the host first; empty
            (as in instances written before there was a choice) for the host, then the others by node id.
    """

    sensor_nodes: tuple[int, ...]
    measurements_m: tuple[FloatArray, ...]
    means_m: FloatArray
    covariances_m2: FloatArray
    coverage: tuple[tuple[int, ...], ...]
    hosts: tuple[int | None, ...]
    model: SensorModel
    preferences: tuple[tuple[int, ...], ...] = ()

    @cached_property
    def targets_of(self) -> tuple[tuple[int, ...], ...]:
        """For each sensor the targets it covers, ascending."""
        lists: list[list[int]] = [[] for _ in self.sensor_nodes]
        for target, sensors in enumerate(self.coverage):
            for sensor in sensors:
                lists[sensor].append(target)
        return tuple(map(tuple, lists))

    def target_vertex_id(self, target: int) -> int | None:
        """Id of a target's vertex, None when it has none."""
        return len(self.sensor_nodes) + target if len(self.coverage[target]) >= 3 else None

    def knowledge(self, sensor: int) -> AssociationKnowledge:
        """What the node of one sensor knows."""
        targets = self.targets_of[sensor]
        shared = sorted({sensor, *(other for target in targets for other in self.coverage[target])})
        return AssociationKnowledge(
            node=self.sensor_nodes[sensor],
            sensor=sensor,
            targets=tuple(self._covered_target(target) for target in targets),
            sensor_nodes={other: self.sensor_nodes[other] for other in shared},
            covered={other: len(self.targets_of[other]) for other in shared},
            model=self.model,
        )

    def _covered_target(self, target: int) -> CoveredTarget:
        (x_m, y_m), ((xx, xy), (yx, yy)) = self.means_m[target].tolist(), self.covariances_m2[target].tolist()
        return CoveredTarget(
            target=target,
            mean_m=(x_m, y_m),
            covariance_m2=((xx, xy), (yx, yy)),
            sensors=self.coverage[target],
            vertex=self.target_vertex_id(target),
            host=self.hosts[target],
            candidates=self._candidates(target),
        )

    def _candidates(self, target: int) -> tuple[int, ...]:
        """See `preferences`."""
        host = self.hosts[target]
        if host is None:
            return ()
        covering = tuple(self.sensor_nodes[sensor] for sensor in self.coverage[target])
        order = self.preferences[target] if self.preferences else covering
        return (host, *(node for node in order if node != host))

    def to_json(self) -> str:
        """The instance as JSON; floats survive the round trip bit for bit."""
        model = self.model
        content = {
            "sensor_nodes": self.sensor_nodes,
            "measurements_m": [points.tolist() for points in self.measurements_m],
            "means_m": self.means_m.tolist(),
            "covariances_m2": self.covariances_m2.tolist(),
            "coverage": self.coverage,
            "hosts": self.hosts,
            "preferences": self.preferences,
            "model": {
                "noise_m2": model.noise_m2,
                "detection_probability": model.detection_probability,
                "false_alarm_probability": model.false_alarm_probability,
                "false_alarms": model.false_alarms,
                "detection_radius_m": model.detection_radius_m,
            },
        }
        return json.dumps(content, allow_nan=False)

    @staticmethod
    def from_json(text: str) -> "AssociationInstance":
        """The inverse of `to_json`."""
        content = json.loads(text)
        model = content["model"]
        (xx, xy), (yx, yy) = model.pop("noise_m2")
        return AssociationInstance(
            sensor_nodes=tuple(content["sensor_nodes"]),
            measurements_m=tuple(np.reshape(points, (-1, 2)).astype(float) for points in content["measurements_m"]),
            means_m=np.reshape(content["means_m"], (-1, 2)).astype(float),
            covariances_m2=np.reshape(content["covariances_m2"], (-1, 2, 2)).astype(float),
            coverage=tuple(map(tuple, content["coverage"])),
            hosts=tuple(content["hosts"]),
            model=SensorModel(noise_m2=((xx, xy), (yx, yy)), **model),
            preferences=tuple(map(tuple, content.get("preferences", ()))),
        )
