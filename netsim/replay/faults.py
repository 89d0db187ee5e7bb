"""Faults at work: rings around the nodes that a rule concerns from when it begins to when it ends, and where a jammer is."""

import re
from collections.abc import Iterator

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, timed
from netsim.trace.events import Fault

_RING = np.linspace(0.0, 2 * np.pi, 33)
_RING_RADIUS = 1.75  # node radii
_JAMMER_RADIUS = 1.6
_MOST_MOVES = 1000
_PLACE = re.compile(r"\((-?\d+(?:\.\d+)?),\s*(-?\d+(?:\.\d+)?)\) m\b")


class FaultTrack:
    """What is marked while fault rules are at work."""

    topics = (Fault.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._changes: list[tuple[int, int, tuple[int, ...]]] = []
        self._jammers: dict[int, tuple[str, list[tuple[int, bool]]]] = {}

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep what begins and ends; the marks are drawn at the end."""
        node, lengths = batch.rows("node")
        rows = np.split(self._scene.rows(node), np.cumsum(lengths)[:-1])
        parts = zip(
            batch.time_ns.tolist(), batch.numbers("rule").tolist(), batch.texts("event"), rows, batch.texts("detail"),
            strict=True,
        )  # fmt: skip
        for time_ns, rule, event, concerned, detail in parts:
            if event == "strikes":
                continue
            begins = event == "begins"
            # A rule that concerns every node says nothing about any of them.
            few = tuple(concerned.tolist()) if begins and len(concerned) < len(self._scene.place) else ()
            self._changes.append((time_ns, rule, few))
            self._note_place(time_ns, rule, begins, detail)
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """Rings and jammers."""
        yield from self._rings()
        for rule, (detail, times) in self._jammers.items():
            yield from self._jammer(rule, detail, times)

    def _note_place(self, time_ns: int, rule: int, begins: bool, detail: str) -> None:
        if rule not in self._jammers and _PLACE.search(detail):
            self._jammers[rule] = (detail, [])
        if rule in self._jammers:
            self._jammers[rule][1].append((max(time_ns, self._pace.start_ns), begins))

    def _rings(self) -> Iterator[Chunk]:
        shown = self._shown()
        if not any(shown.values()):
            return
        look = rr.LineStrips2D.from_fields(colors=[style.FAULT], radii=[-1.2], draw_order=style.ORDER["faults"])
        yield static("/map/faults", look)
        instants = np.array(sorted(shown), np.int64)
        lengths = np.array([len(shown[time_ns]) for time_ns in instants.tolist()], np.int64)
        rows = np.array([row for time_ns in instants.tolist() for row in shown[time_ns]], np.int64)
        middles = self._scene.motion.places(rows, np.repeat(instants, lengths))
        circle = _RING_RADIUS * self._scene.radius_m * np.column_stack([np.cos(_RING), np.sin(_RING)])
        strips = list(middles[:, None] + circle)
        yield timed("/map/faults", instants, rr.LineStrips2D.columns(strips=strips).partition(lengths))

    def _shown(self) -> dict[int, list[int]]:
        """The rows to ring from each instant on."""
        motion = self._scene.motion
        moves = [] if motion.is_still else motion.instants(self._pace, _MOST_MOVES).tolist()
        steps = sorted([*self._changes, *((time_ns, -1, ()) for time_ns in moves)], key=lambda step: step[0])
        active: dict[int, tuple[int, ...]] = {}
        shown: dict[int, list[int]] = {}
        for time_ns, rule, concerned in steps:
            if rule >= 0:
                active[rule] = concerned
            rows = {row for rule_rows in active.values() for row in rule_rows if row >= 0}
            shown[max(time_ns, self._pace.start_ns)] = sorted(rows)
        return shown

    def _jammer(self, rule: int, detail: str, times: list[tuple[int, bool]]) -> Iterator[Chunk]:
        """A disc where its place is told, as long as it jams."""
        found = _PLACE.search(detail)
        if found is None:
            return
        path = entity("map", "jammers", str(rule))
        look = rr.Points2D.from_fields(
            colors=[style.JAMMER],
            radii=[_JAMMER_RADIUS * self._scene.radius_m],
            labels=["jammer"],
            show_labels=True,
            draw_order=style.ORDER["faults"],
        )
        yield static(path, look)
        last = dict(times)
        places = np.array([[float(found[1]), -float(found[2])]] * sum(last.values())).reshape(-1, 2)
        lengths = np.array(list(last.values()), np.int64)
        yield timed(path, np.array(list(last), np.int64), rr.Points2D.columns(positions=places).partition(lengths))
