"""The clock of a node: an oscillator that starts off and drifts, and the software clock that can be set.

Every mapping is exact in whole numbers: a reading is a whole nanosecond, it never decreases while the clock is not set
back, and `true_ns` gives the first true instant at which a reading is reached. Rates are constant over a run; noise of the
oscillator, its temperature and its ageing are not modelled.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from annotated_types import Ge, Le
from simpy.events import Event as SimEvent

from netsim.api import Op
from netsim.parameters import NonNegative, parameters
from netsim.sim.clock import Action, Clock
from netsim.units import s_to_ns

PPT_PER_PPM: Final = 10**6
_PPT: Final = 10**12
_PPB: Final = 10**9


@parameters
class ClockParameters:
    """Clocks of inexpensive crystals; every node's drift and offset are drawn once, from a stream of its own."""

    drift_sd_ppm: Annotated[float, Ge(0), Le(10_000)] = 30.0
    """Standard deviation of the rate; 30 ppm is what Castalia assumes and 6TiSCH allows, IEEE 802.15.4 asks for 40 at
    most."""
    offset_sd_s: NonNegative = 0.0
    """Standard deviation of what the clocks show at the start: 0 where all are set as they are switched on."""
    stamp_sd_s: NonNegative = 1e-6
    """Standard deviation of the error with which the radio captures the start of a received frame; the default is the
    resolution of the MICA2's 1 MHz counter."""


@dataclass(frozen=True, slots=True)
class Line:
    """A clock that reads another one: it shows `shown` where the other shows `since`, and gains `excess / parts`.

    `at` never decreases, because `excess` is above `-parts`.
    """

    since: int
    shown: int
    excess: int
    parts: int

    def at(self, reading: int) -> int:
        """What it shows where the other shows `reading`."""
        elapsed = reading - self.since
        return self.shown + elapsed + elapsed * self.excess // self.parts

    def first(self, shown: int) -> int:
        """The lowest reading of the other at which it shows `shown` or more."""
        return self.since + -(-(shown - self.shown) * self.parts // (self.parts + self.excess))


class LocalClock:
    """A node's clock.

    The counter runs from the node's oscillator and is never set. The clock that an algorithm sees is the counter until
    somebody adjusts it.

    Args:
        clock: True time.
        offset_ns: What the counter shows at the true time 0.
        drift_ppt: How much faster than true time it runs, in parts per 10^12 (1 ppm is 10^6); above -10^12.
        stamp_error_ns: Error with which the radio captures a true instant; the same each time that instant is asked for.
    """

    def __init__(
        self,
        clock: Clock,
        offset_ns: int = 0,
        drift_ppt: int = 0,
        stamp_error_ns: Callable[[int], int] = lambda true_ns: 0,
    ) -> None:
        self._clock = clock
        self._counter = Line(0, offset_ns, drift_ppt, _PPT)
        self._shown = Line(0, 0, 0, _PPB)
        self._stamp_error_ns = stamp_error_ns
        self._is_true = offset_ns == 0 and drift_ppt == 0
        self.drifts = not self._is_true
        self._alarms: dict[SimEvent, int] = {}
        self._calls: dict[SimEvent, tuple[Callable[[int, Action], None], Callable[[], None]]] = {}

    @property
    def now_ns(self) -> int:
        """What the clock shows."""
        return self._clock.now_ns if self._is_true else self.at(self._clock.now_ns)

    @property
    def counter_ns(self) -> int:
        """What the counter below it shows."""
        return self.counter_at(self._clock.now_ns)

    @property
    def ahead_ns(self) -> int:
        """How far the clock is ahead of true time."""
        return self.now_ns - self._clock.now_ns

    def at(self, true_ns: int) -> int:
        """What the clock shows at a true instant, as it is set at present."""
        return self._shown.at(self._counter.at(true_ns))

    def counter_at(self, true_ns: int) -> int:
        """What the counter shows at a true instant."""
        return self._counter.at(true_ns)

    def true_ns(self, local_ns: int) -> int:
        """The first true instant at which the clock, as it is set at present, shows `local_ns` or more."""
        return local_ns if self._is_true else self._counter.first(self._shown.first(local_ns))

    def counter_true_ns(self, counter_ns: int) -> int:
        """The first true instant at which the counter shows `counter_ns` or more."""
        return self._counter.first(counter_ns)

    def delay_of(self, duration_ns: int) -> int:
        """True time from now until the clock, not set meanwhile, has advanced by `duration_ns`."""
        return duration_ns if self._is_true else self.delay_until(self.now_ns + duration_ns)

    def local_ns(self) -> int:
        """What the clock shows, for a MAC with slots."""
        return self.now_ns

    def delay_until(self, local_ns: int) -> int:
        """True time from now until the clock, not set meanwhile, shows `local_ns`; 0 if it has."""
        return max(0, self.true_ns(local_ns) - self._clock.now_ns)

    def wait_until(self, local_ns: int) -> Op[None]:
        """Wait until the clock shows `local_ns`, also if it is adjusted meanwhile."""
        while self.now_ns < local_ns:
            if self._is_true:
                yield self._clock.timeout(local_ns - self._clock.now_ns)
                continue
            alarm = self._clock.event()
            self._alarms[alarm] = local_ns
            self._arm(alarm)
            try:
                yield alarm
            finally:
                self._alarms.pop(alarm, None)

    def call_at(self, local_ns: int, call: Callable[[int, Action], None], action: Callable[[], None]) -> None:
        """Call `action` at the instant at which the clock shows `local_ns`, also if it is adjusted meanwhile.

        Args:
            local_ns: When.
            call: `Clock.call_first` or another of its kind, for the rank among the events of that instant.
            action: What to do.
        """
        alarm = self._clock.event()
        self._alarms[alarm] = local_ns
        self._calls[alarm] = call, action
        self._arm(alarm)

    def adjust(self, step_ns: int, rate_ppb: int) -> None:
        """Set the clock: add `step_ns` to what it shows, and let it gain `rate_ppb` on the counter from now on.

        What waits for a time of this clock is called at the instant at which the clock, as set now, shows it.
        """
        counter_ns = self.counter_ns
        self._shown = Line(counter_ns, self._shown.at(counter_ns) + step_ns, rate_ppb, _PPB)
        self._is_true = False
        for alarm in list(self._alarms):
            self._arm(alarm)

    def stamped(self, true_ns: int) -> int:
        """The counter's reading at a true instant, as the radio captured it: with the error of its capture."""
        return self.counter_at(true_ns) + self._stamp_error_ns(true_ns)

    def _arm(self, alarm: SimEvent) -> None:
        call = self._calls[alarm][0] if alarm in self._calls else self._clock.call_after
        call(self.delay_until(self._alarms[alarm]), lambda _: self._ring(alarm))

    def _ring(self, alarm: SimEvent) -> None:
        """Wake who waits, unless an adjustment has made it too early or somebody was quicker."""
        if alarm in self._alarms and self.now_ns >= self._alarms[alarm]:
            del self._alarms[alarm]
            if alarm in self._calls:
                self._calls.pop(alarm)[1]()
            else:
                alarm.succeed()


def drawn_clock(clock: Clock, parameters: ClockParameters | None, generator: np.random.Generator) -> LocalClock:
    """The clock of a node; a perfect one without parameters.

    Args:
        clock: True time.
        parameters: How clocks differ; None for perfect ones.
        generator: The node's own stream. Drift and offset are drawn whatever their spread, so that another spread scales
            the same numbers.
    """
    if parameters is None:
        return LocalClock(clock)
    drift, offset = generator.standard_normal(2).tolist()
    key = generator.integers(1 << 63, size=2)

    def stamp_error_ns(true_ns: int) -> int:
        if parameters.stamp_sd_s == 0.0:
            return 0
        source = np.random.Generator(np.random.Philox(key=key, counter=true_ns))
        return s_to_ns(float(source.standard_normal()) * parameters.stamp_sd_s)

    return LocalClock(
        clock,
        offset_ns=s_to_ns(offset * parameters.offset_sd_s),
        drift_ppt=round(drift * parameters.drift_sd_ppm * PPT_PER_PPM),
        stamp_error_ns=stamp_error_ns,
    )
