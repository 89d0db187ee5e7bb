"""Records of the data-association problem: what a node knows of it, and the whole of it.

Sensors are numbered 0 .. N-1 in ascending order of their node ids; that number is also the id of the sensor's vertex.
Targets are numbered 0 .. M-1; target t has a vertex of its own, N + t, when three or more sensors cover it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.kernels.spanning_trees import components

FalseAlarms = Literal["strict", "geometric"]
GraphForm = Literal["hybrid", "sensor", "target"]
"""Which graphical model the nodes use (Chen et al. 2006, sections 3.2.1 to 3.2.3)."""
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
class Cluster:
    """Sensors whose associations are one variable of the sensor-oriented model.

    Attributes:
        vertex: Id of its vertex: the lowest of its sensors.
        sensors: Its sensors, ascending.
        host: Node that hosts the vertex.
    """

    vertex: int
    sensors: tuple[int, ...]
    host: int


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
        graph: Which graphical model is used.
        wider: Targets that its sensor does not cover but the vertices it hosts or their neighbours are about, ascending.
        clusters: Sensor-oriented model: its sensor's cluster, and if the node hosts that, those which share a target with
            it, ascending.
    """

    node: int
    sensor: int
    targets: tuple[CoveredTarget, ...]
    sensor_nodes: Mapping[int, int]
    covered: Mapping[int, int]
    model: SensorModel
    graph: GraphForm = "hybrid"
    wider: tuple[CoveredTarget, ...] = ()
    clusters: tuple[Cluster, ...] = ()

    @property
    def partners(self) -> tuple[int, ...]:
        """Sensors with which it exchanges measurements, ascending: those it shares a target with.

        In the sensor-oriented model those whose measurements its cluster needs, if it hosts one, and the hosts that need its
        own.
        """
        return tuple(sorted(set(self.sensor_nodes) - {self.sensor}))

    @property
    def hosted(self) -> tuple[CoveredTarget, ...]:
        """Targets whose vertices this node hosts."""
        return tuple(covered for covered in self.targets if covered.host == self.node)

    @property
    def hosts(self) -> dict[int, int]:
        """Node of every vertex that a vertex hosted here exchanges messages with, and of those hosted here."""
        if self.graph == "sensor":
            return {cluster.vertex: cluster.host for cluster in self.clusters}
        places = dict(self.sensor_nodes) if self.graph == "hybrid" else {}
        every = (*self.targets, *self.wider)
        places.update({c.vertex: c.host for c in every if c.vertex is not None and c.host is not None})
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
        hosts: For each target the node that hosts its vertex; None where it has none.
        model: How the sensors see.
        preferences: For each target the nodes that can host its vertex, in order of preference, the host first; empty
            (as in instances written before there was a choice) for the host, then the others by node id.
        graph: Which graphical model the nodes use.
        cluster_hosts: Sensor-oriented model: for each sensor the node that hosts the vertex of its cluster.
    """

    sensor_nodes: tuple[int, ...]
    measurements_m: tuple[FloatArray, ...]
    means_m: FloatArray
    covariances_m2: FloatArray
    coverage: tuple[tuple[int, ...], ...]
    hosts: tuple[int | None, ...]
    model: SensorModel
    preferences: tuple[tuple[int, ...], ...] = ()
    graph: GraphForm = "hybrid"
    cluster_hosts: tuple[int, ...] = ()

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
        least = {"hybrid": 3, "target": 1, "sensor": np.inf}[self.graph]
        return len(self.sensor_nodes) + target if len(self.coverage[target]) >= least else None

    def as_hybrid(self) -> "AssociationInstance":
        """The same problem in the sensor-target hybrid model; target vertices that had no host get a covering sensor's."""
        if self.graph == "hybrid":
            return self
        hosts = tuple(
            None if len(sensors) < 3 else self.sensor_nodes[sensors[0]] if host is None else host
            for host, sensors in zip(self.hosts, self.coverage, strict=True)
        )
        return replace(self, graph="hybrid", hosts=hosts, cluster_hosts=())

    @cached_property
    def clusters(self) -> tuple[Cluster, ...]:
        """Clusters of the sensor-oriented model, ascending by vertex."""
        groups = clustered(len(self.sensor_nodes), self.coverage)
        return tuple(Cluster(sensors[0], sensors, self.cluster_hosts[sensors[0]]) for sensors in groups)

    def _neighbouring(self, cluster: Cluster) -> tuple[Cluster, ...]:
        """Other clusters that share a target with this one, ascending."""
        near = {other for sensor in cluster.sensors for other in self._sharing(sensor)}
        return tuple(other for other in self.clusters if other is not cluster and near & set(other.sensors))

    def _sharing(self, sensor: int) -> set[int]:
        """Sensors that share a target with one, and itself."""
        return {sensor, *(other for target in self.targets_of[sensor] for other in self.coverage[target])}

    def _needed(self, cluster: Cluster) -> set[int]:
        """Sensors whose measurements the potentials of a cluster are made of."""
        return {other for sensor in cluster.sensors for other in self._sharing(sensor)}

    def _known_clusters(self, sensor: int) -> tuple[Cluster, ...]:
        own = next(cluster for cluster in self.clusters if sensor in cluster.sensors)
        near = self._neighbouring(own) if own.host == self.sensor_nodes[sensor] else ()
        return tuple(sorted((own, *near), key=lambda cluster: cluster.vertex))

    def _partners(self, sensor: int) -> set[int]:
        """Itself and the sensors with which a sensor's node exchanges measurements."""
        if self.graph != "sensor":
            return self._sharing(sensor)
        found = {sensor}
        for cluster in self.clusters:
            host, needed = self.sensor_nodes.index(cluster.host), self._needed(cluster)
            if host == sensor:
                found |= needed
            elif sensor in needed:
                found.add(host)
        return found

    def _wider(self, sensor: int) -> set[int]:
        """Targets that a sensor does not cover, but its node must know of."""
        node, own = self.sensor_nodes[sensor], self.targets_of[sensor]
        if self.graph == "target":
            near = {s for target in own if self.hosts[target] == node for s in self.coverage[target]}
        elif self.graph == "sensor":
            near = {s for cluster in self.clusters if cluster.host == node for s in cluster.sensors}
        else:
            near = set()
        return {target for other in near for target in self.targets_of[other]} - set(own)

    def knowledge(self, sensor: int) -> AssociationKnowledge:
        """What the node of one sensor knows."""
        targets = self.targets_of[sensor]
        shared = sorted(self._partners(sensor))
        return AssociationKnowledge(
            node=self.sensor_nodes[sensor],
            sensor=sensor,
            targets=tuple(self._covered_target(target) for target in targets),
            sensor_nodes={other: self.sensor_nodes[other] for other in shared},
            covered={other: len(self.targets_of[other]) for other in shared},
            model=self.model,
            graph=self.graph,
            wider=tuple(self._covered_target(target) for target in sorted(self._wider(sensor))),
            clusters=self._known_clusters(sensor) if self.graph == "sensor" else (),
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
        if self.graph != "hybrid":
            content.update(graph=self.graph, cluster_hosts=self.cluster_hosts)
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
            graph=content.get("graph", "hybrid"),
            cluster_hosts=tuple(content.get("cluster_hosts", ())),
        )


def clustered(sensors: int, coverage: Sequence[Sequence[int]]) -> tuple[tuple[int, ...], ...]:
    """Sensors of the sensor-oriented model that become one variable: those joined by targets that three or more cover.

    Args:
        sensors: How many there are.
        coverage: For each target the sensors that cover it.

    Returns:
        Each sensor in one cluster; clusters ascending by their lowest sensor, members ascending.
    """
    edges = [(covering[0], other) for covering in coverage if len(covering) >= 3 for other in covering[1:]]
    return components(range(sensors), edges)
