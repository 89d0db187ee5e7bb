"""Whom the tracks follow, from one sample to the next: switches and losses.

Bernardin, Stiefelhagen, "Evaluating multiple object tracking performance: the CLEAR MOT metrics", EURASIP Journal on Image
and Video Processing 2008: a pair of target and track stays while it is within the cut-off; the rest is assigned anew.
"""

from collections.abc import Mapping
from typing import Any

from netsim.kernels.set_distance import distances, keep_and_match
from netsim.metrics.tracks import Points, as_array
from netsim.units import s_to_ns


class Following:
    """Counts over the samples of a run.

    Args:
        cut_off_m: Distance from which on a track does not follow a target.
        order: Of the distances that the assignment minimises.
        loss_s: A target that was followed and then is not for so long is lost.
    """

    def __init__(self, cut_off_m: float, order: float, loss_s: float) -> None:
        self._cut_off_m = cut_off_m
        self._order = order
        self._loss_ns = s_to_ns(loss_s)
        self._pairs: dict[int, int] = {}  # target: track, at the last sample
        self._last_track: dict[int, int] = {}
        self._followed_ns: dict[int, int] = {}  # when each target that is not lost was last followed
        self._samples = self._followed = self._tracks = self._switches = self._losses = 0
        self._instants = 0

    def sample(self, time_ns: int, truth: Points, found: Points) -> None:
        """Take the next sample: positions of targets and of tracks, by number."""
        self._pairs = self._assigned(truth, found)
        self._instants += 1
        self._samples += len(truth)
        self._followed += len(self._pairs)
        self._tracks += len(found)
        for target, track in self._pairs.items():
            self._switches += self._last_track.get(target, track) != track
            self._last_track[target] = track
            self._followed_ns[target] = time_ns
        self._note_losses(time_ns, truth)

    def figures(self) -> dict[str, Any]:
        """The metrics; means over the samples."""
        return {
            "targets_mean": self._samples / self._instants,
            "targets_missed_mean": (self._samples - self._followed) / self._instants,
            "tracks_false_mean": (self._tracks - self._followed) / self._instants,
            "targets_followed_share": self._followed / self._samples if self._samples else None,
            "track_switches": self._switches,
            "track_losses": self._losses,
        }

    def _assigned(self, truth: Points, found: Points) -> dict[int, int]:
        targets, tracks = list(truth), list(found)
        before = [
            (targets.index(target), tracks.index(track))
            for target, track in self._pairs.items()
            if target in truth and track in found
        ]
        distance = distances(as_array(truth.values()), as_array(found.values()))
        pairs = keep_and_match(distance, before, self._cut_off_m, self._order)
        return {targets[row]: tracks[column] for row, column in pairs}

    def _note_losses(self, time_ns: int, truth: Mapping[int, object]) -> None:
        for target, last_ns in list(self._followed_ns.items()):
            if target not in truth:
                del self._followed_ns[target]  # it left: nobody lost it
            elif time_ns - last_ns >= self._loss_ns:
                self._losses += 1
                del self._followed_ns[target]
