"""The receiving half of low-power listening: sleep, sample the channel, stay awake if something is on it."""

from collections.abc import Callable

from netsim.sim.clock import Clock
from netsim.sim.mac.lpl_timing import LplTiming
from netsim.sim.mac.timer import Timer
from netsim.sim.radio import Radio

REST, SAMPLE, HOLD = "rest", "sample", "hold"


class Sampler:
    """Checks the channel at fixed intervals; tells when the radio may rest.

    A check wakes the radio and takes samples until one finds the channel busy or all are taken; between them the radio is
    idle. It is left out while the radio is on anyway. After a busy sample, or when its owner says that something came
    (`hold`), it keeps the radio listening, and on as long as the channel stays busy, at most one interval.

    Args:
        clock: Simulated time.
        radio: The node's radio.
        timing: Times.
        samples: Samples of a check.
        busy: Whether anything was on the channel within the last so many nanoseconds.
        on_rest: Called when the radio is needed no longer.
    """

    def __init__(
        self,
        clock: Clock,
        radio: Radio,
        timing: LplTiming,
        samples: int,
        busy: Callable[[int], bool],
        on_rest: Callable[[], None],
    ) -> None:
        self._clock = clock
        self._radio = radio
        self._timing = timing
        self._samples = samples
        self._busy = busy
        self._on_rest = on_rest
        self._checks = Timer(clock)
        self._timer = Timer(clock)
        self._state = REST
        self._taken = 0
        self._hold_until_ns = 0
        self._heard_nothing_yet = False
        self.is_paused = False

    @property
    def may_rest(self) -> bool:
        """Whether it needs the radio no longer."""
        return self._state == REST

    def start(self, phase_ns: int) -> None:
        """Check the channel in `phase_ns` and at every interval after it."""
        self.is_paused = False
        self._checks.after(phase_ns, self._check)

    def stop(self) -> None:
        """Check no more."""
        self._checks.cancel()
        self._let_go()

    def release(self) -> None:
        """Give up what it keeps the radio for; between two samples nobody else would put it to sleep."""
        is_between = self._state == SAMPLE and self._radio.state == "idle"
        self._let_go()
        if is_between:
            self._radio.sleep()

    def ready(self) -> bool:
        """The radio is on; returns whether it was for a sample."""
        if self._state != SAMPLE:
            return False
        self._timer.after(self._timing.sample_ns, self._judge, last=True)
        return True

    def yield_radio(self) -> None:
        """The node is about to send: a check under way is left out."""
        if self._state == SAMPLE:
            self._let_go()

    def hold(self) -> None:
        """Something came: more may follow."""
        if not self.is_paused:
            self._hold(heard_nothing_yet=False)

    def dismiss(self) -> None:
        """What woke this node is for another: sleep on."""
        if self._state == SAMPLE or (self._state == HOLD and self._heard_nothing_yet):
            self._let_rest()

    def _check(self) -> None:
        self._checks.after(self._timing.interval_ns, self._check)
        if self._state == REST and self._radio.state == "sleep" and not self.is_paused:
            self._state = SAMPLE
            self._taken = 0
            self._radio.wake()

    def _judge(self) -> None:
        self._taken += 1
        if self._busy(self._timing.sample_ns):
            self._hold(heard_nothing_yet=True)
        elif self._taken == self._samples:
            self._let_rest()
        else:
            self._wait_for_next()

    def _wait_for_next(self) -> None:
        """Idle until the next sample, or listen on if that is too soon."""
        between_ns, start_up_ns = self._timing.between_ns, self._radio.device.idle_wake_ns
        if between_ns > start_up_ns:
            self._radio.idle()
            self._timer.after(between_ns - start_up_ns, self._radio.wake)
        else:
            self._timer.after(between_ns + self._timing.sample_ns, self._judge, last=True)

    def _hold(self, heard_nothing_yet: bool) -> None:
        self._state = HOLD
        self._heard_nothing_yet = heard_nothing_yet
        self._hold_until_ns = self._clock.now_ns + self._timing.interval_ns
        self._timer.after(self._timing.listen_ns, self._expire, last=True)

    def _expire(self) -> None:
        """Nothing came for a while: rest, unless the channel is still busy."""
        if self._clock.now_ns < self._hold_until_ns and self._busy(self._timing.clear_ns):
            self._timer.after(self._timing.listen_ns, self._expire, last=True)
        else:
            self._let_rest()

    def _let_rest(self) -> None:
        self._let_go()
        self._on_rest()

    def _let_go(self) -> None:
        self._timer.cancel()
        self._state = REST
