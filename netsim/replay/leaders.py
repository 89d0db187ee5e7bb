"""Who leads a track, among whom the next leader is chosen, and who that is."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.beliefs import HOLD_NS
from netsim.replay.lives import changes, is_down
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, line_names, timed
from netsim.trace.events import Handoff, NodeLife, Role

_SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
_LEADER_HALF, _NEIGHBOUR_HALF = 2.1, 1.8  # node radii
_LEADER = "leader"
"""First word of the role; where a node leads several tracks, their numbers follow."""

Choice = tuple[int, int, tuple[int, ...]]
"""Rows of the leader, of the next one, and of all among whom it was chosen."""


class LeaderTrack:
    """Squares around leaders and those they choose from, an arrow to the chosen one."""

    topics = (Role.topic, NodeLife.topic, Handoff.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._roles: list[tuple[int, int, str, bool]] = []
        self._choices: list[tuple[int, str, Choice]] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; the marks are drawn at the end."""
        if batch.topic == NodeLife.topic:
            self._roles += [
                (at_ns, row, "", False) for at_ns, row, event in changes(batch, self._scene) if is_down(event)
            ]
        elif batch.topic == Role.topic:
            rows = self._scene.rows(batch.numbers("node")).tolist()
            parts = zip(batch.time_ns.tolist(), rows, batch.texts("role"), batch.flags("holds").tolist(), strict=True)
            self._roles += [part for part in parts if part[2].split(" ")[0] == _LEADER and part[1] >= 0]
        else:
            self._take_choices(batch)
        yield from ()

    def _take_choices(self, batch: Batch) -> None:
        candidate, lengths = batch.rows("candidate")
        groups = np.split(self._scene.rows(candidate), np.cumsum(lengths)[:-1])
        here, there = (self._scene.rows(batch.numbers(name)).tolist() for name in ("node", "destination"))
        tracks, times = line_names(batch).tolist(), batch.time_ns.tolist()
        for time_ns, track, leader, chosen, among in zip(times, tracks, here, there, groups, strict=True):
            if leader >= 0 and chosen >= 0:
                known = tuple(int(row) for row in among if row >= 0)
                self._choices.append((time_ns, track, (leader, chosen, known)))

    def finish(self) -> Iterator[Chunk]:
        """The squares and the arrows."""
        if any(holds for *_, holds in self._roles):
            shown = self._leading()
            yield from self._squares("/map/leaders", shown, _LEADER_HALF, (style.LEADER, -2.2))
        if self._choices:
            choices = self._chosen()
            others = {at_ns: [row for *_, among in each for row in among] for at_ns, each in choices.items()}
            yield from self._squares("/map/neighbours", others, _NEIGHBOUR_HALF, (style.NEIGHBOUR, -1.0))
            yield from self._arrows({at_ns: [(a, b) for a, b, _ in each] for at_ns, each in choices.items()})

    def _leading(self) -> dict[int, list[int]]:
        """Rows of the leaders from each instant on; who goes down leads nothing any more."""
        leading: set[tuple[int, str]] = set()
        shown: dict[int, list[int]] = {}
        for at_ns, row, role, holds in sorted(self._roles, key=lambda change: change[0]):
            if holds:
                leading.add((row, role))
            else:
                leading -= {held for held in leading if held[0] == row and role in ("", held[1])}
            shown[max(at_ns, self._pace.start_ns)] = sorted({row for row, _ in leading})
        return shown

    def _chosen(self) -> dict[int, list[Choice]]:
        """The choices that are shown from each instant on: the last of each track and thread, for a while."""
        steps = sorted(self._choices, key=lambda step: step[0])
        ends = [(at_ns + HOLD_NS, track, None) for at_ns, track, _ in steps if at_ns + HOLD_NS < self._pace.end_ns]
        made_ns: dict[str, int] = {}
        current: dict[str, Choice] = {}
        shown: dict[int, list[Choice]] = {}
        for at_ns, track, choice in sorted([*steps, *ends], key=lambda step: step[0]):
            if choice is not None:
                current[track], made_ns[track] = choice, at_ns
            elif made_ns[track] + HOLD_NS == at_ns:
                current.pop(track, None)
            shown[max(at_ns, self._pace.start_ns)] = list(current.values())
        return shown

    def _places(self, shown: dict[int, list[int]]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Instants, how many rows each has, and where those stand then."""
        instants = np.array(sorted(shown), np.int64)
        lengths = np.array([len(shown[at_ns]) for at_ns in instants.tolist()], np.int64)
        rows = np.array([row for at_ns in instants.tolist() for row in shown[at_ns]], np.int64)
        return instants, lengths, self._scene.motion.places(rows, np.repeat(instants, lengths))

    def _squares(
        self, path: str, shown: dict[int, list[int]], half: float, look: tuple[style.Rgba, float]
    ) -> Iterator[Chunk]:
        colour, width = look
        yield static(
            path, rr.LineStrips2D.from_fields(colors=[colour], radii=[width], draw_order=style.ORDER["leaders"])
        )
        instants, lengths, middles = self._places(shown)
        strips = list(middles[:, None] + half * self._scene.radius_m * _SQUARE)
        yield timed(path, instants, rr.LineStrips2D.columns(strips=strips).partition(lengths))

    def _arrows(self, shown: dict[int, list[tuple[int, int]]]) -> Iterator[Chunk]:
        """From the rim of the leader's square to that of the next one's."""
        path = "/map/handoffs"
        look = rr.Arrows2D.from_fields(colors=[style.LEADER], radii=[-1.1], draw_order=style.ORDER["leaders"])
        yield static(path, look)
        instants, lengths, origins = self._places({at_ns: [a for a, _ in each] for at_ns, each in shown.items()})
        _, _, ends = self._places({at_ns: [b for _, b in each] for at_ns, each in shown.items()})
        way = ends - origins
        long_m = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        rim = np.minimum(_LEADER_HALF * self._scene.radius_m / long_m, 0.4) * way
        arrows = rr.Arrows2D.columns(origins=origins + rim, vectors=way - 2 * rim)
        yield timed(path, instants, arrows.partition(lengths))
