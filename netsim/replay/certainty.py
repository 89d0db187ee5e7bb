"""How sure the nodes are: entropy of their marginals, width of the intervals that they certify."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.options import Pace
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, scalars
from netsim.trace.events import Marginals, PairProbabilities

ENTROPY_ORIGIN = "/plots/entropy"
WIDTH_ORIGIN = "/plots/width"

Told = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]
"""Instant, variable, and value of each word, in order."""


class EntropyTrack:
    """Entropy of the marginals, over all variables of which somebody has told: mean and most."""

    topics = (Marginals.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._told: list[Told] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; the curves are told at the end."""
        flat, lengths = batch.rows("probability")
        part = np.where(flat > 0.0, flat, 1.0)
        begins = np.cumsum(lengths) - lengths
        entropy_bit = np.add.reduceat(np.append(-part * np.log2(part), 0.0), begins) * (lengths > 0)
        self._told.append((batch.time_ns, batch.numbers("variable").astype(np.int64), entropy_bit))
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """Two curves."""
        yield from _curves(ENTROPY_ORIGIN, self._told, self._pace, ("mean entropy", "most"))


class WidthTrack:
    """Widths of the certified intervals, over all measurements of which somebody has told: mean and widest."""

    topics = (PairProbabilities.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._told: list[Told] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep the widest interval of each measurement; the curves are told at the end."""
        high, lengths = batch.rows("high")
        begins = np.cumsum(lengths) - lengths
        widest = np.maximum.reduceat(np.append(high - batch.rows("low")[0], 0.0), begins) * (lengths > 0)
        self._told.append((batch.time_ns, batch.numbers("variable").astype(np.int64), widest))
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """Two curves."""
        yield from _curves(WIDTH_ORIGIN, self._told, self._pace, ("mean width", "widest"))


def _curves(origin: str, told: list[Told], pace: Pace, names: tuple[str, str]) -> Iterator[Chunk]:
    """Mean and maximum of the latest values of all variables, at each instant at which one changes."""
    if not told:
        return
    times, variables, values = (np.concatenate(parts) for parts in zip(*told, strict=True))
    known, place = np.unique(variables, return_inverse=True)
    latest = np.full(len(known), np.nan)
    instants, begins = np.unique(times, return_index=True)
    means, mosts = [], []
    for begin, end in zip(begins, [*begins[1:], len(times)], strict=True):
        latest[place[begin:end]] = values[begin:end]
        means.append(float(np.nanmean(latest)))
        mosts.append(float(np.nanmax(latest)))
    first = max(0, int(np.searchsorted(instants, pace.start_ns, "right")) - 1)
    # What was said last before the window holds at its start, and what was said last of all to its end.
    times = np.concatenate([np.maximum(instants[first:], pace.start_ns), [pace.end_ns]])
    for name, curve, colour in zip(names, (means, mosts), (style.MEAN, style.LEAST), strict=True):
        path = f"{origin}/{name.replace(' ', '_')}"
        look = rr.SeriesLines(
            colors=[colour],
            names=[name],
            widths=[2.0],
            interpolation_mode=rr.components.InterpolationMode.StepAfter,
            aggregation_policy=rr.components.AggregationPolicy.Off,  # what all nodes tell at once is not to be averaged
        )
        yield static(path, look)
        yield scalars(path, times, np.append(np.array(curve)[first:], curve[-1]))
