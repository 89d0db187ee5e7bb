"""Curves of energy, in the unit that shows most: the fraction left, the joules left, or the joules used."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, scalars
from netsim.trace.events import NodeEnergy

_SUMMARY = {"least": style.LEAST, "mean": style.MEAN, "most": style.MOST}
_ALIKE_CAPACITIES = 3.0
_ALIKE_CURVES = 0.02
_LEGEND_CURVES = 8
_ROOT = "/plots/energy"
_TOGETHER = "/plots/energy_of_all"


@dataclass(frozen=True)
class EnergyPlot:
    """How the energy is best shown.

    Attributes:
        name: Title with unit.
        origin: Root of the curves to show.
        falling: Whether the curves fall.
        legend: Whether a legend fits.
    """

    name: str
    origin: str
    falling: bool
    legend: bool


class EnergyTrack:
    """Energy left a node, or used where no battery is drained much; many nodes as least, mean and most.

    Batteries of very different size are shown by the fraction left. Curves that coincide are shown as one.
    """

    topics = (NodeEnergy.topic,)
    past = False

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        full_j = np.asarray(setting.scene.nodes.battery_j, np.float64)
        battery = np.isfinite(full_j) & (full_j > 0.0) & setting.shown
        self._left = setting.drained and bool(battery.any())
        self._plotted = battery if self._left else setting.shown
        mine_j = full_j[battery]
        self._fraction = self._left and float(mine_j.max()) > _ALIKE_CAPACITIES * float(mine_j.min())
        self._full_j = full_j
        self._many = int(self._plotted.sum()) > setting.options.detail_nodes
        self._styled = False
        self._range = _Range()

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """The samples of a batch."""
        table = self._table(batch)
        self._range.add(batch.time_ns, table)
        if self._many:
            yield from self._summary(batch.time_ns, table)
            return
        for name, column in zip(self._names(), table.T, strict=True):
            sampled = ~np.isnan(column)
            yield scalars(entity("plots", "energy", name), batch.time_ns[sampled], column[sampled])

    def finish(self) -> Iterator[Chunk]:
        """One curve for all, if they coincide."""
        if self._together:
            name = f"{self._plotted.sum()} nodes, all within {100 * self._range.spread:.2g} %"
            yield static(_TOGETHER, rr.SeriesLines(colors=[style.MOST], names=[name], widths=[2.0]))
            yield scalars(_TOGETHER, *self._range.means())

    def plot(self) -> EnergyPlot:
        """How to show what was taken."""
        unit = "%" if self._fraction else "J"
        curves = len(_SUMMARY) if self._many else int(self._plotted.sum())
        return EnergyPlot(
            name=f"Energy {'left' if self._left else 'used'} ({unit})",
            origin=_TOGETHER if self._together else _ROOT,
            falling=self._left,
            legend=self._together or curves <= _LEGEND_CURVES,
        )

    @property
    def _together(self) -> bool:
        return not self._many and self._plotted.sum() > _LEGEND_CURVES and self._range.spread <= _ALIKE_CURVES

    def _names(self) -> list[str]:
        names = self._setting.scene.nodes.name
        return [name for name, plotted in zip(names, self._plotted, strict=True) if plotted]

    def _table(self, batch: Batch) -> NDArray[np.float64]:
        """One row a sample, one column a node; NaN where a node was not sampled."""
        node, lengths = batch.rows("node")
        value, _ = batch.rows("left_j" if self._left else "consumed_j")
        table = np.full((len(lengths), len(self._plotted)), np.nan)
        table[np.repeat(np.arange(len(lengths)), lengths), self._setting.scene.rows(node)] = value
        table = table[:, self._plotted]
        return table * (100.0 / self._full_j[self._plotted]) if self._fraction else table

    def _summary(self, time_ns: NDArray[np.int64], table: NDArray[np.float64]) -> Iterator[Chunk]:
        curves = (np.nanmin(table, axis=1), np.nanmean(table, axis=1), np.nanmax(table, axis=1))
        colours = list(_SUMMARY.values())  # green is good: most left, least used
        if not self._left:
            colours.reverse()
        for name, colour, curve in zip(_SUMMARY, colours, curves, strict=True):
            if not self._styled:
                yield static(f"{_ROOT}/{name}", rr.SeriesLines(colors=[colour], names=[name]))
            yield scalars(f"{_ROOT}/{name}", time_ns, curve)
        self._styled = True


class _Range:
    """How far curves lie apart, and their mean."""

    def __init__(self) -> None:
        self._widest = 0.0
        self._highest = 0.0
        self._means: list[tuple[NDArray[np.int64], NDArray[np.float64]]] = []

    def add(self, time_ns: NDArray[np.int64], table: NDArray[np.float64]) -> None:
        sampled = ~np.isnan(table).all(axis=1)
        time_ns, table = time_ns[sampled], table[sampled]
        if table.size:
            low, high = np.nanmin(table, axis=1), np.nanmax(table, axis=1)
            self._widest = max(self._widest, float((high - low).max()))
            self._highest = max(self._highest, float(high.max()))
            self._means.append((time_ns, np.nanmean(table, axis=1)))

    @property
    def spread(self) -> float:
        """Widest distance between two curves at an instant, as a fraction of the highest value; infinite for none."""
        return self._widest / self._highest if self._highest > 0.0 else float("inf")

    def means(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        times, values = zip(*self._means, strict=True)
        return np.concatenate(times), np.concatenate(values)
