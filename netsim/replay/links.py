"""The radio links: where they crowd only each node's best, and none of a node that is down or has moved."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.lives import Change, changes, is_down
from netsim.replay.scene import Scene, static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import LinkTable, NodeLife

_BEST_LINKS = 4  # links a node that are drawn where they crowd
_MOST_ROWS = 100  # the lines are drawn anew at no more instants than this


class LinkTrack:
    """The links of the living; drawn anew when a node dies, crashes or returns.

    What links are like is told at the start, so those of a node that moves are not known any more.
    """

    topics = (NodeLife.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._pairs, self._colours = _lines(setting.scene)
        self._step_ns = max(1, (setting.pace.end_ns - setting.pace.start_ns) // _MOST_ROWS)
        self._changes: list[Change] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep who goes down and returns; the lines are drawn at the end."""
        self._changes += changes(batch, self._scene)
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One row of lines at the start and after each change."""
        if not len(self._pairs):
            return
        look = rr.LineStrips2D.from_fields(radii=[-0.5], draw_order=style.ORDER["links"])
        yield static("/map/links", look)
        rows = self._rows()
        shown = [np.flatnonzero(linked[self._pairs].all(axis=1)) for _, linked in rows]
        which, lengths = np.concatenate(shown), np.array([len(row) for row in shown])
        lines = rr.LineStrips2D.columns(strips=list(self._scene.place[self._pairs[which]]), colors=self._colours[which])
        yield timed("/map/links", np.array([time_ns for time_ns, _ in rows], np.int64), lines.partition(lengths))

    def _rows(self) -> list[tuple[int, NDArray[np.bool_]]]:
        """Instants and whose links are known to work from then on; what follows closely is drawn at once."""
        up, moved = (np.full(len(self._scene.place), value) for value in (True, False))
        rows = {self._pace.start_ns: up.copy()}
        known = [(time_ns, row, "moved") for time_ns, row in self._scene.motion.first_moves()]
        crowded = len(self._changes) + len(known) > _MOST_ROWS
        for time_ns, row, event in sorted(self._changes + known):
            if event == "moved":
                moved[row] = True
            else:
                up[row] = not is_down(event)
            when = -(-time_ns // self._step_ns) * self._step_ns if crowded else time_ns
            rows[max(when, self._pace.start_ns)] = up & ~moved
        return sorted(rows.items(), key=lambda row: row[0])


def _lines(scene: Scene) -> tuple[NDArray[np.int64], style.Colours]:
    """One pair of rows a line and its colour, by the worse direction."""
    if scene.links is None or not len(scene.links.source):
        return np.empty((0, 2), np.int64), np.empty((0, 4), np.uint8)
    pairs, prr, gain_db = _pairs(scene, scene.links)
    if scene.crowded:
        best = _best(scene, pairs, gain_db)
        pairs, prr = pairs[best], prr[best]
    return pairs, style.prr_colours(prr)


def _pairs(scene: Scene, links: LinkTable) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Pairs of rows with a link, and the lower reception ratio and gain of the two directions."""
    ends = np.column_stack([scene.rows(np.asarray(links.source)), scene.rows(np.asarray(links.destination))])
    pairs, where = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    prr, gain_db = np.ones(len(pairs)), np.full(len(pairs), np.inf)
    np.minimum.at(prr, where.ravel(), np.asarray(links.prr, np.float64))
    np.minimum.at(gain_db, where.ravel(), np.asarray(links.gain_db, np.float64))
    return pairs, prr, gain_db


def _best(scene: Scene, pairs: NDArray[np.int64], gain_db: NDArray[np.float64]) -> NDArray[np.int64]:
    """The pairs that are among the best of either end: highest gain first, then nearest."""
    distance_m = np.linalg.norm(scene.place[pairs[:, 0]] - scene.place[pairs[:, 1]], axis=1)
    node, pair = pairs.T.ravel(), np.tile(np.arange(len(pairs)), 2)
    order = np.lexsort((distance_m[pair], -gain_db[pair], node))
    begins = np.searchsorted(node[order], np.arange(len(scene.place)))
    rank = np.arange(len(order)) - begins[node[order]]
    return np.unique(pair[order[rank < _BEST_LINKS]])
