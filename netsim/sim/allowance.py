"""An energy allowance: counts what a node draws, and tells exactly when it is used up.

The instant is computed, never polled: a guard event is armed for the predicted instant, before everything else of it, and
armed again when the draw has changed.
"""

import math
from collections.abc import Callable
from typing import Final, Protocol

from netsim.sim.clock import Clock

YJ_PER_J: Final = 10**24
YJ_PER_PJ: Final = 10**12


class Draw(Protocol):
    """What is drawn from a battery (see `netsim.sim.energy.Battery`)."""

    @property
    def used_yj(self) -> int:
        """Energy drawn until now."""
        ...

    @property
    def power_fw(self) -> int:
        """Present power."""
        ...

    def follow(self, listener: Callable[[], None]) -> None:
        """Call this whenever the power has changed."""
        ...

    def leave(self, listener: Callable[[], None]) -> None:
        """Call it no more."""
        ...


class Allowance:
    """Counts the draw from now on, and tells the first nanosecond at which it reaches what is allowed.

    Args:
        clock: Simulated time.
        draw: What is counted.
        allowance_j: What is allowed, to the nearest picojoule; None to count only.
        on_short: Called at that nanosecond, once until `restart`.
    """

    def __init__(self, clock: Clock, draw: Draw, allowance_j: float | None, on_short: Callable[[], None]) -> None:
        self._clock = clock
        self._draw = draw
        self._allowance_yj = None if allowance_j is None else round(allowance_j * 1e12) * YJ_PER_PJ
        self._on_short = on_short
        self._base_yj = draw.used_yj
        self._guard_ns: int | None = None
        self._told = False
        self._final_yj: int | None = None
        if self._allowance_yj is not None:
            draw.follow(self._arm)
            self._arm()

    @property
    def spent_yj(self) -> int:
        """What was drawn since the start, or until `end`."""
        return (self._draw.used_yj if self._final_yj is None else self._final_yj) - self._base_yj

    @property
    def spent_j(self) -> float:
        """See `spent_yj`."""
        return self.spent_yj / YJ_PER_J

    @property
    def allowance_j(self) -> float:
        """What is allowed; infinity for a count only."""
        return math.inf if self._allowance_yj is None else self._allowance_yj / YJ_PER_J

    @property
    def left_j(self) -> float:
        """What is left of it; 0 when it is used up."""
        return math.inf if self._allowance_yj is None else max(0, self._allowance_yj - self.spent_yj) / YJ_PER_J

    @property
    def is_short(self) -> bool:
        """Whether it is used up."""
        return self._allowance_yj is not None and self.spent_yj >= self._allowance_yj

    def restart(self) -> None:
        """Begin to count anew."""
        self._base_yj = self._draw.used_yj
        self._told = False
        self._arm()

    def end(self) -> None:
        """Count no further."""
        self._final_yj = self._draw.used_yj
        self._told = True
        if self._allowance_yj is not None:
            self._draw.leave(self._arm)

    def _arm(self) -> None:
        if self._told or self._allowance_yj is None or self._draw.power_fw <= 0:
            return
        delay_ns = max(0, -((self.spent_yj - self._allowance_yj) // self._draw.power_fw))
        at_ns = self._clock.now_ns + delay_ns
        if self._guard_ns is None or at_ns < self._guard_ns:
            self._guard_ns = at_ns
            self._clock.call_first(delay_ns, self._guard_fired)

    def _guard_fired(self, _: object) -> None:
        if self._guard_ns != self._clock.now_ns:
            return  # a later guard was replaced by an earlier one
        self._guard_ns = None
        if self.is_short and not self._told:
            self._told = True
            self._on_short()
        else:
            self._arm()
