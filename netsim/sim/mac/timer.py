"""What MACs time things by: a timer that holds one action at a time, and a node's own view of time."""

from collections.abc import Callable
from typing import Protocol

from netsim.sim.clock import Clock


class Timer:
    """One pending action; a new one overtakes it.

    Args:
        clock: Simulated time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._step = 0  # counts what was asked for, so that an overtaken action knows it

    def after(self, delay_ns: int, action: Callable[[], None], last: bool = False) -> None:
        """Call `action` in `delay_ns`, and nothing that was asked for before.

        Args:
            delay_ns: When.
            action: What.
            last: After everything else of that instant: for a decision that must know all that happens at it, such as a
                frame that ends.
        """
        self._step += 1
        step = self._step
        call = self._clock.call_last if last else self._clock.call_after
        call(delay_ns, lambda _: action() if self._step == step else None)

    def cancel(self) -> None:
        """Forget what was asked for."""
        self._step += 1


class LocalTime(Protocol):
    """A node's own clock, which may be ahead or behind and run fast or slow."""

    def local_ns(self) -> int:
        """What the node's clock shows now."""
        ...

    def delay_until(self, local_ns: int) -> int:
        """In how many true nanoseconds the node's clock will show `local_ns`; 0 if it has shown it already."""
        ...


class TrueTime:
    """A clock that is right.

    Args:
        clock: Simulated time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def local_ns(self) -> int:
        """See `LocalTime.local_ns`."""
        return self._clock.now_ns

    def delay_until(self, local_ns: int) -> int:
        """See `LocalTime.delay_until`."""
        return max(0, local_ns - self._clock.now_ns)
