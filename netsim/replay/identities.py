"""Identity bars: of each track, how probable it is that it follows each target."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import Identity

_MOST_BARS = 100
_ROOM = 1.4


class IdentityTrack:
    """Side by side a group of bars a track, in each a bar a target; the latest word of whoever leads the track."""

    topics = (Identity.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._start_ns = setting.pace.start_ns
        self._told: list[tuple[int, int, NDArray[np.float64]]] = []
        """Instant, track, probability by target."""
        self.tracks: list[int] = []
        """Numbers of the tracks in the order of their groups; known at the end."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; how many bars there are is known at the end."""
        chances, lengths = batch.rows("probability")
        rows = np.split(chances, np.cumsum(lengths)[:-1])
        self._told += zip(batch.time_ns.tolist(), batch.numbers("track").tolist(), rows, strict=True)
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One entity a target."""
        tracks = sorted({track for _, track, _ in self._told})
        targets = max((len(row) for *_, row in self._told), default=0)
        if targets < 2 or len(tracks) * targets > _MOST_BARS:
            return
        self.tracks = tracks
        instants, chances = self._table(targets)
        at = np.arange(len(tracks)) * (targets + 1.0)
        for target in range(targets):
            # A bar without height keeps a part of the picture free for the legend.
            bars = np.pad(chances[:, :, target], ((0, 0), (0, 1)))
            places = np.append(at + target, _ROOM * len(tracks) * (targets + 1.0))
            yield timed(f"/identity/target_{target}", instants, _columns(bars, places, style.kind_colour(target)))

    def _table(self, targets: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Instants, and the probabilities from each on; shape (instants, tracks, targets)."""
        now = np.zeros((len(self.tracks), targets))
        shown: dict[int, NDArray[np.float64]] = {}
        for time_ns, track, row in self._told:
            now[self.tracks.index(track)] = np.pad(row, (0, targets - len(row)))
            shown[max(time_ns, self._start_ns)] = now.copy()
        return np.array(list(shown), np.int64), np.stack(list(shown.values()))


def _columns(heights: NDArray[Any], at: NDArray[np.float64], colour: style.Rgba) -> list[rr.ComponentColumn]:
    """Rows of bars. Rerun's own `columns` takes several rows for one that is not flat (0.41)."""
    drawn = [rr.BarChart(row, abscissa=at, color=colour).as_component_batches() for row in heights]
    columns = []
    for batches in zip(*drawn, strict=True):
        whole = rr.AnyBatchValue(
            batches[0].component_descriptor(), pa.concat_arrays([batch.as_arrow_array() for batch in batches])
        )
        columns.append(rr.ComponentColumn(whole.component_descriptor(), whole))
    return columns
