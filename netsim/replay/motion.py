"""Where the nodes are at any time: between two announcements a node stays where the last one put it."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from netsim.replay.options import Pace

Ints = NDArray[np.int64]
Places = NDArray[np.float64]


@dataclass(frozen=True)
class Moves:
    """Announcements of positions as columns, in the order of time.

    Attributes:
        time_ns: When.
        row: Row of the node in the node table.
        place: Map position from then on; shape (m, 2).
    """

    time_ns: Ints
    row: Ints
    place: Places


def no_moves() -> Moves:
    """Nobody moves."""
    return Moves(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 2)))


@dataclass(frozen=True)
class Motion:
    """The positions of all nodes as functions of time.

    Attributes:
        start: Map position of each row of the node table at time 0; shape (n, 2).
        moves: What was announced later.
    """

    start: Places
    moves: Moves

    @property
    def is_still(self) -> bool:
        """Whether nobody ever moves."""
        return not len(self.moves.row)

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Whether each row ever moves."""
        return np.isin(np.arange(len(self.start)), self.moves.row)

    @cached_property
    def corners(self) -> tuple[Places, Places]:
        """Least and largest coordinates that any node ever has."""
        every = np.concatenate([self.start, self.moves.place])
        return every.min(axis=0), every.max(axis=0)

    def places(self, row: Ints, time_ns: Ints) -> Places:
        """Positions of some rows, each at a time of its own; shape (k, 2)."""
        if self.is_still:
            return np.asarray(self.start[row])
        instants, keys, table = self._table
        wanted = row * (len(instants) + 1) + np.searchsorted(instants, time_ns, side="right")
        return np.asarray(table[np.searchsorted(keys, wanted, side="right") - 1])

    def snapshot(self, time_ns: int) -> Places:
        """Positions of all rows at one time; shape (n, 2)."""
        rows = np.arange(len(self.start))
        return self.places(rows, np.full(len(rows), time_ns))

    def first_moves(self) -> Iterable[tuple[int, int]]:
        """When each row that moves does so first, and the row."""
        row, first = np.unique(self.moves.row, return_index=True)
        return zip(self.moves.time_ns[first].tolist(), row.tolist(), strict=True)

    def instants(self, pace: Pace, most: int) -> Ints:
        """The start of the window and when to show new positions: no more than about `most` times, never twice a tick."""
        step_ns = max(pace.tick_ns, (pace.end_ns - pace.start_ns) // most, 1)
        steps = -((pace.start_ns - self.moves.time_ns) // step_ns)
        shown = np.unique(np.maximum(steps, 0)) * step_ns + pace.start_ns
        return np.union1d(shown[shown <= pace.end_ns], [pace.start_ns]).astype(np.int64)

    @cached_property
    def _table(self) -> tuple[Ints, Ints, Places]:
        """Distinct instants of moves; sorted keys (row, rank of the instant) as one number; the place of each key."""
        instants = np.unique(self.moves.time_ns)
        rows = np.concatenate([np.arange(len(self.start)), self.moves.row])
        rank = np.searchsorted(instants, self.moves.time_ns, side="right")
        keys = rows * (len(instants) + 1) + np.concatenate([np.zeros(len(self.start), np.int64), rank])
        order = np.argsort(keys, kind="stable")
        return instants, keys[order], np.concatenate([self.start, self.moves.place])[order]
