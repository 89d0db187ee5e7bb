"""Ways of targets through the field."""

import math
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Literal

import numpy as np

from netsim.parameters import NonNegative, PointM, Positive, parameters
from netsim.rng import Streams
from netsim.units import s_to_ns


@parameters
class StraightTrack:
    """A straight line at constant speed, from end to end."""

    type: Literal["straight"] = "straight"
    """Kind of track."""
    from_m: PointM
    """Where it enters."""
    to_m: PointM
    """Where it leaves."""
    speed_m_per_s: Positive = 7.0
    """Speed."""
    enters_s: NonNegative = 0.0
    """When it enters."""


TrackParameters = StraightTrack


@dataclass(frozen=True, slots=True)
class Track:
    """Where a target is, from when it enters until it leaves.

    Attributes:
        times_ns: When it is at each point, ascending, at least one.
        points_m: The points, shape (n, 2); it moves in straight lines between them.
    """

    times_ns: tuple[int, ...]
    points_m: tuple[tuple[float, float], ...]

    def at(self, time_ns: int) -> tuple[float, float] | None:
        """Where it is at a time; None before and after."""
        if not self.times_ns[0] <= time_ns <= self.times_ns[-1]:
            return None
        x_m, y_m = (float(np.interp(time_ns, self.times_ns, column)) for column in zip(*self.points_m, strict=True))
        return x_m, y_m


def track_of(
    parameters: TrackParameters,
    number: int,
    field_m: tuple[float, float, float, float],
    streams: Streams,
    folder: FilePath,
) -> Track:
    """The way of a target.

    Args:
        parameters: Its kind.
        number: Of the target, for its random stream `world/target/<number>`.
        field_m: The field: low x, low y, high x, high y.
        streams: The run's random streams.
        folder: What files are relative to.

    Raises:
        ScenarioError: For a file that is missing or wrong.
    """
    begin_ns = s_to_ns(parameters.enters_s)
    length_m = math.dist(parameters.from_m, parameters.to_m)
    end_ns = begin_ns + s_to_ns(length_m / parameters.speed_m_per_s)
    return Track((begin_ns, end_ns), (parameters.from_m, parameters.to_m))
