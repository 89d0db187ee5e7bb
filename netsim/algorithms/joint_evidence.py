"""Evidence of a leader's own sensor on who its track is: it waits until it tells enough to be worth telling."""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from netsim.algorithms.charging import charge
from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_messages import Held
from netsim.algorithms.joint_station import Station
from netsim.api import NoEnergyError, Op
from netsim.kernels import identity
from netsim.kernels.semiring import FloatArray

_SURE = 1e-9


class Evidence:
    """What a node has learned of the tracks that it leads, and not told yet.

    Args:
        station: The node.
        known: What is known of a track that is led here; None for others.
        apply: Makes a likelihood of each identity part of what is known of a track.
        refuse: Told of a track whose evidence contradicts what is known.
    """

    def __init__(
        self,
        station: Station,
        known: Callable[[int], Acquaintances | None],
        apply: Callable[[int, FloatArray], None],
        refuse: Callable[[int], None],
    ) -> None:
        self._station, self._known, self._apply, self._refuse = station, known, apply, refuse
        self._waiting: dict[int, FloatArray] = {}
        """Likelihoods by track."""

    def with_waiting(self, held: Held) -> Held:
        """A group that is to be given away, with what waits about it."""
        if not any(track in self._waiting for track in held.tracks):
            return held
        nothing = np.ones(held.known.start.shape[1])
        found = (self._waiting.get(track, nothing) for track in held.tracks)
        return replace(held, waiting=tuple(tuple(likelihood.tolist()) for likelihood in found))

    def keep(self, held: Held) -> None:
        """Go on with what waits about a group that was given."""
        for track, likelihood in zip(held.tracks, held.waiting, strict=False):
            self._waiting[track] = np.array(likelihood)

    def forget(self, track: int) -> None:
        """A track is led here no more."""
        self._waiting.pop(track, None)

    def fold(self, tracks: Collection[int]) -> None:
        """Make what waits about tracks that are joint part of what is known: it is of who they were till now."""
        for track in tracks:
            if track in self._waiting:
                self._apply(track, self._waiting.pop(track))
                self._station.node.spawn(self._charged(track))

    def classify(self, held: Held) -> None:
        """Look whether this node's sensor tells who a track is, if it is one of its own and its identity is not sure."""
        labels, every = self._station.knowledge.labels, self._station.parameters.classify_every_steps
        if labels is None or every == 0 or held.step % every != 0 or len(held.tracks) > 1:
            return
        track = held.tracks[0]
        known = self._known(track)
        if known is not None and float(known.row(track).max()) < 1.0 - _SURE:
            self._station.node.spawn(self._look(track))

    def _look(self, track: int) -> Op[None]:
        labels = self._station.knowledge.labels
        if labels is None:
            return
        try:
            observation = yield from self._station.node.sense()
        except NoEnergyError:
            return
        yield from charge(self._station.node, labels.operations())
        likelihood = labels.likelihood(observation.values[1:], self._station.parameters.classify_above)
        known = self._known(track)
        if likelihood is not None and known is not None:
            yield from self._learn(track, likelihood, known)

    def _learn(self, track: int, likelihood: FloatArray, known: Acquaintances) -> Op[None]:
        """Add a piece of evidence to those that wait, and tell of them when they tell enough."""
        together = self._waiting.get(track, np.ones(len(likelihood))) * likelihood
        try:
            row = identity.posterior(known.row(track), together)
        except ValueError:
            self.forget(track)
            self._refuse(track)
            return
        self._waiting[track] = together / together.max()
        if float(np.abs(row - known.row(track)).max()) < self._station.parameters.tell_change:
            return
        yield from self._charged(track)
        if self._known(track) is not None and track in self._waiting:
            self._apply(track, self._waiting.pop(track))

    def _charged(self, track: int) -> Op[None]:
        known = self._known(track)
        if known is not None:
            yield from charge(self._station.node, identity.evidence_operations(*known.rows.shape))
