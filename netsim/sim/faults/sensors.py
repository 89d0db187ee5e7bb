"""What may befall the readings of a sensor; the truth in the trace is untouched."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from netsim.rng import Streams
from netsim.sim.faults.announce import Announcer, Span
from netsim.units import NS_PER_S

Reading = np.ndarray[Any, np.dtype[np.float64]]
NS_PER_H = 3600 * NS_PER_S


class ReadingChange(Protocol):
    """What a rule makes of one sensor's readings."""

    def changed(self, reading: Reading, now_ns: int, holds: bool) -> Reading:
        """The reading that the node gets; it is asked for every one, also while the rule does not hold."""
        ...


@dataclass(frozen=True, slots=True)
class SensorFault:
    """A rule about one node's sensor, ready for use.

    Attributes:
        change: What it does.
        announcer: Tells the trace.
        span: When it holds.
    """

    change: ReadingChange
    announcer: Announcer
    span: Span


def faulty(
    node: int, observe: Callable[[], Reading], rules: Sequence[SensorFault], now_ns: Callable[[], int]
) -> Callable[[], Reading]:
    """The view of a sensor with faults.

    Args:
        node: Whose sensor.
        observe: What a sound one would say.
        rules: In the order of the scenario: each is applied to what the one before has left.
        now_ns: Simulated time.
    """

    def view() -> Reading:
        reading, at_ns = observe(), now_ns()
        for rule in rules:
            holds = rule.span.holds(at_ns)
            reading = rule.change.changed(reading, at_ns, holds)
            if holds:
                rule.announcer.strikes([node], "reading")
        return reading

    return view if rules else observe


@dataclass(frozen=True, slots=True)
class Biased:
    """Off by a constant and a drift since `from_ns`."""

    bias: float
    drift_per_h: float
    from_ns: int

    def changed(self, reading: Reading, now_ns: int, holds: bool) -> Reading:
        """See `ReadingChange.changed`."""
        return reading + (self.bias + self.drift_per_h * (now_ns - self.from_ns) / NS_PER_H) if holds else reading


class Stuck:
    """The same reading again and again."""

    def __init__(self) -> None:
        self._last: Reading | None = None

    def changed(self, reading: Reading, now_ns: int, holds: bool) -> Reading:
        """See `ReadingChange.changed`."""
        if not holds or self._last is None:
            self._last = reading
        return self._last.copy()


@dataclass(frozen=True, slots=True)
class Noisy:
    """Normal noise on every value, by the time of the reading: readings at one instant are alike."""

    streams: Streams
    name: str
    sd: float

    def changed(self, reading: Reading, now_ns: int, holds: bool) -> Reading:
        """See `ReadingChange.changed`."""
        if not holds:
            return reading
        noise = self.streams.generator(f"{self.name}/{now_ns}").normal(0.0, self.sd, reading.shape)
        return np.asarray(reading + noise)


class Dead:
    """No measurement at all."""

    def changed(self, reading: Reading, now_ns: int, holds: bool) -> Reading:
        """See `ReadingChange.changed`."""
        return np.atleast_1d(reading)[:0] if holds else reading
