"""What holds at an instant: the state of nodes, targets, tracks and faults, kept up to date event by event."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from netsim.movie.cast import Cast, Places
from netsim.trace.events import (
    Belief,
    Estimate,
    Event,
    Fault,
    Group,
    NodeEnergy,
    NodeLife,
    Particles,
    Role,
    TruthTargets,
)
from netsim.units import s_to_ns

HOLD_NS = s_to_ns(5.0)
"""How long a belief, a group or a cloud of particles is shown when nothing follows; as in the replay."""
_TRAIL = 40  # places in a trail
_PLACE = re.compile(r"\((-?\d+(?:\.\d+)?),\s*(-?\d+(?:\.\d+)?)\) m\b")
_LEADER = "leader"
"""First word of the role; where a node leads several tracks, their numbers follow."""
UP, DEAD, CRASHED = range(3)
_LIFE = {"died": DEAD, "crashed": CRASHED, "started": UP, "rebooted": UP}

Line = tuple[int, int]
"""Number of a track and of its thread."""


@dataclass(frozen=True)
class Moment:
    """What the map shows at an instant, messages aside.

    Attributes:
        time_ns: The instant.
        charge: Energy left of each row of the node table, as a fraction; not a number on mains power.
        life: `UP`, `DEAD` or `CRASHED` for each row.
        leaders: Rows of the nodes that lead.
        targets: True place of each target.
        target_trails: Where each target was lately, shape (n, 2).
        estimates: The latest estimate of each track.
        trails: Where the estimates were lately.
        beliefs: The latest grid belief of each track.
        particles: By number of the track: the latest cloud and which of its tracks that is.
        groups: By number of the track: rows of the members of the latest group, and whether it is a joint one.
        struck: Rows that a fault rule concerns.
        jammers: Places of jammers at work.
    """

    time_ns: int
    charge: NDArray[np.float64]
    life: NDArray[np.int8]
    leaders: tuple[int, ...]
    targets: Mapping[int, tuple[float, float]]
    target_trails: Mapping[int, Places]
    estimates: Mapping[Line, Estimate]
    trails: Mapping[Line, Places]
    beliefs: Mapping[Line, Belief]
    particles: Mapping[int, tuple[Particles, int]]
    groups: Mapping[int, tuple[tuple[int, ...], bool]]
    struck: tuple[int, ...]
    jammers: tuple[tuple[float, float], ...]


class _Trails:
    """The last places of things by name, as arrays made once each."""

    def __init__(self) -> None:
        self._places: dict[Any, Places] = {}

    def add(self, name: Any, x_m: float, y_m: float) -> None:
        before = self._places.get(name, np.empty((0, 2)))
        self._places[name] = np.concatenate([before, [[x_m, y_m]]])[-_TRAIL:]

    def now(self) -> dict[Any, Places]:
        return dict(self._places)


class _Lately:
    """The latest word about things by name, forgotten after a while."""

    def __init__(self) -> None:
        self._told: dict[Any, tuple[int, Any]] = {}

    def tell(self, name: Any, time_ns: int, what: Any) -> None:
        self._told[name] = time_ns, what

    def forget(self, name: Any) -> None:
        self._told.pop(name, None)

    def now(self, time_ns: int) -> dict[Any, Any]:
        return {name: what for name, (told_ns, what) in self._told.items() if time_ns - told_ns < HOLD_NS}


class State:
    """Takes events in their order and tells what holds."""

    def __init__(self, cast: Cast) -> None:
        self._cast = cast
        self._full_j = np.asarray(cast.nodes.battery_j, np.float64)
        self._charge = np.where(np.isfinite(self._full_j), 1.0, np.nan)
        self._life = np.zeros(cast.size, np.int8)
        self._roles: set[tuple[int, str]] = set()
        self._targets: dict[int, tuple[float, float]] = {}
        self._estimates: dict[Line, Estimate] = {}
        self._target_trails, self._trails = _Trails(), _Trails()
        self._beliefs, self._particles, self._groups = _Lately(), _Lately(), _Lately()
        self._struck: dict[int, tuple[int, ...]] = {}
        self._jammers: dict[int, tuple[float, float]] = {}
        self._takers: dict[type[Event], Callable[[int, Any], None]] = {
            NodeEnergy: self._take_energy,
            NodeLife: self._take_life,
            Role: self._take_role,
            TruthTargets: self._take_targets,
            Estimate: self._take_estimate,
            Belief: self._take_belief,
            Particles: self._take_particles,
            Group: self._take_group,
            Fault: self._take_fault,
        }

    @property
    def topics(self) -> set[str]:
        """The topics it wants to see."""
        return {event_type.topic for event_type in self._takers}

    def take(self, time_ns: int, event: Event) -> None:
        """An event, of those topics or not."""
        taker = self._takers.get(type(event))
        if taker is not None:
            taker(time_ns, event)

    def moment(self, time_ns: int) -> Moment:
        """What holds after all events taken."""
        return Moment(
            time_ns=time_ns,
            charge=self._charge,
            life=self._life,
            leaders=tuple(sorted({row for row, _ in self._roles})),
            targets=self._targets,
            target_trails=self._target_trails.now(),
            estimates=dict(self._estimates),
            trails=self._trails.now(),
            beliefs=self._beliefs.now(time_ns),
            particles=self._particles.now(time_ns),
            groups=self._groups.now(time_ns),
            struck=tuple(sorted({row for rows in self._struck.values() for row in rows})),
            jammers=tuple(self._jammers.values()),
        )

    def _take_energy(self, time_ns: int, event: NodeEnergy) -> None:
        rows = self._cast.rows(np.asarray(event.node, np.int64))
        left_j, full_j = np.asarray(event.left_j)[rows >= 0], self._full_j[rows[rows >= 0]]
        charge = self._charge.copy()
        with np.errstate(invalid="ignore"):
            fraction = np.clip(left_j / np.maximum(full_j, 1e-30), 0.0, 1.0)
        charge[rows[rows >= 0]] = np.where(np.isfinite(full_j), fraction, np.nan)
        self._charge = charge

    def _take_life(self, time_ns: int, event: NodeLife) -> None:
        row, life = self._cast.row(event.node), _LIFE.get(event.event)
        if row < 0 or life is None:
            return
        self._life = self._life.copy()
        self._life[row] = life
        if life != UP:
            self._roles = {held for held in self._roles if held[0] != row}

    def _take_role(self, time_ns: int, event: Role) -> None:
        row = self._cast.row(event.node)
        if row >= 0 and event.role.split(" ")[0] == _LEADER:
            (self._roles.add if event.holds else self._roles.discard)((row, event.role))

    def _take_targets(self, time_ns: int, event: TruthTargets) -> None:
        columns = (np.asarray(column).tolist() for column in (event.target, event.x_m, event.y_m))
        self._targets = {target: (x_m, y_m) for target, x_m, y_m in zip(*columns, strict=True)}
        for target, place in self._targets.items():
            self._target_trails.add(target, *place)

    def _take_estimate(self, time_ns: int, event: Estimate) -> None:
        line = event.target, event.thread
        self._estimates[line] = event
        self._trails.add(line, event.x_m, event.y_m)

    def _take_belief(self, time_ns: int, event: Belief) -> None:
        self._beliefs.tell((event.target, event.thread), time_ns, event)

    def _take_particles(self, time_ns: int, event: Particles) -> None:
        for place, track in enumerate(np.asarray(event.target).tolist()):
            self._particles.tell(track, time_ns, (event, place))

    def _take_group(self, time_ns: int, event: Group) -> None:
        """Of a joint group one hull is shown, that of its first track."""
        tracks = np.asarray(event.target).tolist()
        rows = self._cast.rows(np.asarray(event.member, np.int64))
        for track in tracks:
            self._groups.forget(track)
        if tracks and (rows >= 0).any():
            self._groups.tell(tracks[0], time_ns, (tuple(rows[rows >= 0].tolist()), len(tracks) > 1))

    def _take_fault(self, time_ns: int, event: Fault) -> None:
        """A rule that concerns every node says nothing about any of them."""
        if event.event == "strikes":
            return
        self._struck.pop(event.rule, None)
        self._jammers.pop(event.rule, None)
        if event.event != "begins":
            return
        rows = self._cast.rows(np.asarray(event.node, np.int64))
        if len(rows) < self._cast.size:
            self._struck[event.rule] = tuple(rows[rows >= 0].tolist())
        found = _PLACE.search(event.detail)
        if found is not None:
            self._jammers[event.rule] = float(found[1]), float(found[2])
