"""Who is who: for each track a bar of how probable it is to follow each target, in the targets' colours."""

from collections.abc import Iterator, Mapping

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.standing import standing
from netsim.replay.track import Setting, timed
from netsim.trace.events import Identity

_BARS, _TEXT = "/identity/bars", "/identity/text"
_LONG = 16.0
"""Length of a bar, in rows; it begins at 0."""
_COLUMNS, _LINES = 200, 4
"""Pixels of a bar: half a percent each; the uppermost line of a row is blank."""
_NAME_AT = -1.6
_LABEL_RISE = 0.32
"""Rerun hangs a label below its place; the places are so much above the middles of the bars."""
_LEAST_LABELLED = 0.08
"""Shorter parts of a bar have no room for their number."""

Row = tuple[float, ...]
Bars = Mapping[int, tuple[int, Row]]
"""Track -> its place from the top, and the probability of each target."""
Ranges = tuple[tuple[float, float], tuple[float, float]]
Label = tuple[tuple[float, float], style.Rgba, str]


class IdentityTrack:
    """One bar a track, from the top in the order in which they began; the place of one that is over is free again."""

    topics = (Identity.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._told: list[tuple[int, int, Row]] = []
        self.rows = 0
        """How many bars there are at most at a time; known at the end."""

    @property
    def bounds(self) -> Ranges | None:
        """Ranges of x and y of the view; None where there is nothing to show."""
        if not self.rows:
            return None
        return (2.0 * _NAME_AT, _LONG + 0.5), (0.0, self.rows + 0.3)

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; what stands when is known at the end."""
        chances, lengths = batch.rows("probability")
        each = np.split(chances, np.cumsum(lengths)[:-1])
        for time_ns, track, row in zip(batch.time_ns.tolist(), batch.numbers("track").tolist(), each, strict=True):
            self._told.append((time_ns, track, tuple(row.tolist())))
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """All bars at each instant."""
        shown = _placed(standing(self._told, self._pace))
        self.rows = 1 + max((place for bars in shown.values() for place, _ in bars.values()), default=-1)
        if not self.rows:
            return
        times = np.array(list(shown), np.int64)
        yield from self._look()
        buffers = [_picture(bars, self.rows).reshape(-1) for bars in shown.values()]
        yield timed(_BARS, times, rr.Image.columns(buffer=buffers, format=[self._size()] * len(buffers)))
        labels = [_labels(bars) for bars in shown.values()]
        every = [label for each in labels for label in each]
        columns = rr.Points2D.columns(
            positions=np.array([place for place, _, _ in every]).reshape(-1, 2),
            colors=[colour for _, colour, _ in every],
            labels=[text for *_, text in every],
        )
        yield timed(_TEXT, times, columns.partition([len(each) for each in labels]))

    def _size(self) -> rr.components.ImageFormat:
        """The picture's size, told at each instant: in a live view the number of bars grows."""
        return rr.components.ImageFormat(_COLUMNS, self.rows * _LINES, color_model="RGBA", channel_datatype="U8")

    def _look(self) -> Iterator[Chunk]:
        """How the picture is put, and that labels are seen."""
        yield static(_BARS, rr.Image.from_fields(magnification_filter="nearest", draw_order=0.0))
        yield static(_BARS, rr.Transform3D.from_fields(scale=[_LONG / _COLUMNS, 1.0 / _LINES, 1.0]))
        yield static(_TEXT, rr.Points2D.from_fields(radii=[0.0], show_labels=True, draw_order=1.0))


def _placed(shown: Mapping[int, Mapping[int, Row]]) -> dict[int, Bars]:
    """The same with each track's place at each instant: the first free one when it begins."""
    held: dict[int, int] = {}
    found: dict[int, Bars] = {}
    for at_ns, tracks in shown.items():
        held = {track: place for track, place in held.items() if track in tracks}
        for track in tracks:
            if track not in held:
                held[track] = min(set(range(len(held) + 1)) - set(held.values()))
        found[at_ns] = {track: (held[track], row) for track, row in tracks.items()}
    return found


def _picture(bars: Bars, rows: int) -> NDArray[np.uint8]:
    """Pixels of all bars; shape (rows * _LINES, _COLUMNS, 4)."""
    picture = np.zeros((rows, _LINES, _COLUMNS, 4), np.uint8)
    middles = (np.arange(_COLUMNS) + 0.5) / _COLUMNS
    for place, row in bars.values():
        colours = np.array([style.kind_colour(target) for target in range(len(row))], np.uint8).reshape(-1, 4)
        if len(row):
            targets = np.searchsorted(np.cumsum(row), middles).clip(max=len(row) - 1)
            picture[place, 1:] = colours[targets]
    return picture.reshape(rows * _LINES, _COLUMNS, 4)


def _labels(bars: Bars) -> list[Label]:
    """The tracks' names before their bars, and the numbers of all parts that have room for one."""
    found: list[Label] = []
    for track, (place, row) in bars.items():
        height = place + 0.5 * (1.0 + 1.0 / _LINES) - _LABEL_RISE
        found.append(((_NAME_AT, height), style.kind_colour(track), f"track {track}"))
        ends = np.cumsum(row).tolist()
        found += [
            ((_LONG * (end - chance / 2), height), style.LABEL, f"{chance:.2f}")
            for chance, end in zip(row, ends, strict=True)
            if chance >= _LEAST_LABELLED
        ]
    return found
