"""From a trace to its tracks: sensors, targets, beliefs, estimates, identities, choices of leaders."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from netsim.errors import ScenarioError, TraceError
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.semiring import FloatArray
from netsim.metrics.leaders import Leaders, Span
from netsim.metrics.tracking_beliefs import belief_of
from netsim.metrics.tracks import Points, TargetTruth
from netsim.trace.events import (
    Belief,
    EnergyLedger,
    Estimate,
    Event,
    FieldInfo,
    Handoff,
    Identity,
    MessageSent,
    NodeLife,
    NodeTable,
    Particles,
    Problem,
    Role,
    TruthTargets,
)
from netsim.trace.reader import read_trace, trace_metadata

_KINDS = (
    Belief, EnergyLedger, Estimate, FieldInfo, Handoff, Identity, MessageSent, NodeLife, NodeTable, Particles, Problem, Role,
    TruthTargets,
)  # fmt: skip
WORD = "word"
"""Kind of the messages in which leaders tell each other who is who."""
_TOPICS = {each.topic for each in _KINDS}
_DOWN, _UP = ("died", "crashed"), ("started", "rebooted")

Place = tuple[float, float]
Line = tuple[int, int]
"""A track's number and which of its redundant threads: what one belief wanders along."""


@dataclass(frozen=True, slots=True)
class Step:
    """A belief as a node recorded it.

    Attributes:
        time_ns: When.
        node: Who.
        line: Which track, and which of its threads.
        number: Of the step.
        belief: The belief.
    """

    time_ns: int
    node: int
    line: Line
    number: int
    belief: GridBelief

    @property
    def is_blank(self) -> bool:
        """Whether it knows nothing: all cells are equally probable."""
        return len(self.belief.cells) > 1 and float(np.ptp(self.belief.probability)) == 0.0


@dataclass(frozen=True, slots=True)
class Guess:
    """An estimate: when, by whom, of which track and thread, where."""

    time_ns: int
    node: int
    line: Line
    place_m: Place


@dataclass(frozen=True, slots=True)
class Cloud:
    """The particles of a group as its leader recorded them.

    Attributes:
        time_ns: When.
        node: The leader.
        tracks: Numbers of the tracks of the group.
        weights: Of the particles, shape (particles,).
        places_m: Where they were drawn before the measurement, shape (tracks, particles, 2).
    """

    time_ns: int
    node: int
    tracks: tuple[int, ...]
    weights: FloatArray
    places_m: FloatArray


@dataclass(frozen=True, slots=True)
class Row:
    """Whom a track follows, by target, as a node told it."""

    time_ns: int
    node: int
    track: int
    probability: tuple[float, ...]


@dataclass
class TrackRun:
    """A run that tracks.

    Attributes:
        title: Name of the scenario and seed.
        box_m: The field: low x, low y, high x, high y.
        names: Of the nodes.
        places_m: Where the nodes stand.
        measures: What each sensor measures: `amplitude` or `bearing`.
        sinks: Nodes with the role of a sink.
        truth: Where targets are.
        targets: The same as it was recorded.
        range_m: Within which sensors are of a target's group; None where there are no groups.
        cut_off_m: From which distance on a group's track follows no target.
        steps: All beliefs on grids, in order.
        clouds: All beliefs as particles, in order.
        rows: All beliefs of who is who, in order.
        words: When which leader told which other one of that.
        guesses: All estimates, in order.
        choices: Whom a node chose at a step of a line: the last whom it tried, among all from whom it could choose.
        leaders: Nodes that ever lead.
        lives: When a node went down (True) or came up.
        outages_ns: When nobody led though a target was there.
    """

    title: str
    box_m: tuple[float, float, float, float] | None = None
    names: dict[int, str] = field(default_factory=dict)
    places_m: dict[int, Place] = field(default_factory=dict)
    measures: dict[int, str] = field(default_factory=dict)
    sinks: set[int] = field(default_factory=set)
    truth: TargetTruth = field(default_factory=TargetTruth)
    targets: list[tuple[int, Points]] = field(default_factory=list)
    range_m: float | None = None
    cut_off_m: float = math.inf
    steps: list[Step] = field(default_factory=list)
    clouds: list[Cloud] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    words: list[tuple[int, int, int]] = field(default_factory=list)
    guesses: list[Guess] = field(default_factory=list)
    choices: dict[tuple[int, Line, int], Handoff] = field(default_factory=dict)
    leaders: set[int] = field(default_factory=set)
    lives: list[tuple[int, int, bool]] = field(default_factory=list)
    outages_ns: list[Span] = field(default_factory=list)

    def is_leaderless(self, time_ns: int) -> bool:
        """Whether nobody leads at an instant though somebody did and a target is there."""
        return any(begin_ns <= time_ns < end_ns for begin_ns, end_ns in self.outages_ns)

    @cached_property
    def lines(self) -> list[Line]:
        """Tracks and their threads in the order in which they began."""
        return list(dict.fromkeys(step.line for step in self.steps))

    @property
    def has_threads(self) -> bool:
        """Whether some track has redundant threads."""
        return any(thread for _, thread in self.lines)

    def ordinal(self, line: Line) -> int:
        """The place of a track in the order in which they began, from 1."""
        return list(dict.fromkeys(track for track, _ in self.lines)).index(line[0]) + 1

    def line_name(self, line: Line) -> str:
        """A track, a thread, or both, whatever tells it from the others."""
        tracks = len({track for track, _ in self.lines})
        of_tracks = [f"track {self.ordinal(line)}"] if tracks > 1 or not self.has_threads else []
        return ", ".join([*of_tracks, *([f"thread {line[1] + 1}"] if self.has_threads else [])])

    def choice(self, step: Step) -> Handoff | None:
        """Whom the node of a step chose as next leader."""
        return self.choices.get((step.node, step.line, step.number))


def load_track(trace: Path) -> TrackRun:
    """Read the track of a run.

    Raises:
        ScenarioError: If nobody recorded a belief of where a target is.
        TraceError: If the trace cannot be read, has no nodes or no field.
    """
    metadata = trace_metadata(trace)
    run = TrackRun(f"{metadata.get('scenario', trace.stem)}, seed {metadata.get('seed', '?')}")
    leading = Leaders()
    follow = leading.handlers()
    for time_ns, event in read_trace(trace, _TOPICS):
        if type(event) in _TAKE:
            _TAKE[type(event)](run, event, time_ns)
        if type(event) in follow:
            follow[type(event)](event, time_ns)
    run.outages_ns = leading.outages_ns()
    if not run.places_m or run.box_m is None:
        message = f"{trace}: expected a table of nodes and a field, got none"
        raise TraceError(message)
    if not run.steps and not run.clouds:
        message = (
            f"{trace}: expected beliefs of where a target is, got none; the algorithm records none, or the run ended "
            "before the first"
        )
        raise ScenarioError(message)
    return run


def _take_nodes(run: TrackRun, event: NodeTable, _: int) -> None:
    nodes = list(map(int, event.node))
    run.names = dict(zip(nodes, event.name, strict=True))
    run.places_m = dict(zip(nodes, zip(map(float, event.x_m), map(float, event.y_m), strict=True), strict=True))
    run.sinks = {node for node, role in zip(nodes, event.role, strict=True) if role == "sink"}


def _take_field(run: TrackRun, event: FieldInfo, _: int) -> None:
    run.box_m = (event.x_m, event.y_m, event.x_m + event.width_m, event.y_m + event.height_m)


def _take_problem(run: TrackRun, event: Problem, _: int) -> None:
    if event.kind == "tracking":
        run.measures = {each["node"]: each["measures"] for each in json.loads(event.content_json)["sensors"]}
    elif event.kind == "energy-tracking":
        content = json.loads(event.content_json)
        run.range_m, run.cut_off_m = float(content["sensing_range_m"]), float(content["cut_off_m"])


def _take_truth(run: TrackRun, event: TruthTargets, now_ns: int) -> None:
    run.truth.add(event, now_ns)
    places_m = zip(map(float, event.x_m), map(float, event.y_m), strict=True)
    run.targets.append((now_ns, dict(zip(map(int, event.target), places_m, strict=True))))


def _take_belief(run: TrackRun, event: Belief, now_ns: int) -> None:
    if len(event.cell):
        run.steps.append(Step(now_ns, event.node, (event.target, event.thread), event.step, belief_of(event)))


def _take_particles(run: TrackRun, event: Particles, now_ns: int) -> None:
    tracks = tuple(map(int, event.target))
    places_m = np.column_stack([event.x_m, event.y_m]).astype(float).reshape(len(tracks), -1, 2)
    run.clouds.append(Cloud(now_ns, event.node, tracks, np.asarray(event.weight, float), places_m))


def _take_identity(run: TrackRun, event: Identity, now_ns: int) -> None:
    run.rows.append(Row(now_ns, event.node, event.track, tuple(map(float, event.probability))))


def _take_message(run: TrackRun, event: MessageSent, now_ns: int) -> None:
    if event.kind == WORD:
        run.words.append((now_ns, event.source, event.destination))


def _take_estimate(run: TrackRun, event: Estimate, now_ns: int) -> None:
    run.guesses.append(Guess(now_ns, event.node, (event.target, event.thread), (float(event.x_m), float(event.y_m))))


def _take_handoff(run: TrackRun, event: Handoff, _: int) -> None:
    """Who is chosen after another one did not take the belief is the next leader; among whom says the first choice."""
    line = event.target, event.thread
    step = event.node, line, event.step
    first = run.choices.setdefault(step, event)
    last = next((each for each in reversed(run.steps) if each.line == line), None)
    if last is not None and (last.node, last.line, last.number) == step:  # else it was taken back later on
        run.choices[step] = replace(first, destination=event.destination)


def _take_role(run: TrackRun, event: Role, _: int) -> None:
    if event.role == "leader" and event.holds:
        run.leaders.add(event.node)


def _take_life(run: TrackRun, event: NodeLife, now_ns: int) -> None:
    if event.event in _DOWN + _UP:
        run.lives.append((now_ns, event.node, event.event in _DOWN))


_TAKE: Mapping[type[Event], Any] = {
    NodeTable: _take_nodes,
    FieldInfo: _take_field,
    Problem: _take_problem,
    TruthTargets: _take_truth,
    Belief: _take_belief,
    Particles: _take_particles,
    Identity: _take_identity,
    MessageSent: _take_message,
    Estimate: _take_estimate,
    Handoff: _take_handoff,
    Role: _take_role,
    NodeLife: _take_life,
}
