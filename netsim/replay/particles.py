"""Beliefs as particles: dots on the map, those of each track in its colour, larger by weight."""

from collections.abc import Iterator, Mapping

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.beliefs import HOLD_NS
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import Particles

_LEAST_PT, _MOST_PT = 1.1, 5.0
"""Radius on screen of a particle without weight and of the heaviest; in between, areas are as weights."""

Cloud = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Places, shape (P, 2), and radii."""
_GONE: Cloud = (np.zeros((0, 2)), np.zeros(0))


class ParticleTrack:
    """The latest particles of every track, whoever leads it."""

    topics = (Particles.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._last_ns: dict[int, int] = {}
        """When each track was last told of."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """A row of dots a word of each track; they go after a while without one."""
        for track, clouds in sorted(_clouds(batch).items()):
            shown: dict[int, Cloud] = {}
            for time_ns, cloud in clouds:
                at_ns, last_ns = max(time_ns, self._pace.start_ns), self._last_ns.get(track, time_ns)
                if last_ns + HOLD_NS < time_ns:
                    shown[max(last_ns + HOLD_NS, self._pace.start_ns)] = _GONE
                shown[at_ns] = cloud
                if track not in self._last_ns:
                    look = rr.Points2D.from_fields(
                        colors=[style.kind_colour(track)], draw_order=style.ORDER["particles"]
                    )
                    yield static(_path(track), look)
                self._last_ns[track] = time_ns
            yield _rows(track, shown)

    def finish(self) -> Iterator[Chunk]:
        """They go, where nobody tells of a track any more."""
        for track, last_ns in sorted(self._last_ns.items()):
            if last_ns + HOLD_NS < self._pace.end_ns:
                yield _rows(track, {max(last_ns + HOLD_NS, self._pace.start_ns): _GONE})


def _clouds(batch: Batch) -> dict[int, list[tuple[int, Cloud]]]:
    """By track, in order."""
    tracks, per_event = batch.rows("target")
    weights, told = batch.rows("weight")
    places_m = np.column_stack([batch.rows("x_m")[0], -batch.rows("y_m")[0]]).astype(float)
    at = np.concatenate([[0], np.cumsum(per_event * told)])
    names, shares = np.split(tracks, np.cumsum(per_event)[:-1]), np.split(weights, np.cumsum(told)[:-1])
    clouds: dict[int, list[tuple[int, Cloud]]] = {}
    for number, time_ns in enumerate(batch.time_ns.tolist()):
        radii = -np.maximum(_LEAST_PT, _MOST_PT * np.sqrt(shares[number] / max(float(shares[number].max()), 1e-30)))
        own_m = places_m[at[number] : at[number + 1]].reshape(len(names[number]), -1, 2)
        for track, places in zip(names[number].tolist(), own_m, strict=True):
            clouds.setdefault(track, []).append((time_ns, (places, radii)))
    return clouds


def _path(track: int) -> str:
    return f"/map/particles/{track}"


def _rows(track: int, shown: Mapping[int, Cloud]) -> Chunk:
    instants = np.array(sorted(shown), np.int64)
    each = [shown[at_ns] for at_ns in instants.tolist()]
    places_m, radii = (np.concatenate(parts) for parts in zip(*each, strict=True))
    lengths = [len(one) for _, one in each]
    return timed(_path(track), instants, rr.Points2D.columns(positions=places_m, radii=radii).partition(lengths))
