"""What nodes that track may know: their sensors, whom they talk to, the grid and the assumed motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.beamformer import ArrayProcessing
from netsim.kernels.grid_belief import Grid


@dataclass(frozen=True, slots=True)
class TrackingKnowledge:
    """What a node is given at the start.

    Attributes:
        sensor: Its own sensor; None for a node without.
        others: Sensors it knows of, by node, the nearest first: those within the range of its neighbourhood, and at least
            one more than the least number of neighbours; all of them for a sink.
        neighbourhood_m: Range within which nodes hand over to each other.
        least_neighbours: The nearest so many are neighbours whatever their distance.
        grid: Cells of the belief.
        reading_s: Time between two readings.
        max_speed_m_per_s: Greatest speed of a target that is assumed.
        leads_first: Whether it leads the first track from the first reading on.
        is_watchdog: Whether it watches for targets while nobody tracks.
        processing: How it makes a bearing out of the samples of its microphones; None where its sensor gives readings
            (see `netsim.kernels.beamformer.reading_of`).
    """

    sensor: SensorSpec | None
    others: Mapping[int, SensorSpec]
    neighbourhood_m: float
    least_neighbours: int
    grid: Grid
    reading_s: float
    max_speed_m_per_s: float
    leads_first: bool = False
    is_watchdog: bool = False
    processing: ArrayProcessing | None = None

    def neighbours(self, position_m: tuple[float, float], without: Sequence[int] = ()) -> tuple[int, ...]:
        """To whom a leader here may hand over (Liu, Reich, Zhao 2002, section 5.1).

        Those within the range; where fewer than the least number are left, the nearest. Nodes in `without`, such as the
        leader before (the paper's triplet rule), are left out first.

        Args:
            position_m: Where the leader is.
            without: Nodes left out.
        """
        here = np.asarray(position_m)
        distance_m = {
            node: float(np.hypot(*(np.asarray(spec.position_m) - here)))
            for node, spec in self.others.items()
            if node not in without
        }
        order = sorted(distance_m, key=lambda node: (distance_m[node], node))
        near = [node for node in order if distance_m[node] <= self.neighbourhood_m]
        return tuple(near if len(near) >= self.least_neighbours else order[: self.least_neighbours])
