"""Records of target-distribution estimation: what a node knows of it, and the whole of it (Chen et al. 2006, section 4).

Sensors are numbered 0 .. N-1 in ascending order of their node ids; that number is also the id of the sensor's vertex.
Subregion j of M has the vertex N + j: its variable is the number of targets in it.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np

from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, slots=True)
class CountingModel:
    """How sensors count targets, the same for all.

    Attributes:
        target_density_per_m2: Mean number of targets per area (the rate of the Poisson prior).
        detection_probability: Chance that a sensor detects a target that it covers.
        false_alarm_density_per_m2: Mean number of false detections of a sensor per area it covers.
        noise_variance: Variance of what a sensor reads, around the total number of its detections.
        false_alarm_tail: Chance left out where the number of false detections in a subregion is cut off.
    """

    target_density_per_m2: float
    detection_probability: float
    false_alarm_density_per_m2: float
    noise_variance: float
    false_alarm_tail: float = 1e-9


@dataclass(frozen=True, slots=True)
class Subregion:
    """One part of the field, covered by the same sensors throughout.

    Attributes:
        vertex: Id of its vertex.
        host: Node that hosts the vertex.
        sensors: The sensors that cover it, ascending.
        area_m2: Its area.
        centre_m: Its centroid.
        counts: The numbers of targets that are held possible, ascending and without gaps.
    """

    vertex: int
    host: int
    sensors: tuple[int, ...]
    area_m2: float
    centre_m: tuple[float, float]
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class DistributionKnowledge:
    """What the node of one sensor legitimately knows before it reads its sensor.

    Attributes:
        node: Its node id.
        sensor: Its sensor number, the id of its vertex.
        subregions: The subregions it covers, ascending; those it hosts are among them.
        sensor_nodes: Node of each sensor that covers a subregion hosted here, and its own.
        model: How all sensors count.
    """

    node: int
    sensor: int
    subregions: tuple[Subregion, ...]
    sensor_nodes: Mapping[int, int]
    model: CountingModel

    @property
    def hosted(self) -> tuple[Subregion, ...]:
        """Subregions whose vertices this node hosts."""
        return tuple(subregion for subregion in self.subregions if subregion.host == self.node)

    @property
    def hosts(self) -> dict[int, int]:
        """Node of every vertex that a vertex hosted here exchanges messages with, and of those hosted here."""
        return {**self.sensor_nodes, **{subregion.vertex: subregion.host for subregion in self.subregions}}


@dataclass(frozen=True, eq=False)
class DistributionInstance:
    """A whole problem without its truth.

    Attributes:
        sensor_nodes: Node id of each sensor, ascending.
        readings: What each sensor reads, shape (N,).
        subregions: All subregions, ascending.
        model: How the sensors count.
    """

    sensor_nodes: tuple[int, ...]
    readings: FloatArray
    subregions: tuple[Subregion, ...]
    model: CountingModel

    @cached_property
    def subregions_of(self) -> tuple[tuple[Subregion, ...], ...]:
        """For each sensor the subregions it covers, ascending."""
        lists: list[list[Subregion]] = [[] for _ in self.sensor_nodes]
        for subregion in self.subregions:
            for sensor in subregion.sensors:
                lists[sensor].append(subregion)
        return tuple(map(tuple, lists))

    def knowledge(self, sensor: int) -> DistributionKnowledge:
        """What the node of one sensor knows."""
        node, mine = self.sensor_nodes[sensor], self.subregions_of[sensor]
        met = sorted({sensor, *(other for subregion in mine if subregion.host == node for other in subregion.sensors)})
        return DistributionKnowledge(node, sensor, mine, {other: self.sensor_nodes[other] for other in met}, self.model)

    def to_json(self) -> str:
        """The instance as JSON; floats survive the round trip bit for bit."""
        content = {
            "sensor_nodes": self.sensor_nodes,
            "readings": self.readings.tolist(),
            "subregions": [asdict(subregion) for subregion in self.subregions],
            "model": asdict(self.model),
        }
        return json.dumps(content, allow_nan=False)

    @staticmethod
    def from_json(text: str) -> "DistributionInstance":
        """The inverse of `to_json`."""
        content = json.loads(text)
        return DistributionInstance(
            sensor_nodes=tuple(content["sensor_nodes"]),
            readings=np.array(content["readings"], dtype=float),
            subregions=tuple(_subregion(fields) for fields in content["subregions"]),
            model=CountingModel(**content["model"]),
        )


def _subregion(fields: Mapping[str, list[float]]) -> Subregion:
    lists = {name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()}
    return Subregion(**lists)  # type: ignore[arg-type]  # what `to_json` wrote
