"""Simulated time: the one place where SimPy's event queue is used.

Time is an integer number of nanoseconds. SimPy keeps integers as long as every delay is one.
"""

from collections.abc import Callable, Generator
from typing import Any

import simpy
from simpy.events import Event as SimEvent
from simpy.events import EventPriority

Action = Callable[[Any], None]
"""A callback; its one argument is to be ignored."""


END, FIRST, SETTLED, LAST = -1, 0, 2, 3
"""Ranks among the events of one instant; ordinary events have rank 1 (`simpy.events.NORMAL`)."""


class _Ranked(SimEvent):
    """An event that happens by itself after a delay, with a rank among those of its instant."""

    def __init__(self, environment: simpy.Environment, rank: int, delay_ns: int, action: Action) -> None:
        super().__init__(environment)
        self._ok = True
        self._value = None
        self.callbacks.append(action)
        environment.schedule(self, EventPriority(rank), delay_ns)


class Clock:
    """The simulation's time and its queue of things to come.

    Args:
        environment: A SimPy environment that starts at an integer time; a new one at 0 by default.
    """

    def __init__(self, environment: simpy.Environment | None = None) -> None:
        self.environment = environment or simpy.Environment(initial_time=0)

    @property
    def now_ns(self) -> int:
        """Time since the start of the run."""
        return self.environment.now  # type: ignore[return-value]

    def call_after(self, delay_ns: int, action: Action) -> None:
        """Call `action` in `delay_ns`. It cannot be cancelled: the action looks whether it is still wanted."""
        self.environment.timeout(delay_ns).callbacks.append(action)

    def call_first(self, delay_ns: int, action: Action) -> None:
        """As `call_after`, before everything else of that instant (that was not asked for within it)."""
        _Ranked(self.environment, FIRST, delay_ns, action)

    def call_settled(self, delay_ns: int, action: Action) -> None:
        """As `call_after`, after all ordinary events of that instant and before the last.

        Then all that is simultaneous is known, and can be put in an order that does not depend on who came first.
        """
        _Ranked(self.environment, SETTLED, delay_ns, action)

    def run_out(self, time_ns: int) -> None:
        """Let time pass to the end of a run, at which nothing happens any more; nothing must be due earlier."""
        _Ranked(self.environment, END, time_ns - self.now_ns, lambda _: None)
        self.environment.step()

    def call_last(self, delay_ns: int, action: Action) -> None:
        """As `call_after`, after everything else of that instant, and after what that leads to at once."""
        _Ranked(self.environment, LAST, delay_ns, action)

    def timeout(self, delay_ns: int) -> SimEvent:
        """An event that happens in `delay_ns`; for a process to wait on."""
        return self.environment.timeout(delay_ns)

    def event(self) -> SimEvent:
        """An event that happens when somebody makes it succeed."""
        return self.environment.event()

    def process(self, generator: Generator[Any, Any, Any]) -> simpy.Process:
        """Start a process."""
        return self.environment.process(generator)
