"""What sensors tell a centre that associates for all, and how the centre puts it together again.

A report: measurements, then the targets that the sensor describes, each with its number, the nodes that cover it, prior mean
and covariance; then, where ranges or bearings are measured, the place they are measured from, if the sensor covers any
target. A decision: the target of each measurement, -1 for a false alarm.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, size_byte
from netsim.kernels.association_model import (
    AssociationInstance,
    AssociationKnowledge,
    CoveredTarget,
    SensorModel,
)
from netsim.kernels.injections import IntArray
from netsim.kernels.semiring import FloatArray

Priors = Literal["once", "every"]
_HEAD = Record("BB")  # measurements, targets described
_TARGET = Record("HB")  # number, covering nodes
_NODE = Record("H")
_COORDINATES = 2
_PRIOR = 5  # mean and the covariance's three numbers


@dataclass(frozen=True, slots=True)
class Described:
    """A target as a report describes it.

    Attributes:
        nodes: Nodes of the sensors that cover it.
        mean_m: Prior mean of its position.
        covariance_m2: Prior covariance, shape (2, 2).
    """

    nodes: tuple[int, ...]
    mean_m: FloatArray
    covariance_m2: FloatArray


@dataclass(frozen=True, slots=True)
class Report:
    """What one sensor tells.

    Attributes:
        measurements_m: Its measurements, shape (q, 2) for positions in metres (see `SensorModel.measures`).
        targets: By number, the targets that it describes.
        place_m: Where it stands; None where it did not say, since no measurement of it depends on that.
    """

    measurements_m: FloatArray
    targets: Mapping[int, Described]
    place_m: tuple[float, float] | None = None


def described_by(knowledge: AssociationKnowledge, priors: Priors) -> list[CoveredTarget]:
    """The targets that a sensor describes: all it covers, or those of which it is the first covering sensor."""
    return [each for each in knowledge.targets if priors == "every" or min(each.sensors) == knowledge.sensor]


def encode_report(knowledge: AssociationKnowledge, own_m: FloatArray, priors: Priors, width: FloatWidth) -> bytes:
    """The report of a sensor."""
    told = described_by(knowledge, priors)
    parts = [_HEAD.pack(len(own_m), len(told)), encode_floats(own_m.ravel(), width)]
    for covered in told:
        nodes = [knowledge.sensor_nodes[sensor] for sensor in covered.sensors]
        (xx, xy), (_, yy) = covered.covariance_m2
        parts.append(_TARGET.pack(covered.target, len(nodes)) + b"".join(_NODE.pack(node) for node in nodes))
        parts.append(encode_floats([*covered.mean_m, xx, xy, yy], width))
    return b"".join([*parts, encode_floats(_place_m(knowledge), width)])


def _place_m(knowledge: AssociationKnowledge) -> tuple[float, ...]:
    """Where the sensor stands, as the knowledge of any target that it covers has it; empty if that is not told."""
    placed = [covered for covered in knowledge.targets if covered.sensors_m]
    return placed[0].sensors_m[placed[0].sensors.index(knowledge.sensor)] if placed else ()


def decode_report(payload: bytes, width: FloatWidth, numbers: int = _COORDINATES) -> Report:
    """The inverse of `encode_report`.

    Args:
        payload: The report.
        width: Its precision.
        numbers: How many numbers a measurement has (`SensorModel.numbers`).
    """
    count, told = _HEAD.unpack(payload, 0)
    offset = _HEAD.size_byte
    end = offset + size_byte(numbers * count, width)
    points = decode_floats(payload[offset:end], width).reshape(-1, numbers)
    targets: dict[int, Described] = {}
    for _ in range(told):
        target, sharing = _TARGET.unpack(payload, end)
        offset = end + _TARGET.size_byte
        nodes = tuple(int(_NODE.unpack(payload, offset + i * _NODE.size_byte)[0]) for i in range(sharing))
        offset += sharing * _NODE.size_byte
        end = offset + size_byte(_PRIOR, width)
        x_m, y_m, xx, xy, yy = decode_floats(payload[offset:end], width).tolist()
        targets[int(target)] = Described(nodes, np.array([x_m, y_m]), np.array([[xx, xy], [xy, yy]]))
    place = decode_floats(payload[end:], width).tolist()
    return Report(points, targets, (place[0], place[1]) if place else None)


def encode_decision(decision: Iterable[int]) -> bytes:
    """A sensor's decision, two bytes a measurement."""
    return np.asarray(list(decision), dtype="<i2").tobytes()


def decode_decision(payload: bytes) -> IntArray:
    """The inverse of `encode_decision`."""
    return np.frombuffer(payload, dtype="<i2").astype(np.int64)


@dataclass(frozen=True, slots=True)
class Gathered:
    """A problem made of the reports that came.

    Attributes:
        instance: The sensors that reported, the targets that some report describes; a covering sensor that did not report
            plays no part, which leaves the exact posterior of what is known.
        numbers: Number of each of its targets as the sensors know them.
    """

    instance: AssociationInstance
    numbers: tuple[int, ...]

    def named(self, decision: IntArray) -> list[int]:
        """A decision in the sensors' own numbers of targets."""
        return [self.numbers[target] if target >= 0 else -1 for target in decision.tolist()]


def gather(reports: Mapping[int, Report], model: SensorModel) -> Gathered:
    """Put the reports together.

    Args:
        reports: By node.
        model: How all sensors see.
    """
    nodes = sorted(reports)
    described = {target: each for node in nodes for target, each in reports[node].targets.items()}
    numbers = tuple(sorted(described))
    known = [described[target] for target in numbers]
    instance = AssociationInstance(
        sensor_nodes=tuple(nodes),
        measurements_m=tuple(reports[node].measurements_m for node in nodes),
        means_m=np.reshape([each.mean_m for each in known], (-1, 2)).astype(float),
        covariances_m2=np.reshape([each.covariance_m2 for each in known], (-1, 2, 2)).astype(float),
        coverage=tuple(_present(each.nodes, nodes) for each in known),
        hosts=(None,) * len(known),
        model=model,
        sensors_m=_places_m([reports[node] for node in nodes]) if model.measures != "position" else (),
    )
    return Gathered(instance, numbers)


def _places_m(reports: Sequence[Report]) -> tuple[tuple[float, float], ...]:
    """Where the sensors stand; no number where one has not said so, as it covers no target and its place plays no part."""
    return tuple((np.nan, np.nan) if each.place_m is None else each.place_m for each in reports)


def _present(covering: Sequence[int], nodes: Sequence[int]) -> tuple[int, ...]:
    """Positions among the nodes that reported of those that cover a target."""
    return tuple(nodes.index(node) for node in sorted(covering) if node in nodes)
