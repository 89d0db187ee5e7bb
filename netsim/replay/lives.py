"""Nodes that are down: dark discs over the dead, with a cross over those that crashed and may come back."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import Scene, static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import NodeLife

Change = tuple[int, int, str]
"""Instant, row of the node, and what it did: one of `_DOWN` or `_UP`."""

_DOWN = ("died", "crashed")
_UP = ("started", "rebooted")
_DISC = 0.8  # radii; what is left of the node around it tells how much energy it had
_CROSS = 0.62
_MOST_MOVES = 1000


def changes(batch: Batch, scene: Scene) -> list[Change]:
    """Who goes down and who returns; the end of an algorithm is neither."""
    rows = scene.rows(batch.numbers("node")).tolist()
    parts = zip(batch.time_ns.tolist(), rows, batch.texts("event"), strict=True)
    return [(time_ns, row, event) for time_ns, row, event in parts if event in _DOWN + _UP and row >= 0]


def is_down(event: str) -> bool:
    """Whether a node that did this is down."""
    return event in _DOWN


class DownTrack:
    """What covers the nodes that are down; it goes where they are carried."""

    topics = (NodeLife.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._changes: list[Change] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; the marks are drawn at the end."""
        self._changes += changes(batch, self._scene)
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One row a change of either mark."""
        dead = self._times("died")
        crashed = self._times("crashed")
        if dead:
            yield from self._discs("/map/dead", dead)
        if crashed:
            yield from self._discs("/map/crashed", crashed)
            yield from self._crosses(crashed)

    def _times(self, what: str) -> list[tuple[int, list[int]]]:
        """Instants and the rows that are down for this reason from then on; empty if none ever is."""
        if not any(event == what for *_, event in self._changes):
            return []
        down: list[int] = []
        shown: dict[int, list[int]] = {}
        for time_ns, row, event in self._with_moves():
            before = down
            if event == what and row not in down:
                down = [*down, row]
            elif event not in (what, "moved"):
                down = [other for other in down if other != row]
            if down != before or (event == "moved" and down):
                shown[max(time_ns, self._pace.start_ns)] = down
        return sorted(shown.items())

    def _with_moves(self) -> list[Change]:
        motion = self._scene.motion
        instants = [] if motion.is_still else motion.instants(self._pace, _MOST_MOVES).tolist()
        return sorted([*self._changes, *((time_ns, -1, "moved") for time_ns in instants)], key=lambda part: part[0])

    def _discs(self, path: str, times: list[tuple[int, list[int]]]) -> Iterator[Chunk]:
        look = rr.Points2D.from_fields(
            colors=[style.DEAD], radii=[_DISC * self._scene.radius_m], draw_order=style.ORDER["dead"]
        )
        yield static(path, look)
        instants, lengths, places = self._places(times)
        yield timed(path, instants, rr.Points2D.columns(positions=places).partition(lengths))

    def _crosses(self, times: list[tuple[int, list[int]]]) -> Iterator[Chunk]:
        path, half_m = "/map/crashed/crosses", _CROSS * self._scene.radius_m
        look = rr.LineStrips2D.from_fields(colors=[style.CRASHED], radii=[-1.6], draw_order=style.ORDER["dead"] + 1)
        yield static(path, look)
        instants, lengths, places = self._places(times)
        strokes = half_m * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
        strips = (places[:, None, None] + strokes).reshape(-1, 2, 2)
        yield timed(path, instants, rr.LineStrips2D.columns(strips=list(strips)).partition(2 * lengths))

    def _places(
        self, times: list[tuple[int, list[int]]]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Instants, how many nodes are down at each, and where those are."""
        instants = np.array([time_ns for time_ns, _ in times], np.int64)
        lengths = np.array([len(rows) for _, rows in times], np.int64)
        rows = np.array([row for _, rows in times for row in rows], np.int64)
        return instants, lengths, self._scene.motion.places(rows, np.repeat(instants, lengths))
