"""The duty cycle of a node: its radio listens for a part of each period, by the node's own clock."""

from typing import Literal

from netsim.parameters import Positive, parameters
from netsim.sim.clock import Clock
from netsim.sim.local_clock import LocalClock
from netsim.sim.radio_switch import RadioSwitch
from netsim.units import s_to_ns


@parameters
class DutyCycleParameters:
    """The radio listens at the beginning of each period and sleeps for the rest, under whatever MAC.

    What is to be sent wakes it for as long as that takes; whether its receiver is awake is not known to the sender. An
    algorithm's `radio_wake` and `radio_sleep` hold until the cycle's next change. The first listening time needs no wake-up.
    """

    period_s: Positive
    """From one listening time to the next."""
    on_s: Positive
    """How long it listens, the radio's start-up included."""
    phase: Literal["random", "aligned"] = "random"
    """`random`: every node's periods begin at a moment of its own; `aligned`: whenever its clock shows a multiple of the
    period, which is at the same time everywhere as far as the clocks agree."""

    def __post_init__(self) -> None:
        """It must sleep at all."""
        if self.on_s >= self.period_s:
            message = "on_s below period_s"
            raise ValueError(message)


class DutyCycle:
    """See `DutyCycleParameters`.

    Args:
        clock: Simulated time.
        local: The node's clock.
        switch: Its radio's.
        parameters: Period and listening time.
        phase: Where the periods begin, as a share of the period, in [0, 1).
    """

    def __init__(
        self, clock: Clock, local: LocalClock, switch: RadioSwitch, parameters: DutyCycleParameters, phase: float
    ) -> None:
        self._local = local
        self._switch = switch
        self._period_ns = s_to_ns(parameters.period_s)
        self._on_ns = s_to_ns(parameters.on_s)
        self._phase_ns = int(phase * self._period_ns)
        self._clock = clock
        self._turn = self._present_turn
        switch.on_restart = self._resume
        clock.call_last(0, lambda _: self._resume())
        self._await_sleep()

    def _resume(self) -> None:
        """Sleep if the cycle does so at present: at the start, and after a crash."""
        begin_ns = self._phase_ns + self._present_turn * self._period_ns
        if self._local.now_ns >= begin_ns + self._on_ns:
            self._switch.sleep()

    # What a node does at an edge finds its radio awake: it wakes before everything else, and sleeps after it.

    def _await_wake(self) -> None:
        self._local.call_at(self._phase_ns + self._turn * self._period_ns, self._clock.call_first, self._wake)

    def _await_sleep(self) -> None:
        if self._local.now_ns >= self._end_ns:
            self._go_on()
        else:
            self._local.call_at(self._end_ns, self._clock.call_last, self._sleep)

    def _wake(self) -> None:
        if self._local.now_ns < self._end_ns:  # unless the clock was set forward beyond it
            self._switch.wake()
        self._await_sleep()

    def _sleep(self) -> None:
        self._switch.sleep()
        self._go_on()

    def _go_on(self) -> None:
        """To the next period; if the clock was set forward, some are left out."""
        self._turn = max(self._turn + 1, self._present_turn)
        self._await_wake()

    @property
    def _end_ns(self) -> int:
        return self._phase_ns + self._turn * self._period_ns + self._on_ns

    @property
    def _present_turn(self) -> int:
        return (self._local.now_ns - self._phase_ns) // self._period_ns
