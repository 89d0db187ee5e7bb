"""From events to whoever observes them: the trace writer, the metrics, a live view.

An event that nobody observes need not be built: ask `Recorder.wants` first where building one costs.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from netsim.trace.events import Event

Handler = Callable[[Any, int], None]
"""Called with an event and the simulated time in nanoseconds."""


class Observer(Protocol):
    """Something that follows a run through its events."""

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What to call for each kind of event it observes."""
        ...


class Recorder:
    """Hands each event, at the instant it is recorded, to the observers of its kind, in the order they were given."""

    def __init__(self, now_ns: Callable[[], int], observers: Iterable[Observer]) -> None:
        self._now_ns = now_ns
        handlers: defaultdict[type[Event], list[Handler]] = defaultdict(list)
        for observer in observers:
            for event_type, handler in observer.handlers().items():
                handlers[event_type].append(handler)
        self._handlers = dict(handlers)

    def wants(self, event_type: type[Event]) -> bool:
        """Whether anybody observes this kind of event."""
        return event_type in self._handlers

    def record(self, event: Event) -> None:
        """Record an event as happening now."""
        handlers = self._handlers.get(type(event))
        if handlers is not None:
            now_ns = self._now_ns()
            for handler in handlers:
                handler(event, now_ns)

    def close(self) -> None:
        """The run is over: whatever is still said, as by processes that are cleaned up, is not part of it."""
        self._handlers = {}
