"""Collaboration groups on the map: the region around its tracks within which sensors are members."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.standing import standing
from netsim.replay.track import Setting, timed
from netsim.trace.events import Estimate, Particles

_PATH = "/map/groups"
_TURNS = np.linspace(0.0, 2.0 * np.pi, 241)
_CIRCLE = np.column_stack([np.cos(_TURNS), np.sin(_TURNS)])
_WIDTH, _JOINT_WIDTH = -1.3, -1.8

Place = tuple[float, float]
Outline = tuple[NDArray[np.float64], style.Rgba, float]
"""A line, its colour, its width on screen."""


class GroupTrack:
    """Circles of the sensing range around each estimate: in a track's colour, or light and united for a joint group."""

    topics = (Estimate.topic, Particles.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._range_m = setting.scene.group_range_m
        self._box = setting.scene.box
        self._pace = setting.pace
        self._places: defaultdict[int, dict[int, Place]] = defaultdict(dict)
        """Estimates on the map, by track and instant."""
        self._groups: list[tuple[int, int, tuple[int, ...]]] = []
        """Instant, track, and the tracks of its group."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; what stands when is known at the end."""
        times = batch.time_ns.tolist()
        if batch.topic == Particles.topic:
            tracks, lengths = batch.rows("target")
            for time_ns, mates in zip(times, np.split(tracks, np.cumsum(lengths)[:-1]), strict=True):
                group = tuple(int(mate) for mate in mates)
                self._groups += [(time_ns, track, group) for track in group]
        else:
            columns = (batch.numbers(name).tolist() for name in ("target", "x_m", "y_m"))
            for time_ns, track, x_m, y_m in zip(times, *columns, strict=True):
                self._places[track][time_ns] = x_m, -y_m
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """All outlines at each instant."""
        if self._range_m is None or not self._groups:
            return
        told = [(at_ns, track, (self._places[track].get(at_ns), group)) for at_ns, track, group in self._groups]
        rows = {
            at_ns: self._outlines({track: (place, group) for track, (place, group) in tracks.items() if place})
            for at_ns, tracks in standing(told, self._pace).items()
        }
        yield static(_PATH, rr.LineStrips2D.from_fields(draw_order=style.ORDER["groups"]))
        every = [outline for each in rows.values() for outline in each]
        columns = rr.LineStrips2D.columns(
            strips=[strip for strip, _, _ in every],
            colors=[colour for _, colour, _ in every],
            radii=[width for *_, width in every],
        )
        yield timed(_PATH, np.array(list(rows), np.int64), columns.partition([len(each) for each in rows.values()]))

    def _outlines(self, tracks: Mapping[int, tuple[Place, tuple[int, ...]]]) -> list[Outline]:
        """A circle of every track, without what lies inside those of its group, or off the map."""
        found: list[Outline] = []
        for track, (place, group) in tracks.items():
            joint = len(group) > 1
            look = (style.JOINT, _JOINT_WIDTH) if joint else (style.kind_colour(track), _WIDTH)
            others = [
                tracks[mate][0] for mate in group if mate != track and mate in tracks and tracks[mate][1] == group
            ]
            arcs = outer_arcs(place, others, self._range_m or 0.0, self._box)
            found += [(arc, *look) for arc in arcs]
        return found


def outer_arcs(
    centre: Place, others: Sequence[Place], radius_m: float, box: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> list[NDArray[np.float64]]:
    """The parts of a circle that are in no other one of the same radius.

    Args:
        centre: Its centre.
        others: Those of the others.
        radius_m: The radius.
        box: Opposite corners of what holds the map; what is outside is left out.

    Returns:
        Lines of two points or more, shape (n, 2) each; circles around one place do not hide each other.
    """
    points = np.array(centre) + radius_m * _CIRCLE
    hidden = np.any((points < box[0]) | (points > box[1]), axis=1)
    for other in others:
        hidden |= np.hypot(*(points - np.array(other)).T) < radius_m * (1.0 - 1e-9)
    edges = [0, *(np.flatnonzero(np.diff(hidden)) + 1).tolist(), len(points)]
    return [points[begin:end] for begin, end in pairwise(edges) if not hidden[begin] and end - begin > 1]
