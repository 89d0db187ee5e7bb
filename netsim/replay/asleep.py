"""Nodes whose radios sleep: a dim ring; naps shorter than a step of the replay are left to the radio time line."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import RADIO_STATE_CODE, RadioState

_RING = 1.25  # node radii
_CIRCLE = np.column_stack([np.cos(np.linspace(0, 2 * np.pi, 25)), np.sin(np.linspace(0, 2 * np.pi, 25))])
_ASLEEP = RADIO_STATE_CODE["sleep"]
_MOST_RINGS = 500_000  # if there are more, the shorter naps are left out


class AsleepTrack:
    """Rings around the nodes that sleep at least a step of the replay."""

    topics = (RadioState.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._since: dict[int, int] = {}
        self._naps: list[tuple[int, int, int]] = []
        """Row, begin and end."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep the naps that are worth a ring."""
        rows = self._scene.rows(batch.numbers("node")).tolist()
        for row, time_ns, state in zip(rows, batch.time_ns.tolist(), batch.numbers("state").tolist(), strict=True):
            if state == _ASLEEP:
                self._since.setdefault(row, time_ns)
            else:
                self._woke(row, time_ns)
        yield from ()

    def _woke(self, row: int, time_ns: int) -> None:
        begin_ns = self._since.pop(row, time_ns)
        if row >= 0 and time_ns - begin_ns >= self._pace.tick_ns and time_ns > self._pace.start_ns:
            self._naps.append((row, max(begin_ns, self._pace.start_ns), time_ns))

    def finish(self) -> Iterator[Chunk]:
        """A row of rings a change, on the grid of the replay's steps."""
        for row in list(self._since):
            self._woke(row, self._pace.end_ns)
        if not self._naps:
            return
        path = "/map/asleep"
        look = rr.LineStrips2D.from_fields(colors=[style.ASLEEP], radii=[-1.5], draw_order=style.ORDER["rims"] + 1)
        yield static(path, look)
        instants, lengths, rows = self._rings()
        middles = self._scene.motion.places(rows, np.repeat(instants, lengths))
        strips = list(middles[:, None] + _RING * self._scene.radius_m * _CIRCLE)
        yield timed(path, instants, rr.LineStrips2D.columns(strips=strips).partition(lengths))

    def _rings(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Instants, how many nodes sleep from each on, and their rows."""
        tick_ns = self._pace.tick_ns
        while True:
            naps = np.array(self._naps, np.int64)
            naps = naps[naps[:, 2] - naps[:, 1] >= tick_ns]
            steps = np.concatenate([naps[:, 1], naps[:, 2]]) // tick_ns
            changes = np.repeat([1, -1], len(naps))
            instants, slot = np.unique(steps, return_inverse=True)
            total = int(np.cumsum(np.bincount(slot, changes, len(instants))).sum())
            if total <= _MOST_RINGS:
                break
            tick_ns *= 2
        asleep: set[int] = set()
        rows: list[int] = []
        lengths: list[int] = []
        order = np.argsort(slot, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(slot[order])) + 1)
        whose = np.concatenate([naps[:, 0], naps[:, 0]])
        for part in parts:
            ended = {int(whose[at]) for at in part if changes[at] < 0}
            begun = {int(whose[at]) for at in part if changes[at] > 0}
            asleep = (asleep - ended) | begun
            rows += sorted(asleep)
            lengths.append(len(asleep))
        return (
            np.maximum(instants * tick_ns, self._pace.start_ns),
            np.array(lengths, np.int64),
            np.array(rows, np.int64),
        )
