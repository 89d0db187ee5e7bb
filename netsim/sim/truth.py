"""The truth as it goes on: events that come from no node, such as where targets are."""

from collections.abc import Iterable

from netsim.sim.clock import Clock
from netsim.trace.events import Event
from netsim.trace.recorder import Recorder


class Truth:
    """Records what the problem says happens, each at its time, before everything else that happens then.

    Args:
        clock: Simulated time, at 0.
        recorder: Where the events go.
        events: With their times in ns, ascending.
    """

    def __init__(self, clock: Clock, recorder: Recorder, events: Iterable[tuple[int, Event]]) -> None:
        self._clock = clock
        self._recorder = recorder
        self._events = iter(events)
        self._await_next()

    def _await_next(self) -> None:
        following = next(self._events, None)
        if following is not None:
            time_ns, event = following
            self._clock.call_first(time_ns - self._clock.now_ns, lambda _: self._tell(event))

    def _tell(self, event: Event) -> None:
        self._recorder.record(event)
        self._await_next()
