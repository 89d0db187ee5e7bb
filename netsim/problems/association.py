"""Data association in an organised network (Chen et al. 2006, sections 3 and 6.1).

Sensors with overlapping discs of detection measure positions; which target each measurement came from is to be
inferred.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_graph import graph_vertices
from netsim.kernels.association_model import (
    AssociationInstance,
    AssociationKnowledge,
    Cluster,
    SensorModel,
    clustered,
)
from netsim.kernels.cluster_vertex import check_cluster
from netsim.kernels.injections import IntArray
from netsim.kernels.placement import HostingRule, Lodger, RouteCosts, message_byte, place
from netsim.kernels.semiring import FloatArray
from netsim.parameters import NonNegativeInt, PointM, Positive, Probability, parameters
from netsim.problems.problem import placement
from netsim.rng import Streams
from netsim.trace.events import Event, TruthOrigins, TruthTargets, VariablePlacement


@parameters
class UniformTargets:
    """Targets drawn uniformly over the union of the sensors' discs of detection."""

    type: Literal["uniform"] = "uniform"
    """Kind of target placement."""
    count: NonNegativeInt = 33
    """How many targets."""


@parameters
class ListedTargets:
    """Targets at given places."""

    type: Literal["listed"] = "listed"
    """Kind of target placement."""
    positions_m: tuple[PointM, ...]
    """Their positions, in metres."""


@parameters
class AssociationParameters:
    """Data association: sensors of overlapping range decide which target each of their measurements came from."""

    type: Literal["association"] = "association"
    """Kind of problem."""
    detection_radius_m: Positive = 5.0
    """Range within which a sensor can detect targets."""
    targets: UniformTargets | ListedTargets = UniformTargets()
    """Where the targets are."""
    prior_variance_m2: Positive = 5.0
    """Variance of the predicted position density of each target (see `variance`)."""
    prior_mean: Literal["truth", "drawn"] = "truth"
    """Mean of that density: the true position, as in the paper's text, or drawn around it, as a tracker's would be."""
    measurement_variance_ratio: Positive = 0.2
    """Variance of a position measurement over the squared detection radius (see `variance`)."""
    variance: Literal["per_coordinate", "total"] = "per_coordinate"
    """Whether both variances are those of each coordinate, or the total of the two coordinates (each then has half)."""
    detection_probability: Probability = 0.8
    """Chance that a sensor measures a target in its range."""
    false_alarm_probability: Probability = 0.15
    """Chance that a sensor has a false alarm, uniform over its disc; it never has two."""
    false_alarms: Literal["strict", "geometric"] = "strict"
    """What the model believes of false alarms: at most one a sensor, or any number k with weight P_F^k."""
    hosting: HostingRule = "nearest"
    """Which of its covering sensors' nodes hosts the vertex of a target that three or more cover.

    `nearest` to its prior mean; `least_communication`: least sum over the other covering sensors of expected message bytes
    times hops; `least_energy`: of bytes times joules a byte over the route, its expected repetitions included;
    `load_balanced`: the fullest node has as few vertices as possible, and of such placements the one of least distance."""
    measures: Literal["position", "range_bearing", "range", "bearing"] = "position"
    """What a measurement is: a position, or range and bearing of the target from the sensor, or one of them."""
    range_sd_m: Positive = 1.0
    """Standard deviation of a measured range."""
    bearing_sd_rad: Positive = 0.1
    """Standard deviation of a measured bearing."""
    model: Literal["hybrid", "sensor", "target"] = "hybrid"
    """The graphical model. `hybrid`: a variable a sensor, and one for each target that three or more sensors cover;
    `sensor`: a variable a sensor, those that such targets join merged into one; `target`: a variable for each covered
    target, which needs `false_alarms: geometric`."""

    def __post_init__(self) -> None:
        """The target-oriented model is pairwise only where false alarms are independent."""
        if self.model == "target" and (self.false_alarms == "strict" or self.false_alarm_probability == 0.0):
            message = (
                "false_alarms: geometric and false_alarm_probability above 0 with model: target (otherwise false alarms tie "
                "all targets of a sensor together), or model: hybrid"
            )
            raise ValueError(message)

    @property
    def _share(self) -> float:
        return 0.5 if self.variance == "total" else 1.0

    @property
    def prior_variance_per_coordinate_m2(self) -> float:
        """Variance of each coordinate of a target's prior."""
        return self._share * self.prior_variance_m2

    @property
    def noise_variance_per_coordinate_m2(self) -> float:
        """Variance of each coordinate of a measurement."""
        return self._share * self.measurement_variance_ratio * self.detection_radius_m**2


@dataclass(frozen=True, eq=False)
class AssociationProblem:
    """A data-association problem with its truth.

    Attributes:
        instance: What is known to all together, without the truth.
        targets_m: True positions, shape (M, 2).
        origins: For each sensor the target of each of its measurements, -1 for a false alarm.
    """

    instance: AssociationInstance
    targets_m: FloatArray
    origins: tuple[IntArray, ...]

    @property
    def kind(self) -> str:
        """`association`."""
        return "association"

    def _sensor(self, node: int) -> int | None:
        nodes = self.instance.sensor_nodes
        return nodes.index(node) if node in nodes else None

    def instance_json(self) -> str:
        """The instance without its truth; read it with `AssociationInstance.from_json`."""
        return self.instance.to_json()

    def knowledge(self, node: int) -> AssociationKnowledge | None:
        """What a node knows before it measures; None for a node without a sensor."""
        sensor = self._sensor(node)
        return None if sensor is None else self.instance.knowledge(sensor)

    def later_truth(self, end_ns: int) -> Sequence[tuple[int, Event]]:
        """Nothing: the truth stays as it is."""
        return ()

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """The position measurements of a node, in metres, shape (q, 2), in no telling order.

        Raises:
            ScenarioError: When the node has no sensor.
        """
        sensor = self._sensor(node)
        if sensor is None:
            text = f"node {node} has no sensor to observe with"
            raise ScenarioError(text)
        return self.instance.measurements_m[sensor].copy()

    def truth_events(self) -> Sequence[Event]:
        """True positions, and the origin of every measurement."""
        x_m, y_m = self.targets_m.T.tolist()
        events: list[Event] = [TruthTargets(list(range(len(x_m))), x_m, y_m)]
        for sensor, (node, points, origin) in enumerate(
            zip(self.instance.sensor_nodes, self.instance.measurements_m, self.origins, strict=True)
        ):
            x_m, y_m = self._shown(sensor, points).T.tolist() if len(points) else ([], [])
            events.append(TruthOrigins(node, x_m, y_m, origin.tolist()))
        return events

    def _shown(self, sensor: int, points: FloatArray) -> FloatArray:
        """Where measurements stand in the trace: a range alone due east of the sensor, a bearing alone at its rim."""
        model = self.instance.model
        if model.measures == "position":
            return points
        range_m = points[:, 0] if model.measures != "bearing" else np.full(len(points), model.detection_radius_m)
        bearing = points[:, -1] if model.measures != "range" else np.zeros(len(points))
        away_m = range_m[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
        return np.asarray(self.instance.sensors_m[sensor] + away_m)

    def placement_event(self) -> VariablePlacement:
        """Sensors' variables on their nodes, target vertices on one covering sensor each."""
        if self.instance.graph != "hybrid":
            return self._listed_placement()
        nodes = self.instance.sensor_nodes
        hosts = dict(enumerate(nodes))
        names = {sensor: f"sensor {node}" for sensor, node in enumerate(nodes)}
        edges: set[tuple[int, int]] = set()
        for target, sensors in enumerate(self.instance.coverage):
            vertex, host = self.instance.target_vertex_id(target), self.instance.hosts[target]
            if vertex is not None and host is not None:
                hosts[vertex], names[vertex] = host, f"target {target}"
                edges.update((sensor, vertex) for sensor in sensors)
            elif len(sensors) == 2:
                edges.add((sensors[0], sensors[1]))
        return placement(hosts, names, sorted(edges))

    def _listed_placement(self) -> VariablePlacement:
        """Clusters or targets on their hosts."""
        instance = self.instance
        vertices = graph_vertices(instance)
        names: dict[int, str] = {}
        hosts: dict[int, int] = {}
        if instance.graph == "sensor":
            names = {cluster.vertex: _cluster_name(instance, cluster) for cluster in instance.clusters}
            hosts = {cluster.vertex: cluster.host for cluster in instance.clusters}
        for target, host in enumerate(instance.hosts):
            vertex_id = instance.target_vertex_id(target)
            if vertex_id is not None and host is not None:
                names[vertex_id], hosts[vertex_id] = f"target {target}", host
        edges = {(vertex.id, other) for vertex in vertices for other in vertex.neighbours if vertex.id < other}
        return placement(hosts, names, sorted(edges))


def _cluster_name(instance: AssociationInstance, cluster: Cluster) -> str:
    nodes = [str(instance.sensor_nodes[sensor]) for sensor in cluster.sensors]
    return f"sensor {nodes[0]}" if len(nodes) == 1 else f"sensors {', '.join(nodes)}"


def build(
    parameters: AssociationParameters,
    sensor_positions_m: FloatArray,
    sensor_nodes: Sequence[int],
    streams: Streams,
    costs: RouteCosts | None = None,
) -> AssociationProblem:
    """Draw a problem.

    Targets come from the stream `world/targets`, drawn prior means from `world/priors`, a node's measurements from
    `node/<id>/sensing`. Which targets a sensor covers is decided by their true positions: that the network has found it
    out is what "organised" means. A target's vertex, where it has one, lives on the node of a
    covering sensor, chosen by `parameters.hosting` (see `netsim.kernels.placement.place`) before anything is measured.

    Args:
        parameters: What to draw.
        sensor_positions_m: Positions of the nodes that have a sensor, shape (N, 2).
        sensor_nodes: Their node ids, in the same order, each once.
        streams: The run's random streams.
        costs: What messages between the nodes cost; some rules of hosting need it.

    Raises:
        ScenarioError: When targets are to be drawn over the discs of no sensor.
    """
    order = np.argsort(sensor_nodes)
    nodes = tuple(int(sensor_nodes[index]) for index in order)
    sensors_m = np.reshape(sensor_positions_m, (-1, 2)).astype(float)[order]
    targets_m = _targets(parameters, sensors_m, streams)
    distances_m = np.linalg.norm(targets_m[:, None, :] - sensors_m[None, :, :], axis=2)
    within = distances_m <= parameters.detection_radius_m
    means_m = _prior_means(parameters, targets_m, streams)
    drawn = [_measure(parameters, sensors_m[s], targets_m, within[:, s], streams, node) for s, node in enumerate(nodes)]
    covariance = parameters.prior_variance_per_coordinate_m2 * np.eye(2)
    coverage = tuple(tuple(np.flatnonzero(row).tolist()) for row in within)
    points = [each for each, _ in drawn]
    least = {"hybrid": 3, "target": 1, "sensor": len(nodes) + 1}[parameters.model]
    preferences = _preferences(parameters, means_m, sensors_m, nodes, coverage, costs, least)
    instance = AssociationInstance(
        sensor_nodes=nodes,
        measurements_m=tuple(points),
        means_m=means_m,
        covariances_m2=np.tile(covariance, (len(targets_m), 1, 1)),
        coverage=coverage,
        hosts=tuple(order[0] if order else None for order in preferences),
        model=_sensor_model(parameters),
        preferences=preferences,
        graph=parameters.model,
        cluster_hosts=_cluster_hosts(sensors_m, nodes, coverage, points) if parameters.model == "sensor" else (),
        sensors_m=tuple((x, y) for x, y in sensors_m.tolist()) if parameters.measures != "position" else (),
    )
    return AssociationProblem(instance, targets_m, tuple(origin for _, origin in drawn))


def _sensor_model(parameters: AssociationParameters) -> SensorModel:
    variance = parameters.noise_variance_per_coordinate_m2
    polar: dict[str, Any] = {}
    if parameters.measures != "position":
        polar = {name: getattr(parameters, name) for name in ("measures", "range_sd_m", "bearing_sd_rad")}
    return SensorModel(
        noise_m2=((variance, 0.0), (0.0, variance)),
        detection_probability=parameters.detection_probability,
        false_alarm_probability=parameters.false_alarm_probability,
        false_alarms=parameters.false_alarms,
        detection_radius_m=parameters.detection_radius_m,
        **polar,
    )


def _targets(parameters: AssociationParameters, sensors_m: FloatArray, streams: Streams) -> FloatArray:
    if isinstance(parameters.targets, ListedTargets):
        return np.reshape(parameters.targets.positions_m, (-1, 2)).astype(float)
    radius_m, count = parameters.detection_radius_m, parameters.targets.count
    if not len(sensors_m) and count:
        text = "targets cannot be drawn over the discs of the sensors: no node has a sensor"
        raise ScenarioError(text)
    rng = streams.generator("world/targets")
    places: list[FloatArray] = []
    while len(places) < count:
        point = rng.uniform(sensors_m.min(axis=0) - radius_m, sensors_m.max(axis=0) + radius_m)
        if np.linalg.norm(sensors_m - point, axis=1).min() <= radius_m:
            places.append(point)
    return np.reshape(places, (-1, 2)).astype(float)


def _prior_means(parameters: AssociationParameters, targets_m: FloatArray, streams: Streams) -> FloatArray:
    if parameters.prior_mean == "truth":
        return targets_m.copy()
    deviation_m = np.sqrt(parameters.prior_variance_per_coordinate_m2)
    return np.asarray(targets_m + deviation_m * streams.generator("world/priors").standard_normal(targets_m.shape))


def _measure(
    parameters: AssociationParameters,
    sensor_m: FloatArray,
    targets_m: FloatArray,
    covered: np.ndarray[tuple[int], np.dtype[np.bool_]],
    streams: Streams,
    node: int,
) -> tuple[FloatArray, IntArray]:
    """Measurements of one sensor and their origins, shuffled so that their order tells nothing.

    Draws are made for detected and missed targets alike: one probability changed leaves all other draws in place.
    """
    rng = streams.generator(f"node/{node}/sensing")
    chances, noise = rng.random(len(targets_m)), rng.standard_normal(targets_m.shape)
    alarm, radius, angle = rng.random(3)
    detected = np.flatnonzero(covered & (chances < parameters.detection_probability))
    is_position = parameters.measures == "position"
    deviation_m = np.sqrt(parameters.noise_variance_per_coordinate_m2) if is_position else 0.0
    points = targets_m[detected] + deviation_m * noise[detected]
    origins = detected.astype(np.int64)
    if alarm < parameters.false_alarm_probability:
        offset = np.array([np.cos(2.0 * np.pi * angle), np.sin(2.0 * np.pi * angle)])
        points = np.vstack([points, sensor_m + parameters.detection_radius_m * np.sqrt(radius) * offset])
        origins = np.append(origins, -1)
    order = rng.permutation(len(origins))
    if not is_position:
        errors = np.vstack([noise[detected], np.zeros((len(origins) - len(detected), 2))])
        return _polar(parameters, points - sensor_m, errors)[order], origins[order]
    return points[order], origins[order]


def _preferences(
    parameters: AssociationParameters,
    means_m: FloatArray,
    sensors_m: FloatArray,
    nodes: Sequence[int],
    coverage: Sequence[Sequence[int]],
    costs: RouteCosts | None,
    least: int,
) -> tuple[tuple[int, ...], ...]:
    """For each target the nodes that can host its vertex, the host first; none for one that fewer than `least` cover."""
    covered = np.bincount([sensor for covering in coverage for sensor in covering], minlength=len(nodes))
    lodgers = []
    for mean_m, covering in zip(means_m.tolist(), coverage, strict=True):
        hosts = covering if len(covering) >= least else ()
        size_byte = {nodes[sensor]: message_byte(_entries(parameters, int(covered[sensor]))) for sensor in hosts}
        lodgers.append(Lodger((mean_m[0], mean_m[1]), tuple(size_byte), size_byte))
    places_m = {node: (x_m, y_m) for node, (x_m, y_m) in zip(nodes, sensors_m.tolist(), strict=True)}
    return place(parameters.hosting, lodgers, places_m, costs)


def _entries(parameters: AssociationParameters, covered: int) -> float:
    """Expected entries of a message between a target and a sensor: one for each of its measurements, one for none.

    How many measurements there will be is not known when hosts are chosen; expected are its detections and false alarms.
    """
    return 1.0 + parameters.detection_probability * covered + parameters.false_alarm_probability


def _polar(parameters: AssociationParameters, offsets_m: FloatArray, errors: FloatArray) -> FloatArray:
    """Range and bearing of places seen from a sensor, with standard normal errors of the right size, or one of them."""
    ranges_m = np.abs(np.hypot(offsets_m[:, 0], offsets_m[:, 1]) + parameters.range_sd_m * errors[:, 0])
    bearings = np.arctan2(offsets_m[:, 1], offsets_m[:, 0]) + parameters.bearing_sd_rad * errors[:, 1]
    wrapped = np.mod(bearings + np.pi, 2.0 * np.pi) - np.pi
    columns = {"range_bearing": (ranges_m, wrapped), "range": (ranges_m,), "bearing": (wrapped,)}
    return np.column_stack(columns[parameters.measures])


def _cluster_hosts(
    sensors_m: FloatArray, nodes: Sequence[int], coverage: Sequence[Sequence[int]], points: Sequence[FloatArray]
) -> tuple[int, ...]:
    """For each sensor the host of its cluster: the member nearest their centroid, of equals the lowest id.

    Raises:
        ScenarioError: When a cluster has too many joint associations to list.
    """
    hosts = [0] * len(nodes)
    for members in clustered(len(nodes), coverage):
        covered = [sum(sensor in covering for covering in coverage) for sensor in members]
        check_cluster([nodes[sensor] for sensor in members], covered, [len(points[sensor]) for sensor in members])
        places_m = sensors_m[list(members)]
        distances_m = np.linalg.norm(places_m - places_m.mean(axis=0), axis=1)
        # Distances that differ by rounding only are equal: the corners of a square must not depend on it.
        nearest = int(np.flatnonzero(distances_m <= distances_m.min() + 1e-9)[0])
        for sensor in members:
            hosts[sensor] = nodes[members[nearest]]
    return tuple(hosts)
