"""Curves of how far the nodes' clocks are from true time, in the unit that suits."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, scalars
from netsim.trace.events import NodeClocks

_UNITS = (("s", 1.0), ("ms", 1e3), ("\u00b5s", 1e6), ("ns", 1e9))
_MOST_CURVES = 8  # more are shown as least, mean and most


class ClockTrack:
    """The error of each clock; of many the least, mean and most."""

    topics = (NodeClocks.topic,)
    past = False

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._times: list[NDArray[np.int64]] = []
        self._tables: list[NDArray[np.float64]] = []
        self._unit = "s"

    @property
    def name(self) -> str:
        """Title with unit."""
        return f"Clocks ahead ({self._unit})"

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep the samples; the largest tells the unit."""
        node, lengths = batch.rows("node")
        row = self._setting.scene.rows(node)
        table = np.full((len(lengths), len(self._setting.shown)), np.nan)
        sample = np.repeat(np.arange(len(lengths)), lengths)
        table[sample[row >= 0], row[row >= 0]] = batch.rows("ahead_s")[0][row >= 0]
        self._times.append(batch.time_ns)
        self._tables.append(table[:, self._setting.shown])
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One curve a node, or three."""
        if not self._tables:
            return
        time_ns, table = np.concatenate(self._times), np.concatenate(self._tables)
        sampled = ~np.isnan(table).all(axis=1)
        time_ns, table = time_ns[sampled], table[sampled]
        largest_s = float(np.nanmax(np.abs(table), initial=0.0))
        self._unit, scale = next((unit for unit in _UNITS if largest_s * unit[1] >= 1.0), _UNITS[-1])
        for name, colour, curve in self._curves(table * scale):
            path = entity("plots", "clock", name)
            known = ~np.isnan(curve)
            yield static(path, rr.SeriesLines(colors=[colour], names=[name], widths=[1.5]))
            yield scalars(path, time_ns[known], curve[known])

    def _curves(self, table: NDArray[np.float64]) -> Iterator[tuple[str, style.Rgba, NDArray[np.float64]]]:
        if table.shape[1] > _MOST_CURVES:
            yield "most ahead", style.MOST, np.nanmax(table, axis=1)
            yield "mean", style.MEAN, np.nanmean(table, axis=1)
            yield "most behind", style.LEAST, np.nanmin(table, axis=1)
            return
        names = [name for name, shown in zip(self._setting.scene.nodes.name, self._setting.shown, strict=True) if shown]
        for number, name in enumerate(names):
            yield name, style.kind_colour(number), table[:, number]
