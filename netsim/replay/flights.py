"""Frames in flight, as pure arithmetic: which arrow is shown at which display tick, and how far it has come.

A flight is one frame on its way to one listener. It is shown for `hold_ns` from the start of its transmission, at the
ticks `k * tick_ns` in that time; its head has come the fraction of the hold that is over at the end of the tick.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Flights:
    """Flights as columns.

    Attributes:
        start_ns: Start of the transmission.
        layer: Number of the layer (kind, acknowledgement, loss) that shows it.
        tail: Row of the sender in the node table.
        head: Row of the listener.
        outcome: Code of what became of it.
    """

    start_ns: Ints
    layer: Ints
    tail: Ints
    head: Ints
    outcome: Ints

    def pick(self, which: NDArray[np.bool_] | Ints) -> "Flights":
        """Some of the flights."""
        return Flights(self.start_ns[which], self.layer[which], self.tail[which], self.head[which], self.outcome[which])

    def join(self, other: "Flights") -> "Flights":
        """These flights and others."""
        pairs = zip(self.columns(), other.columns(), strict=True)
        return Flights(*(np.concatenate(pair) for pair in pairs))

    def columns(self) -> tuple[Ints, Ints, Ints, Ints, Ints]:
        """The columns in the order of the fields."""
        return self.start_ns, self.layer, self.tail, self.head, self.outcome


NO_FLIGHTS = Flights(*(np.empty(0, np.int64) for _ in range(5)))


@dataclass(frozen=True)
class Rows:
    """What one layer shows at successive ticks.

    Attributes:
        layer: Number of the layer.
        time_ns: Instant of each row.
        lengths: How many arrows each row has; 0 clears the layer.
        flights: The arrows of all rows in turn.
        reach: How far each arrow has come, in (0, 1].
    """

    layer: int
    time_ns: Ints
    lengths: Ints
    flights: Flights
    reach: NDArray[np.float64]


class Air:
    """Turns flights that arrive in batches into rows; it remembers only what is still in the air."""

    def __init__(self, start_ns: int, tick_ns: int, hold_ns: int) -> None:
        self._tick_ns = tick_ns
        self._hold_ns = hold_ns
        self._next_tick = -(-start_ns // tick_ns)
        self._flying = NO_FLIGHTS
        self._busy: set[int] = set()  # layers that show something at the last tick given out

    def advance(self, flights: Flights, horizon_ns: int) -> Iterator[Rows]:
        """Take more flights and give out the rows of all ticks before `horizon_ns`; later flights start after it."""
        flying = self._flying.join(flights)
        horizon = max(self._next_tick, -(-horizon_ns // self._tick_ns))
        first, end = self._ticks(flying)
        low, high = np.maximum(first, self._next_tick), np.minimum(end, horizon)
        counts = np.maximum(high - low, 0)
        which = np.repeat(np.arange(len(counts)), counts)
        tick = low[which] + np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        yield from self._rows(flying.pick(which), tick, horizon)
        self._flying = flying.pick(end > horizon)
        self._next_tick = horizon

    def _ticks(self, flights: Flights) -> tuple[Ints, Ints]:
        """First tick at which each flight is shown, and the first at which it is not any more."""
        return -(-flights.start_ns // self._tick_ns), -(-(flights.start_ns + self._hold_ns) // self._tick_ns)

    def _rows(self, shown: Flights, tick: Ints, horizon: int) -> Iterator[Rows]:
        over_ns = (tick + 1) * self._tick_ns - shown.start_ns
        reach = np.clip(over_ns / self._hold_ns, 0.0, 1.0)
        layers = {int(layer) for layer in np.unique(shown.layer)} | self._busy
        busy: set[int] = set()
        for layer in sorted(layers):
            mine = np.flatnonzero(shown.layer == layer)
            mine = mine[np.argsort(tick[mine], kind="stable")]
            ticks, lengths = self._with_clearings(tick[mine], layer, horizon)
            if (len(mine) and tick[mine[-1]] == horizon - 1) or (layer in self._busy and horizon == self._next_tick):
                busy.add(layer)
            if len(ticks):
                yield Rows(layer, ticks * self._tick_ns, lengths, shown.pick(mine), reach[mine])
        self._busy = busy

    def _with_clearings(self, tick: Ints, layer: int, horizon: int) -> tuple[Ints, Ints]:
        """The ticks of a layer and their numbers of arrows, with an empty tick after each busy run."""
        busy, lengths = np.unique(tick, return_counts=True)
        after = np.setdiff1d(busy + 1, busy)
        if layer in self._busy and self._next_tick not in busy:
            after = np.append(after, self._next_tick)
        after = after[after < horizon]
        ticks = np.concatenate([busy, after])
        order = np.argsort(ticks)
        return ticks[order], np.concatenate([lengths, np.zeros(len(after), np.int64)])[order]
