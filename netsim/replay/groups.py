"""Collaboration groups: a hull around the sensors whose readings a leader used, in the colour of its track."""

from collections.abc import Iterator, Mapping

import numpy as np
import rerun as rr
import shapely
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.beliefs import HOLD_NS
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import Group

_MARGIN = 1.9  # node radii between a member and the hull
_QUARTER_SEGMENTS = 4
_SINGLE_PT, _JOINT_PT = -1.3, -2.4
_GONE = np.zeros((0, 2))

Hull = tuple[NDArray[np.float64], float]
"""Closed outline on the map, shape (n, 2), and its width."""
Told = tuple[list[int], int, bool]
"""Rows of the members, when they were told, whether the group is a joint one; without members a hull goes."""


class GroupTrack:
    """One hull a track: the latest group that measures it; of a joint group its first track's, with a broader line."""

    topics = (Group.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        self._told: list[tuple[int, list[int], list[int]]] = []
        """Instant, tracks, rows of the members."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; a group that measures no more is known at the end."""
        tracks, per_group = batch.rows("target")
        members, sizes = batch.rows("member")
        names = np.split(tracks, np.cumsum(per_group)[:-1])
        rows = np.split(self._scene.rows(members), np.cumsum(sizes)[:-1])
        for time_ns, name, row in zip(batch.time_ns.tolist(), names, rows, strict=True):
            self._told.append((time_ns, name.tolist(), [member for member in row.tolist() if member >= 0]))
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """A row an instant; a hull goes after a while without word."""
        for track, groups in sorted(self._groups().items()):
            path = f"/map/groups/{track}"
            look = rr.LineStrips2D.from_fields(colors=[style.kind_colour(track)], draw_order=style.ORDER["groups"])
            yield static(path, look)
            shown = self._shown(groups)
            instants = np.array(sorted(shown), np.int64)
            hulls = [self._hull(*shown[at_ns]) for at_ns in instants.tolist()]
            drawn = [hull for hull in hulls if len(hull[0])]
            strips = rr.LineStrips2D.columns(strips=[hull[0] for hull in drawn], radii=[hull[1] for hull in drawn])
            yield timed(path, instants, strips.partition([int(len(hull[0]) > 0) for hull in hulls]))

    def _groups(self) -> dict[int, dict[int, Told]]:
        """By track and instant; of a joint group its other tracks have none any more. Tracks without any are left out."""
        groups: dict[int, dict[int, Told]] = {}
        for time_ns, tracks, rows in self._told:
            for other in tracks[1:]:
                groups.setdefault(other, {})[time_ns] = [], time_ns, False
            groups.setdefault(tracks[0], {})[time_ns] = rows, time_ns, len(tracks) > 1
        return {track: told for track, told in groups.items() if any(rows for rows, *_ in told.values())}

    def _shown(self, groups: Mapping[int, Told]) -> dict[int, Told]:
        """What is shown from which instant of the window on."""
        shown: dict[int, Told] = {}
        instants = sorted(groups)
        for time_ns, after_ns in zip(instants, [*instants[1:], self._pace.end_ns], strict=True):
            over_ns = time_ns + HOLD_NS
            shown[max(time_ns, self._pace.start_ns)] = groups[time_ns]
            if groups[time_ns][0] and over_ns < after_ns:
                shown[max(over_ns, self._pace.start_ns)] = [], over_ns, False
        return shown

    def _hull(self, rows: list[int], time_ns: int, is_joint: bool) -> Hull:
        if not rows:
            return _GONE, 0.0
        places = self._scene.motion.places(np.array(rows, np.int64), np.full(len(rows), time_ns, np.int64))
        around = shapely.MultiPoint(places).convex_hull.buffer(_MARGIN * self._scene.radius_m, _QUARTER_SEGMENTS)
        return shapely.get_coordinates(around.exterior), _JOINT_PT if is_joint else _SINGLE_PT
