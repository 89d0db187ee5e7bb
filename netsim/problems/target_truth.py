"""The truth of problems whose targets move on ways of their own."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.models.tracks import Track, TrackParameters, track_of
from netsim.rng import Streams
from netsim.trace.events import Event, TruthTargets
from netsim.units import s_to_ns

Box = tuple[float, float, float, float]
"""A field: low x, low y, high x, high y, in metres."""


def ways_of(targets: Sequence[TrackParameters], field_m: Box, streams: Streams, folder: Path) -> tuple[Track, ...]:
    """The targets' ways, in order.

    Raises:
        ScenarioError: For one that is wrong (see `netsim.models.tracks.track_of`), named by its place in the scenario.
    """
    return tuple(_way(each, number, field_m, streams, folder) for number, each in enumerate(targets))


def _way(target: TrackParameters, number: int, field_m: Box, streams: Streams, folder: Path) -> Track:
    try:
        return track_of(target, number, field_m, streams, folder)
    except ScenarioError as error:
        if error.findings:
            raise
        text = f"targets[{number}].track: {error}"
        raise ScenarioError(text) from error


def targets_at(tracks: Sequence[Track], time_ns: int) -> TruthTargets:
    """Where the targets are that are there at a time."""
    places = {number: track.at(time_ns) for number, track in enumerate(tracks)}
    there = {number: place for number, place in places.items() if place is not None}
    return TruthTargets(list(there), [x for x, _ in there.values()], [y for _, y in there.values()])


def later_targets(tracks: Sequence[Track], reading_s: float, end_ns: int) -> Iterable[tuple[int, Event]]:
    """Where the targets are at every reading after time 0 up to an end, and when one enters or leaves."""
    step_ns = s_to_ns(reading_s)
    turns = {time_ns for track in tracks for time_ns in (*track.times_ns, track.times_ns[-1] + 1)}
    times_ns = {*range(step_ns, end_ns + 1, step_ns), *(time_ns for time_ns in turns if 0 < time_ns <= end_ns)}
    return ((time_ns, targets_at(tracks, time_ns)) for time_ns in sorted(times_ns))
