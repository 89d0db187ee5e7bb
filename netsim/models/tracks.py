"""Ways of targets through the field: straight, from point to point, drawn at random, or from a file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Annotated, Literal

from annotated_types import MinLen

from netsim.models.manoeuvre import ManoeuvreTrack, manoeuvred
from netsim.models.track_files import TrackPoint, read_track
from netsim.models.waypoints import along
from netsim.parameters import Name, NonNegative, PointM, Positive, parameters
from netsim.rng import Streams
from netsim.units import NS_PER_S, s_to_ns


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

    def __post_init__(self) -> None:
        """A way has a length."""
        if self.from_m == self.to_m:
            message = "two different places from_m and to_m"
            raise ValueError(message)


@parameters
class WaypointTrack:
    """Straight lines at even speed from point to point; the target is there from the first point's time to the last's."""

    type: Literal["waypoints"] = "waypoints"
    """Kind of track."""
    points: Annotated[tuple[TrackPoint, ...], MinLen(2)]
    """The points."""

    def __post_init__(self) -> None:
        """Points in order."""
        if any(later.at_s <= earlier.at_s for earlier, later in pairwise(self.points)):
            message = "points in the order of their times"
            raise ValueError(message)


@parameters
class FileTrack:
    """As `waypoints`, from a CSV file with the columns time_s, x_m, y_m, and target where it holds several."""

    type: Literal["file"] = "file"
    """Kind of track."""
    file: Name
    """The file, relative to the scenario."""
    target: Name | int | None = None
    """Which of the targets of a file that has several: what stands in its column `target`."""


TrackParameters = StraightTrack | WaypointTrack | ManoeuvreTrack | FileTrack


@dataclass(frozen=True, slots=True)
class Track:
    """Where a target is, from when it enters until it leaves.

    Attributes:
        times_ns: When it is at each point, ascending, at least two.
        points_m: The points, shape (n, 2); it moves in straight lines between them.
    """

    times_ns: tuple[int, ...]
    points_m: tuple[tuple[float, float], ...]

    def at(self, time_ns: int) -> tuple[float, float] | None:
        """Where it is at a time; None before and after."""
        if not self.times_ns[0] <= time_ns <= self.times_ns[-1]:
            return None
        return along(self.times_ns, self.points_m, time_ns)

    @property
    def top_speed_m_per_s(self) -> float:
        """Its greatest speed."""
        legs = zip(pairwise(self.points_m), pairwise(self.times_ns), strict=True)
        return max(math.dist(*ends) * NS_PER_S / (end_ns - begin_ns) for ends, (begin_ns, end_ns) in legs)


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
        ScenarioError: For a file that is missing or wrong, or a start outside the field of a target that stays in it.
    """
    if isinstance(parameters, StraightTrack):
        return _straight(parameters)
    if isinstance(parameters, ManoeuvreTrack):
        return Track(*manoeuvred(parameters, field_m, streams.generator(f"world/target/{number}")))
    if isinstance(parameters, WaypointTrack):
        return _through(parameters.points)
    wanted = None if parameters.target is None else str(parameters.target)
    return _through(read_track(folder / parameters.file, wanted))


def _straight(parameters: StraightTrack) -> Track:
    begin_ns = s_to_ns(parameters.enters_s)
    length_m = math.dist(parameters.from_m, parameters.to_m)
    end_ns = begin_ns + max(1, s_to_ns(length_m / parameters.speed_m_per_s))
    return Track((begin_ns, end_ns), (parameters.from_m, parameters.to_m))


def _through(points: Sequence[TrackPoint]) -> Track:
    return Track(tuple(s_to_ns(point.at_s) for point in points), tuple((point.x_m, point.y_m) for point in points))
