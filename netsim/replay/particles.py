"""Beliefs as particles: dots on the map, those of each track in its colour, larger by weight."""

from collections.abc import Iterator

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


class ParticleTrack:
    """The latest particles of every track, whoever leads it."""

    topics = (Particles.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._clouds: dict[int, dict[int, Cloud]] = {}
        """By track and instant."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; a track that nobody tells of any more is known at the end."""
        tracks, per_event = batch.rows("target")
        weights, told = batch.rows("weight")
        places_m = np.column_stack([batch.rows("x_m")[0], -batch.rows("y_m")[0]]).astype(float)
        at = np.concatenate([[0], np.cumsum(per_event * told)])
        names, clouds = np.split(tracks, np.cumsum(per_event)[:-1]), np.split(weights, np.cumsum(told)[:-1])
        for number, time_ns in enumerate(batch.time_ns.tolist()):
            radii = -np.maximum(_LEAST_PT, _MOST_PT * np.sqrt(clouds[number] / max(float(clouds[number].max()), 1e-30)))
            own_m = places_m[at[number] : at[number + 1]].reshape(len(names[number]), -1, 2)
            for track, places in zip(names[number].tolist(), own_m, strict=True):
                self._clouds.setdefault(track, {})[max(time_ns, self._pace.start_ns)] = places, radii
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """A row of dots an instant; they go after a while without word."""
        for track, clouds in sorted(self._clouds.items()):
            path = f"/map/particles/{track}"
            look = rr.Points2D.from_fields(colors=[style.kind_colour(track)], draw_order=style.ORDER["particles"])
            yield static(path, look)
            shown = dict(clouds)
            for time_ns, after_ns in zip(clouds, [*list(clouds)[1:], self._pace.end_ns + 1], strict=True):
                if time_ns + HOLD_NS < min(after_ns, self._pace.end_ns):
                    shown[time_ns + HOLD_NS] = np.zeros((0, 2)), np.zeros(0)
            instants = np.array(sorted(shown), np.int64)
            each = [shown[at_ns] for at_ns in instants.tolist()]
            lengths = [len(radii) for _, radii in each]
            places_m, radii = (np.concatenate(parts) for parts in zip(*each, strict=True))
            yield timed(path, instants, rr.Points2D.columns(positions=places_m, radii=radii).partition(lengths))
