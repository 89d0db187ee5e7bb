r"""Where instants lie on the time axis.

Non-linear time, after the sequence chart of OMNeT++ (Varga and Hornig, "An overview of the OMNeT++ simulation environment",
SIMUTools 2008; OMNeT++ User Guide, "Sequence charts"): between two events that follow each other the axis advances by a step
that grows with the logarithm of the gap, so that an acknowledgement of 0.35 ms and a pause of 5 s are in one picture. With
the instants t_0 < t_1 < ... at which something begins or ends, and n_i transmissions in the air between t_i and t_{i+1},

    y(t_0) = 0,    y(t_{i+1}) = y(t_i) + b sqrt(max(1, n_i)) log10(1 + (t_{i+1} - t_i) / tau),

and straight lines between. It is continuous and strictly increasing. tau is a quarter of the shortest airtime in the window,
so that the shortest frame that nothing interrupts is b log10(5) = 0.7 b high; b is `STEP`. The root gives arrows that lie
beside each other some room.
"""

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from netsim.sequence.records import Exchange

TIMES = ("nonlinear", "linear", "events")
STEP = 17.0
"""What a gap of nine times tau takes, in the picture's units (points on screen)."""
EVENT_STEP = 12.0
"""From one event to the next where all steps are equal."""
_SHARE_OF_AIRTIME = 4
_LINEAR_AIRTIME = (
    16.0  # height of the median airtime in linear time, if that makes the picture neither short nor endless
)
_LINEAR_HEIGHTS = (500.0, 24_000.0)
_LINEAR_TICK = 50.0
_LONG_PAUSE = 5.0  # pauses are marked that are this many times as long as the longest frame


@dataclass(frozen=True)
class Pause:
    """A time in which nothing happens.

    Attributes:
        start_ns: When it begins.
        end_ns: When it ends.
    """

    start_ns: int
    end_ns: int


@dataclass(frozen=True)
class TimeScale:
    """Places of instants, straight lines between.

    Attributes:
        instants_ns: In ascending order, shape (n,).
        places: Where they lie, shape (n,); strictly ascending.
        in_air: How many transmissions are in the air from each instant to the next, shape (n - 1,).
        pauses: The long pauses, whose length is to be told.
        tick_ns: Distance of the marks on an axis that is true to scale; 0 on others.
    """

    instants_ns: NDArray[np.int64]
    places: NDArray[np.float64]
    in_air: NDArray[np.int64]
    pauses: Sequence[Pause] = ()
    tick_ns: int = 0

    def place(self, time_ns: int) -> float:
        """Where an instant lies; those before the first or after the last lie with these."""
        instants_ns, places = self._columns
        after = bisect_right(instants_ns, time_ns)
        if after in (0, len(instants_ns)):
            return places[min(after, len(places) - 1)]
        share = (time_ns - instants_ns[after - 1]) / (instants_ns[after] - instants_ns[after - 1])
        return places[after - 1] + share * (places[after] - places[after - 1])

    @cached_property
    def _columns(self) -> tuple[list[int], list[float]]:
        """As lists, in which a single place is found much faster."""
        return self.instants_ns.tolist(), self.places.tolist()

    def most_in_air(self, start_ns: int, end_ns: int) -> int:
        """How many transmissions are in the air at once, at most, between two of the instants."""
        low, high = np.searchsorted(self.instants_ns, [start_ns, end_ns])
        return int(self.in_air[low:high].max(initial=0))

    @property
    def length(self) -> float:
        """Of the whole axis."""
        return float(self.places[-1])


def scale_of(exchange: Exchange, time: str, marks_ns: Iterable[int] = ()) -> TimeScale:
    """The axis of an exchange.

    Args:
        exchange: What is shown.
        time: `nonlinear`; `linear`, true to scale; or `events`, where all steps are equal.
        marks_ns: Instants of what is shown besides the frames.
    """
    airtimes_ns = np.array([end - begun for each in exchange.transmissions for begun, end in each.aired], np.int64)
    ends = (instant for each in exchange.transmissions for instant in (each.start_ns, each.end_ns))
    instants_ns = np.unique(np.array([*ends, *marks_ns], np.int64))
    gaps_ns, in_air = np.diff(instants_ns).astype(float), _in_air(exchange, instants_ns)
    if time == "linear":
        return _linear(instants_ns, in_air, airtimes_ns)
    shortest_ns = int(airtimes_ns[airtimes_ns > 0].min(initial=np.iinfo(np.int64).max))
    steps = np.full(len(gaps_ns), EVENT_STEP) if time == "events" else log_steps(gaps_ns, in_air, shortest_ns)
    pauses = _pauses(instants_ns, in_air, int(airtimes_ns.max()))
    return TimeScale(instants_ns, np.append(0.0, np.cumsum(steps)), in_air, pauses)


def _linear(instants_ns: NDArray[np.int64], in_air: NDArray[np.int64], airtimes_ns: NDArray[np.int64]) -> TimeScale:
    """As high as makes the median airtime legible, within bounds."""
    since_ns = (instants_ns - instants_ns[0]).astype(float)
    span_ns = max(float(since_ns[-1]), 1.0)
    height = float(np.clip(_LINEAR_AIRTIME * span_ns / max(float(np.median(airtimes_ns)), 1.0), *_LINEAR_HEIGHTS))
    tick_ns = max(1, round(_nice(_LINEAR_TICK * span_ns / height)))
    return TimeScale(instants_ns, since_ns * height / span_ns, in_air, tick_ns=tick_ns)


def _nice(value: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value)


def log_steps(gaps_ns: NDArray[np.float64], in_air: NDArray[np.int64], shortest_airtime_ns: int) -> NDArray[np.float64]:
    """How far the non-linear axis advances over each gap between events.

    Args:
        gaps_ns: The gaps, shape (n,).
        in_air: How many transmissions are in the air meanwhile, shape (n,).
        shortest_airtime_ns: Of the frames shown.
    """
    tau_ns = shortest_airtime_ns / _SHARE_OF_AIRTIME
    return np.asarray(STEP * np.sqrt(np.maximum(in_air, 1)) * np.log1p(gaps_ns / tau_ns) / np.log(10.0))


def _in_air(exchange: Exchange, instants_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many transmissions are in the air from each instant to the next."""
    begun = np.array(sorted(each.start_ns for each in exchange.transmissions), np.int64)
    ended = np.array(sorted(each.end_ns for each in exchange.transmissions), np.int64)
    from_ns = instants_ns[:-1]
    return np.asarray(np.searchsorted(begun, from_ns, "right") - np.searchsorted(ended, from_ns, "right"))


def _pauses(instants_ns: NDArray[np.int64], in_air: NDArray[np.int64], longest_ns: int) -> list[Pause]:
    """Long gaps between events; while something is in the air it is no pause."""
    long = np.flatnonzero((np.diff(instants_ns) >= max(1, round(_LONG_PAUSE * longest_ns))) & (in_air == 0))
    return [Pause(int(instants_ns[at]), int(instants_ns[at + 1])) for at in long]
