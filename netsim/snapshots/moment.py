"""How a track stands at an instant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from netsim.metrics.tracks import Points
from netsim.snapshots.load import Line, Place, Step, TrackRun
from netsim.trace.events import Handoff
from netsim.units import NS_PER_S, s_to_ns

HOLD_S = 5.0
"""How long a belief or an estimate speaks for its track, as in the metrics on tracking."""
SOON_S = 0.05
"""A belief that is told so soon after a reading is still that of the reading's instant."""
_SPREAD = 3
"""How many instants are looked at unless others are asked for."""
_SHOWN_LEADERS = 10
_TENTH_S = 0.03  # what is nearer to a tenth of a second is written as that


@dataclass(frozen=True, slots=True)
class Now:
    """A track, or one of its threads, at an instant.

    Attributes:
        step: Its last belief.
        choice: Whom its leader chose then; None if nobody was, or a centre holds the belief.
        trail_m: Its estimates so far, in order, without those of beliefs that know nothing.
        led_m: Where its last leaders stood, in order, the present one last; empty where a centre holds the belief.
    """

    step: Step
    choice: Handoff | None
    trail_m: Sequence[Place]
    led_m: Sequence[Place]


@dataclass(frozen=True, slots=True)
class Moment:
    """An instant.

    Attributes:
        time_ns: When.
        tracks: Tracks and threads with a belief that is not too old.
        targets: Where targets are.
        ways_m: Where each of these targets was, in order.
        down: Nodes that are dead or crashed.
    """

    time_ns: int
    tracks: Mapping[Line, Now]
    targets: Points
    ways_m: Mapping[int, Sequence[Place]]
    down: frozenset[int]


def moment(run: TrackRun, time_ns: int) -> Moment:
    """How things stand at an instant."""
    alive: dict[Line, Step] = {}
    for step in run.steps:
        if time_ns - s_to_ns(HOLD_S) <= step.time_ns <= time_ns:
            alive[step.line] = step
    targets = run.truth.at(time_ns)
    ways = {target: [*way(run, target, time_ns), place_m] for target, place_m in targets.items()}
    tracks = {line: _now(run, step) for line, step in sorted(alive.items())}
    return Moment(time_ns, tracks, targets, ways, down(run, time_ns))


def _now(run: TrackRun, step: Step) -> Now:
    steps = [each for each in run.steps if each.line == step.line and each.time_ns <= step.time_ns]
    blank_ns = {each.time_ns for each in steps if each.is_blank}
    guesses = [each for each in run.guesses if each.line == step.line and each.time_ns <= step.time_ns]
    trail = [each.place_m for each in guesses if each.time_ns not in blank_ns]
    led = [run.places_m[each.node] for each in steps if each.node in run.leaders and each.node in run.places_m]
    return Now(step, run.choice(step), trail, led[-_SHOWN_LEADERS:] if step.node in run.leaders else [])


def way(run: TrackRun, target: int, time_ns: int) -> list[Place]:
    """Where a target was until an instant, as it was recorded."""
    return [places[target] for at_ns, places in run.targets if at_ns <= time_ns and target in places]


def down(run: TrackRun, time_ns: int) -> frozenset[int]:
    """Nodes that are dead or crashed at an instant."""
    found: set[int] = set()
    for at_ns, node, is_down in run.lives:
        if at_ns <= time_ns:
            (found.add if is_down else found.discard)(node)
    return frozenset(found)


def usual_times_ns(run: TrackRun) -> list[int]:
    """Instants of beliefs in the middle of each third of the time in which there are any, with what is told soon after."""
    first_ns, last_ns = run.steps[0].time_ns, run.steps[-1].time_ns
    wanted = [first_ns + (last_ns - first_ns) * (2 * third + 1) // (2 * _SPREAD) for third in range(_SPREAD)]
    nearest = (min((abs(step.time_ns - at), step.time_ns) for step in run.steps)[1] for at in wanted)
    soon_ns = s_to_ns(SOON_S)
    return sorted({max(step.time_ns for step in run.steps if 0 <= step.time_ns - at <= soon_ns) for at in nearest})


def in_seconds(time_ns: int) -> str:
    """An instant as people write it."""
    time_s = time_ns / NS_PER_S
    digits = 1 if abs(time_s - round(time_s, 1)) < _TENTH_S else 2
    return f"{time_s:.{digits}f} s"
