"""How many targets are where (Chen et al. 2006, sections 4 and 6.2): the numbers of targets in subregions, from counts.

Each sensor tells one number, a noisy count of all its detections; overlapping coverage makes it tell of subregions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.coverage_regions import Box
from netsim.kernels.placement import HostingRule, Lodger, RouteCosts, message_byte, place
from netsim.kernels.semiring import FloatArray
from netsim.kernels.target_distribution import (
    CountingModel,
    DistributionInstance,
    DistributionKnowledge,
    Subregion,
)
from netsim.parameters import NonNegative, NonNegativeInt, Positive, Probability, parameters
from netsim.problems.coverage import CellCoverage, Coverage, DiscCoverage, coverage_of
from netsim.problems.problem import placement
from netsim.rng import Streams
from netsim.trace.events import Event, TruthCounts, TruthTargets, VariablePlacement


@parameters
class DistributionParameters:
    """Target distribution: sensors that only count find out how many targets are in each part of the field."""

    type: Literal["target-distribution"] = "target-distribution"
    """Kind of problem."""
    coverage: DiscCoverage | CellCoverage = DiscCoverage()
    """What each sensor covers; the sets of covering sensors divide the field into subregions."""
    target_density_per_m2: Positive = 0.007
    """Mean number of targets per area: they are a Poisson process, and the sensors know its density."""
    window: NonNegativeInt = 2
    """The number of targets in a subregion is known beforehand to lie in a window of twice this and one, cut at 0."""
    window_placement: Literal["centred", "drawn"] = "centred"
    """Whether the window lies centred on the true number, as in the paper (then the window itself tells the truth, most of
    all where it is cut at 0), or is drawn evenly among all those that contain it."""
    detection_probability: Probability = 0.8
    """Chance that a sensor detects a target that it covers."""
    false_alarm_density_per_m2: NonNegative = 0.007
    """Mean number of false detections of a sensor per area it covers."""
    noise_sd: Positive = 1.0
    """Standard deviation of a sensor's reading around its number of detections."""
    hosting: HostingRule = "nearest"
    """Which of its covering sensors' nodes hosts a subregion's vertex.

    `nearest` to its centroid; `least_communication`: least sum over the other covering sensors of message bytes times hops;
    `least_energy`: of bytes times joules a byte over the route, its expected repetitions included; `load_balanced`: the
    fullest node has as few vertices as possible, and of such placements the one of least distance."""

    @property
    def model(self) -> CountingModel:
        """What the sensors know of it."""
        return CountingModel(
            target_density_per_m2=self.target_density_per_m2,
            detection_probability=self.detection_probability,
            false_alarm_density_per_m2=self.false_alarm_density_per_m2,
            noise_variance=self.noise_sd**2,
        )


@dataclass(frozen=True, eq=False)
class DistributionProblem:
    """A problem with its truth.

    Attributes:
        instance: What is known to all together, without the truth.
        targets_m: Positions of all targets of the field, shape (T, 2).
        counts: True number of targets of each subregion.
    """

    instance: DistributionInstance
    targets_m: FloatArray
    counts: tuple[int, ...]

    @property
    def kind(self) -> str:
        """`target-distribution`."""
        return "target-distribution"

    def _sensor(self, node: int) -> int | None:
        nodes = self.instance.sensor_nodes
        return nodes.index(node) if node in nodes else None

    def instance_json(self) -> str:
        """The instance without its truth; read it with `DistributionInstance.from_json`."""
        return self.instance.to_json()

    def knowledge(self, node: int) -> DistributionKnowledge | None:
        """What a node knows before it reads its sensor; None for a node without a sensor."""
        sensor = self._sensor(node)
        return None if sensor is None else self.instance.knowledge(sensor)

    def later_truth(self, end_ns: int) -> Sequence[tuple[int, Event]]:
        """Nothing: the truth stays as it is."""
        return ()

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """The noisy number of detections that a node's sensor reads, shape (1,).

        Raises:
            ScenarioError: When the node has no sensor.
        """
        sensor = self._sensor(node)
        if sensor is None:
            text = f"node {node} has no sensor to observe with"
            raise ScenarioError(text)
        return self.instance.readings[sensor : sensor + 1].copy()

    def truth_events(self) -> Sequence[Event]:
        """Positions of all targets, and their number in every subregion."""
        x_m, y_m = self.targets_m.T.tolist()
        vertices = [subregion.vertex for subregion in self.instance.subregions]
        return [TruthTargets(list(range(len(x_m))), x_m, y_m), TruthCounts(vertices, list(self.counts))]

    def placement_event(self) -> VariablePlacement:
        """Sensors' variables on their nodes, those of subregions on one covering sensor each."""
        hosts = dict(enumerate(self.instance.sensor_nodes))
        names = {sensor: f"sensor {node}" for sensor, node in hosts.items()}
        hosts.update({subregion.vertex: subregion.host for subregion in self.instance.subregions})
        names.update({each.vertex: f"subregion {n}" for n, each in enumerate(self.instance.subregions)})
        edges = [(sensor, each.vertex) for each in self.instance.subregions for sensor in each.sensors]
        return placement(hosts, names, sorted(edges))


def build(
    parameters: DistributionParameters,
    sensor_positions_m: FloatArray,
    sensor_nodes: Sequence[int],
    field_m: Box,
    streams: Streams,
    costs: RouteCosts | None = None,
) -> DistributionProblem:
    """Draw a problem.

    Targets come from the stream `world/targets`, drawn windows from `world/windows`, a node's detections and noise from
    `node/<id>/sensing`. Targets are a Poisson process over the whole field, so that their numbers in the subregions are
    independent and Poisson; those that no sensor covers play no part.

    Args:
        parameters: What to draw.
        sensor_positions_m: Positions of the nodes that have a sensor, shape (N, 2).
        sensor_nodes: Their node ids, in the same order, each once.
        field_m: The field.
        streams: The run's random streams.
        costs: What messages between the nodes cost; some rules of hosting need it.

    Raises:
        ScenarioError: When no sensor covers any of the field.
    """
    order = np.argsort(sensor_nodes)
    nodes = tuple(int(sensor_nodes[index]) for index in order)
    sensors_m = np.reshape(sensor_positions_m, (-1, 2)).astype(float)[order]
    coverage = coverage_of(parameters.coverage, sensors_m, field_m)
    if not coverage.regions:
        text = "no sensor covers any of the field, so there is no subregion to count targets in"
        raise ScenarioError(text)
    targets_m = _targets(parameters, field_m, streams)
    inside = coverage.locate(targets_m)
    counts = np.bincount(inside[inside >= 0], minlength=len(coverage.regions)).tolist()
    readings = [_reading(parameters, coverage, s, inside, streams, node) for s, node in enumerate(nodes)]
    instance = DistributionInstance(
        sensor_nodes=nodes,
        readings=np.array(readings, dtype=float),
        subregions=_subregions(coverage, counts, nodes, sensors_m, parameters, streams, costs),
        model=parameters.model,
    )
    return DistributionProblem(instance, targets_m, tuple(counts))


def _targets(parameters: DistributionParameters, field_m: Box, streams: Streams) -> FloatArray:
    rng = streams.generator("world/targets")
    low, high = np.array(field_m[:2]), np.array(field_m[2:])
    count = rng.poisson(parameters.target_density_per_m2 * float(np.prod(high - low)))
    return np.asarray(rng.uniform(low, high, (count, 2)))


def _reading(
    parameters: DistributionParameters,
    coverage: Coverage,
    sensor: int,
    inside: np.ndarray[tuple[int], np.dtype[np.int64]],
    streams: Streams,
    node: int,
) -> float:
    """Detected targets, false detections and noise; a draw for each target of the field, covered or not."""
    rng = streams.generator(f"node/{node}/sensing")
    mine = [number for number, region in enumerate(coverage.regions) if sensor in region.sensors]
    detected = (rng.random(len(inside)) < parameters.detection_probability) & np.isin(inside, mine)
    noise = parameters.noise_sd * rng.standard_normal()
    area_m2 = sum(coverage.regions[number].area_m2 for number in mine)
    return float(detected.sum() + noise + rng.poisson(parameters.false_alarm_density_per_m2 * area_m2))


def _subregions(
    coverage: Coverage,
    counts: Sequence[int],
    nodes: tuple[int, ...],
    sensors_m: FloatArray,
    parameters: DistributionParameters,
    streams: Streams,
    costs: RouteCosts | None,
) -> tuple[Subregion, ...]:
    windows = [
        tuple(range(max(0, centre - parameters.window), centre + parameters.window + 1))
        for centre in _window_centres(parameters, counts, streams)
    ]
    homes = hosts(parameters.hosting, coverage, windows, nodes, sensors_m, costs)
    return tuple(
        Subregion(
            vertex=len(nodes) + number,
            host=homes[number],
            sensors=region.sensors,
            area_m2=region.area_m2,
            centre_m=region.centre_m,
            counts=window,
        )
        for number, (region, window) in enumerate(zip(coverage.regions, windows, strict=True))
    )


def _window_centres(parameters: DistributionParameters, counts: Sequence[int], streams: Streams) -> list[int]:
    if parameters.window_placement == "centred":
        return list(counts)
    shifts = streams.generator("world/windows").integers(-parameters.window, parameters.window + 1, len(counts))
    return [count + int(shift) for count, shift in zip(counts, shifts, strict=True)]


def hosts(
    rule: HostingRule,
    coverage: Coverage,
    windows: Sequence[Sequence[int]],
    nodes: Sequence[int],
    sensors_m: FloatArray,
    costs: RouteCosts | None,
) -> tuple[int, ...]:
    """Node that hosts each subregion, one of the sensors that cover it (see `netsim.kernels.placement.place`).

    A message between a sensor and a subregion has an entry for each of the subregion's possible counts.
    """
    lodgers = []
    for region, window in zip(coverage.regions, windows, strict=True):
        covering = tuple(nodes[sensor] for sensor in region.sensors)
        sizes = dict.fromkeys(covering, message_byte(len(window)))
        lodgers.append(Lodger((region.centre_m[0], region.centre_m[1]), covering, sizes))
    places_m = {node: (x_m, y_m) for node, (x_m, y_m) in zip(nodes, sensors_m.tolist(), strict=True)}
    return tuple(order[0] for order in place(rule, lodgers, places_m, costs))
