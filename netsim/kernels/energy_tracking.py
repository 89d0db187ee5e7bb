"""What nodes know that track several targets by their acoustic energy (Liu, Chu, Liu, Reich, Zhao 2004)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from netsim.kernels.energy_sensing import EnergyModel
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vehicle_labels import VehicleLabels

PointM = tuple[float, float]


@dataclass(frozen=True, slots=True)
class TrackStart:
    """A track that a node is told to begin.

    Attributes:
        track: Its number, which is also the number of the target it begins as.
        place_m: About where the target is.
        spread_m: How far from there it may be.
        step: Reading with which it begins.
    """

    track: int
    place_m: PointM
    spread_m: float
    step: int


@dataclass(frozen=True, slots=True, eq=False)
class EnergyTrackingKnowledge:
    """What a node is given at the start.

    Attributes:
        has_sensor: Whether it can read its surroundings.
        sensors_m: The deployment plan: where the sensors are, by node id.
        model: How trackers assume that energy shows in readings.
        sensing_range_m: Range within which a target's energy counts: three times the noise at that range.
        reading_s: Time between two readings.
        max_speed_m_per_s: Greatest speed of a target that is assumed.
        targets: How many targets there are.
        starts: Tracks that this node begins.
        labels: How what sensors read besides the energy tells classes of targets; None where they read nothing else.
    """

    has_sensor: bool
    sensors_m: Mapping[int, PointM]
    model: EnergyModel
    sensing_range_m: float
    reading_s: float
    max_speed_m_per_s: float
    targets: int
    starts: tuple[TrackStart, ...] = ()
    labels: VehicleLabels | None = None

    def nearest(self, place_m: PointM, without: Iterable[int] = ()) -> list[int]:
        """Nodes with a sensor, the nearest to a place first; of equals the lower id."""
        left_out = set(without)
        distance_m = {
            node: float(np.hypot(x_m - place_m[0], y_m - place_m[1]))
            for node, (x_m, y_m) in self.sensors_m.items()
            if node not in left_out
        }
        return sorted(distance_m, key=lambda node: (distance_m[node], node))

    def places_m(self, nodes: Iterable[int]) -> FloatArray:
        """Where some sensors are, shape (n, 2)."""
        return np.array([self.sensors_m[node] for node in nodes], dtype=float).reshape(-1, 2)
