"""How groups and their tracks stand at an instant (Liu et al. 2004, Fig. 6)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.metrics.tracks import Points
from netsim.snapshots.load import Cloud, Place, TrackRun
from netsim.snapshots.moment import HOLD_S, SOON_S, down, way
from netsim.units import s_to_ns

_SPREAD = 4
"""How many instants are looked at where no group was ever joint."""
_WORD_S = 1.0
"""How long a word between leaders is shown."""
_SOON_SHARE, _LATE_SHARE = 0.15, 0.75
"""Which share of the time after a joint group's end two of the usual instants come."""


@dataclass(frozen=True, slots=True)
class GroupTrack:
    """A track at an instant.

    Attributes:
        number: Its number.
        told_ns: When its leader last told its particles.
        leader: Who leads.
        mates: The tracks of its group, itself among them; more than one in a joint group.
        particles_m: Its particles, drawn before its leader's last measurement, shape (P, 2).
        weights: What the measurement made of them, shape (P,).
        place_m: Its last estimate.
        trail_m: Its estimates so far, in order.
        row: Whom it follows, by target; empty if nobody told.
    """

    number: int
    told_ns: int
    leader: int
    mates: tuple[int, ...]
    particles_m: FloatArray
    weights: FloatArray
    place_m: Place
    trail_m: Sequence[Place]
    row: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class GroupMoment:
    """An instant.

    Attributes:
        time_ns: When.
        tracks: Tracks of which somebody spoke not long ago, by number.
        targets: Where targets are.
        ways_m: Where each of these targets was, in order.
        down: Nodes that are dead or crashed.
        words_m: From where to where leaders told each other of identities, not long ago.
    """

    time_ns: int
    tracks: Mapping[int, GroupTrack]
    targets: Points
    ways_m: Mapping[int, Sequence[Place]]
    down: frozenset[int]
    words_m: Sequence[tuple[Place, Place]]


def group_moment(run: TrackRun, time_ns: int) -> GroupMoment:
    """How things stand at an instant."""
    latest: dict[int, Cloud] = {}
    for cloud in run.clouds:
        if time_ns - s_to_ns(HOLD_S) <= cloud.time_ns <= time_ns:
            latest.update(dict.fromkeys(cloud.tracks, cloud))
    targets = run.truth.at(time_ns)
    ways = {target: [*way(run, target, time_ns), place_m] for target, place_m in targets.items()}
    tracks = {track: _track(run, track, cloud, time_ns) for track, cloud in sorted(latest.items())}
    return GroupMoment(time_ns, tracks, targets, ways, down(run, time_ns), _words_m(run, time_ns))


def _words_m(run: TrackRun, time_ns: int) -> list[tuple[Place, Place]]:
    return [
        (run.places_m[source], run.places_m[destination])
        for at_ns, source, destination in run.words
        if time_ns - s_to_ns(_WORD_S) < at_ns <= time_ns and {source, destination} <= set(run.places_m)
    ]


def _track(run: TrackRun, number: int, cloud: Cloud, time_ns: int) -> GroupTrack:
    particles_m = cloud.places_m[cloud.tracks.index(number)]
    guesses = [each.place_m for each in run.guesses if each.line[0] == number and each.time_ns <= time_ns]
    rows = [each.probability for each in run.rows if each.track == number and each.time_ns <= time_ns]
    x_m, y_m = np.average(particles_m, axis=0, weights=cloud.weights).tolist()
    place_m = guesses[-1] if guesses else (x_m, y_m)
    row = rows[-1] if rows else ()
    return GroupTrack(
        number, cloud.time_ns, cloud.node, cloud.tracks, particles_m, cloud.weights, place_m, guesses, row
    )


def joint_spans_ns(run: TrackRun) -> list[tuple[int, int]]:
    """From the first to the last particles of every joint group, in order."""
    return [(begin_ns, end_ns) for _, begin_ns, end_ns in joint_groups(run)]


def joint_groups(run: TrackRun) -> list[tuple[tuple[int, ...], int, int]]:
    """The tracks of every joint group, and from when to when it told particles, in order."""
    spans: list[tuple[tuple[int, ...], int, int]] = []
    together: dict[tuple[int, ...], int] = {}
    for cloud in run.clouds:
        for parted in [tracks for tracks in together if tracks != cloud.tracks and set(tracks) & set(cloud.tracks)]:
            del together[parted]
        if len(cloud.tracks) < 2:
            continue
        if cloud.tracks not in together:
            together[cloud.tracks] = len(spans)
            spans.append((cloud.tracks, cloud.time_ns, cloud.time_ns))
        number = together[cloud.tracks]
        spans[number] = *spans[number][:2], cloud.time_ns
    return spans


def usual_group_times_ns(run: TrackRun) -> list[int]:
    """Instants worth a look: before the first joint group, amidst it, soon after and long after; told times only."""
    first_ns, last_ns = run.clouds[0].time_ns, run.clouds[-1].time_ns
    told_ns = sorted({cloud.time_ns for cloud in run.clouds})
    soonest_ns = {
        min((at for at in told_ns if at >= wanted), default=last_ns) for wanted in _wanted_ns(run, first_ns, last_ns)
    }
    return sorted({settled_ns(run, time_ns) for time_ns in soonest_ns})


def settled_ns(run: TrackRun, time_ns: int) -> int:
    """When all groups have told that tell right after an instant, or the instant itself: they do not tell at once."""
    until_ns = time_ns + s_to_ns(SOON_S)
    return max((cloud.time_ns for cloud in run.clouds if time_ns <= cloud.time_ns <= until_ns), default=time_ns)


def _wanted_ns(run: TrackRun, first_ns: int, last_ns: int) -> Iterator[int]:
    spans = joint_spans_ns(run)
    if not spans:
        yield from (first_ns + (last_ns - first_ns) * (2 * part + 1) // (2 * _SPREAD) for part in range(_SPREAD))
        return
    begin_ns, end_ns = max(spans, key=lambda span: span[1] - span[0])
    yield (first_ns + begin_ns) // 2
    yield (begin_ns + end_ns) // 2
    words_ns = [at_ns for at_ns, *_ in run.words if at_ns > end_ns]
    yield min(words_ns, default=end_ns + round((last_ns - end_ns) * _SOON_SHARE))
    yield end_ns + round((last_ns - end_ns) * _LATE_SHARE)
