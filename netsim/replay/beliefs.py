"""Beliefs on a grid: cells coloured by their probability, under everything else on the map."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, line_names, timed
from netsim.trace.events import Belief
from netsim.units import s_to_ns

HOLD_NS = s_to_ns(5.0)
"""How long a belief is shown when nothing follows."""

Image = NDArray[np.uint8]
"""Red, green, blue and opacity; shape (rows, columns, 4), the first row in the north."""


class BeliefTrack:
    """One picture a track and thread; the latest belief of it, whoever holds it."""

    topics = (Belief.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._shapes: dict[str, tuple[int, int]] = {}
        self._last_ns: dict[str, int] = {}

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """One row a belief."""
        names = line_names(batch)
        for name in np.unique(names).tolist():
            mine = batch.where(names == name).since(self._setting.pace.start_ns)
            if name not in self._shapes:
                self._shapes[name] = self._shape(mine)
                yield from self._look(mine, name)
            yield self._pictures(mine, name)

    def finish(self) -> Iterator[Chunk]:
        """Beliefs that ended before the window does fade."""
        for name, last_ns in self._last_ns.items():
            if last_ns + HOLD_NS < self._setting.pace.end_ns:
                yield self._chunk(name, {self._at(last_ns + HOLD_NS): self._blank(name)})

    def _at(self, time_ns: int) -> int:
        """When something of an instant is shown: not before the window."""
        return max(time_ns, self._setting.pace.start_ns)

    def _shape(self, batch: Batch) -> tuple[int, int]:
        """Rows and columns of the grid: those that cover the field, or the cells there are."""
        columns = int(batch.numbers("columns")[0])
        field, (cell, _) = self._setting.scene.field, batch.rows("cell")
        rows = int(cell.max(initial=0)) // columns + 1
        if field is not None:
            height_m = field.y_m + field.height_m - float(batch.numbers("origin_y_m")[0])
            rows = max(rows, math.ceil(height_m / float(batch.numbers("cell_m")[0]) - 1e-9))
        return rows, columns

    def _look(self, batch: Batch, name: str) -> Iterator[Chunk]:
        rows, columns = self._shapes[name]
        left_m, low_m, cell_m = (float(batch.numbers(each)[0]) for each in ("origin_x_m", "origin_y_m", "cell_m"))
        looks = rr.Image.from_fields(
            format=rr.components.ImageFormat(columns, rows, color_model="RGBA", channel_datatype="U8"),
            magnification_filter="nearest",
            opacity=0.999,  # otherwise Rerun draws it as if nothing were behind it
            draw_order=style.ORDER["beliefs"],
        )
        yield static(_path(name), looks)
        place = rr.Transform3D.from_fields(
            translation=[left_m, -(low_m + rows * cell_m), 0.0], scale=[cell_m, cell_m, 1.0]
        )
        yield static(_path(name), place)

    def _pictures(self, batch: Batch, name: str) -> Chunk:
        cells, lengths = batch.rows("cell")
        chances, _ = batch.rows("probability")
        ends = np.cumsum(lengths)[:-1]
        told: dict[int, Image] = {}
        for time_ns, cell, chance in zip(
            batch.time_ns.tolist(), np.split(cells, ends), np.split(chances, ends), strict=True
        ):
            last_ns = self._last_ns.get(name, time_ns)
            if time_ns > last_ns + HOLD_NS:
                told[self._at(last_ns + HOLD_NS)] = self._blank(name)
            self._last_ns[name] = time_ns
            told[self._at(time_ns)] = self._picture(name, cell, chance)
        return self._chunk(name, told)

    def _picture(self, name: str, cell: NDArray[np.int64], chance: NDArray[np.float64]) -> Image:
        rows, columns = self._shapes[name]
        inside = cell < rows * columns
        picture = self._blank(name).reshape(-1, 4)
        share = chance[inside] / max(float(chance.max(initial=0.0)), 1e-300)
        is_blank = len(share) > 1 and float(np.ptp(share)) == 0.0
        picture[cell[inside]] = style.belief_colours(share * style.UNIFORM_BELIEF if is_blank else share)
        return picture.reshape(rows, columns, 4)[::-1]

    def _blank(self, name: str) -> Image:
        return np.zeros((*self._shapes[name], 4), np.uint8)

    def _chunk(self, name: str, told: Mapping[int, Image]) -> Chunk:
        times_ns = np.array(list(told), np.int64)
        buffers = [np.ascontiguousarray(image).reshape(-1) for image in told.values()]
        return timed(_path(name), times_ns, rr.Image.columns(buffer=buffers))


def _path(name: str) -> str:
    return f"/map/beliefs/{name}"
