"""What the leaders of an acquaintance group know of who is who (Liu et al. 2004, sections 3.2 and 5; no node, no time).

The group's rows of the identity matrix are a function of what they began as and of the *changes* since: meetings and pieces
of evidence, each with a number that all leaders order alike (Lamport 1978). Leaders tell each other what they know and
take the union. So in whatever order words come, and whatever gets lost, every leader's copy is a matrix whose rows and
columns sum to one, never a mixture of old rows and new ones; leaders that know the same changes have the same numbers to
the last bit; and of two pieces of evidence at once the later in the order is applied to what the earlier one left.
"""

import zlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from netsim.algorithms.joint_changes import EVEN, EVIDENCE, EXACT, FIRST, SHARES, Change, Epoch, Number, Place
from netsim.kernels import identity
from netsim.kernels.fitting import fitted
from netsim.kernels.semiring import FloatArray

CLOSED: Final = 1e-6
"""Sums of columns that are further from 0 and 1 tell of rows that do not belong together."""

_FAINT: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Acquaintances:
    """One leader's copy.

    Attributes:
        tracks: The group, ascending.
        start: Rows that changes are applied to, shape (k, identities).
        epochs: Of what each of them is the start.
        changes: Since then, in their order.
        places: Where the leaders are, as far as is known.
    """

    tracks: tuple[int, ...]
    start: FloatArray
    epochs: tuple[Epoch, ...]
    changes: tuple[Change, ...]
    places: tuple[Place, ...]

    @staticmethod
    def alone(track: int, row: FloatArray, place: Place) -> "Acquaintances":
        """A track that has met nobody; with a row of equal probabilities if who it is is open."""
        return Acquaintances((track,), np.array([row], dtype=float), (FIRST,), (), (place,))

    @cached_property
    def rows(self) -> FloatArray:
        """The group's rows, shape (k, identities)."""
        return self._applied[0]

    @property
    def refused(self) -> frozenset[Number]:
        """Evidence that contradicts what came before it, and changes nothing."""
        return self._applied[1]

    @cached_property
    def _applied(self) -> tuple[FloatArray, frozenset[Number]]:
        rows, refused = self.start, set[Number]()
        for change in self.changes:
            try:
                rows = self._after(rows, change)
            except ValueError:
                refused.add(change.number)
        return rows, frozenset(refused)

    def _after(self, rows: FloatArray, change: Change) -> FloatArray:
        indices = [self.tracks.index(track) for track in change.tracks]
        if change.kind == EVIDENCE and self.is_closed:
            return identity.evidence(rows, indices[0], change.values)
        if change.kind == EVIDENCE:
            updated = rows.copy()
            updated[indices[0]] = identity.posterior(rows[indices[0]], change.values)
            return updated
        if change.kind == EVEN:
            return identity.mix(rows, indices, identity.even(len(indices)))
        return identity.mix_by(rows, indices, np.reshape(change.values, (len(indices), len(indices))))

    def row(self, track: int) -> FloatArray:
        """One track's row, shape (identities,)."""
        return np.asarray(self.rows[self.tracks.index(track)])

    def place(self, track: int) -> Place:
        """Where a track's leader was last known to be."""
        return self.places[self.tracks.index(track)]

    def located(self, track: int, place: Place) -> "Acquaintances":
        """With news of where a track's leader is."""
        index = self.tracks.index(track)
        if place.turn < self.places[index].turn:
            return self
        return replace(self, places=(*self.places[:index], place, *self.places[index + 1 :]))

    def learned(self, track: int, likelihood: Sequence[float]) -> "Acquaintances":
        """With evidence about a track, by its leader; likelihoods as float32, which is how they are told.

        Raises:
            ValueError: The evidence contradicts what is known, or is no likelihood.
        """
        values = tuple(np.asarray(likelihood, dtype=np.float32).astype(float).tolist())
        identity.posterior(self.row(track), values)
        return self._changed(Change(self._next(track), self._era, EVIDENCE, (track,), values))

    def met(self, tracks: Sequence[int], shares: FloatArray | None = None) -> "Acquaintances":
        """After tracks of one leader met: evenly mixed, or by shares as `identity.mix_by` takes them.

        Where they are all there are, a new era begins.
        """
        values = () if shares is None else tuple(shares.ravel().tolist())
        kind = EVEN if shares is None else SHARES
        mixed = self._changed(Change(self._next(min(tracks)), self._era, kind, tuple(tracks), values))
        return mixed.renewed() if set(self.tracks) == set(tracks) else mixed

    @property
    def _era(self) -> int:
        return max(epoch.era for epoch in self.epochs)

    @property
    def _clock(self) -> int:
        """Of the last change that is known of."""
        heard = [epoch.heard for epoch in self.epochs if epoch.heard != EXACT]
        return max((*heard, *(change.number[0] for change in self.changes)), default=0)

    def _next(self, track: int) -> Number:
        return self._clock + 1, self.place(track).leader, track

    def _changed(self, change: Change) -> "Acquaintances":
        return replace(self, changes=(*self.changes, change))

    def renewed(self) -> "Acquaintances":
        """The same rows as the start of a new era."""
        epoch = Epoch(self._era + 1, EXACT, _check(self.rows))
        return replace(self, start=self.rows, epochs=(epoch,) * len(self.tracks), changes=())

    def merged(self, other: "Acquaintances") -> "Acquaintances | None":
        """What both know; None where they contradict each other, as after two nodes have led one track.

        Starts are those of the later epochs, with all changes that are not in them already.
        """
        tracks = tuple(sorted({*self.tracks, *other.tracks}))
        sources = [self._later(other, track) for track in tracks]
        start = np.stack([source.start_of(track) for source, track in zip(sources, tracks, strict=True)])
        if self.is_closed and other.is_closed and not _is_closed(start):
            return None
        epochs = tuple(source.epoch(track) for source, track in zip(sources, tracks, strict=True))
        since = dict(zip(tracks, epochs, strict=True))
        changes = {
            change.number: change
            for change in (*self.changes, *other.changes)
            if not any(since[track].has(change) for track in change.tracks)
        }
        return Acquaintances(
            tracks, start, epochs, tuple(changes[n] for n in sorted(changes)), self._places(other, tracks)
        )

    def reconciled(self, other: "Acquaintances") -> "Acquaintances":
        """What both know, also where they contradict each other: then a compromise, in a new epoch.

        The rows of both, those of the later epoch for tracks that are in both, scaled to hold as many identities as they
        are: those that they speak most for.
        """
        both = self.merged(other)
        if both is not None:
            return both
        tracks = tuple(sorted({*self.tracks, *other.tracks}))
        rows = np.stack([self._later(other, track).row(track) for track in tracks]) + _FAINT
        columns = np.zeros(rows.shape[1])
        columns[np.argsort(-rows.sum(axis=0), kind="stable")[: len(tracks)]] = 1.0
        start = fitted(rows, np.ones(len(tracks)), columns)
        even = np.tile(columns / len(tracks), (len(tracks), 1))
        start = even if start is None else start
        epoch = Epoch(max(*self.epochs, *other.epochs).era + 1, EXACT, _check(start))
        return Acquaintances(tracks, start, (epoch,) * len(tracks), (), self._places(other, tracks))

    @cached_property
    def is_closed(self) -> bool:
        """Whether the group holds as many identities as tracks, each wholly.

        It does not where somebody's identity was open from the start; then evidence about one tells nothing of the others.
        """
        return _is_closed(self.start)

    def _later(self, other: "Acquaintances", track: int) -> "Acquaintances":
        """Of the two copies the one with the later epoch of a track."""
        return max((known for known in (self, other) if track in known.tracks), key=lambda known: known.epoch(track))

    def _places(self, other: "Acquaintances", tracks: Sequence[int]) -> tuple[Place, ...]:
        """Where leaders are by the later word of both."""
        both = [[known.place(track) for known in (self, other) if track in known.tracks] for track in tracks]
        return tuple(max(places, key=lambda place: place.turn) for places in both)

    def epoch(self, track: int) -> Epoch:
        """The epoch of a track."""
        return self.epochs[self.tracks.index(track)]

    def start_of(self, track: int) -> FloatArray:
        """A track's row at the start of its epoch."""
        return np.asarray(self.start[self.tracks.index(track)])

    def knows(self, other: "Acquaintances") -> bool:
        """Whether the other copy has nothing, of rows and changes, that this one has not."""
        return self.state == (both.state if (both := self.merged(other)) is not None else None)

    @property
    def state(self) -> tuple[tuple[int, ...], tuple[Epoch, ...], tuple[Number, ...]]:
        """What copies of equal rows have alike: tracks, epochs, and the numbers of the changes."""
        return self.tracks, self.epochs, tuple(change.number for change in self.changes)

    @property
    def rank(self) -> tuple[int, int, tuple[Epoch, ...]]:
        """Which of two copies that contradict each other is to go on: the greater."""
        return self._era, len(self.tracks), self.epochs

    def hearsay(self) -> "Acquaintances":
        """What is told to all: the rows as they are now as float32, without the changes.

        Whoever has this era's start, and the changes since, knows better.
        """
        rows = self.rows.astype(np.float32).astype(float)
        if not self.changes and np.array_equal(rows, self.start):
            return self
        epochs = tuple(Epoch(epoch.era, self._clock, _check(rows)) for epoch in self.epochs)
        return replace(self, start=rows, epochs=epochs, changes=())

    def recovered(self) -> "Acquaintances":
        """What a node goes on with that has nothing but hearsay: rows scaled to sums of one."""
        columns = self.start.sum(axis=0)
        scaled = fitted(self.start, np.ones(len(self.tracks)), np.rint(columns) if self.is_closed else columns)
        return self if scaled is None else replace(self, start=scaled)


def _check(rows: FloatArray) -> int:
    """Two bytes that rows which differ have different, nearly always."""
    return zlib.crc32(rows.tobytes()) % 2**16


def _is_closed(rows: FloatArray) -> bool:
    """Whether the rows hold as many identities as they are, each wholly."""
    sums = rows.sum(axis=0)
    whole = np.rint(sums)
    return bool(np.abs(sums - whole).max() <= CLOSED and whole.max() <= 1.0 and whole.sum() == len(rows))


def of_tracks(known: Collection[Acquaintances], track: int) -> Acquaintances | None:
    """The copy that a track is in."""
    return next((each for each in known if track in each.tracks), None)
