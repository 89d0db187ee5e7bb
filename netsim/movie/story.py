"""A trace read once from front to back: what each picture shows, the messages in the air, messages per second."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from netsim.movie.cast import Cast, Ints
from netsim.movie.options import Reel
from netsim.movie.state import Moment, State
from netsim.replay.flights import NO_FLIGHTS, Air, Flights, Rows
from netsim.replay.flying import Audience, Frames, good_links
from netsim.replay.options import ReplayOptions
from netsim.trace.events import Event, Frame, MessageSent
from netsim.trace.reader import read_trace

_BLOCK = 4096  # frames that become flights at once
_LEAD_NS = 1_000_000_000  # frames are recorded at their end, so those of the first picture may be older than the window
_LOOK_EVERY = 512

Progress = Callable[[str, float, float], None]
"""Called now and then with what is being done, how far it is, and how far it goes."""


@dataclass(frozen=True)
class Story:
    """What a movie tells.

    Attributes:
        reel: Which instants it shows.
        moments: What each picture shows, messages aside.
        flights: All flights, in the order in which they start.
        kinds: Message kinds in the order in which they were met.
        places: Of each of these, its place in the order of colours: that in which messages of them were first sent in the
            run, as in a replay.
        rates: Messages per second of each kind in each bar of `reel.bin_ns`; shape (kinds, bars).
        has_strobes: Whether there are wake-up frames.
    """

    reel: Reel
    moments: list[Moment]
    flights: Flights
    kinds: list[str]
    places: list[int]
    rates: NDArray[np.float64]
    has_strobes: bool

    def air(self, picture: int) -> Iterator[Rows]:
        """What is in the air in a picture, layer by layer."""
        reel = self.reel
        at_ns = picture * reel.step_ns
        started = self.flights.start_ns - reel.start_ns
        low, high = np.searchsorted(started, [at_ns - reel.hold_ns, at_ns], side="right")
        window = self.flights.pick(np.arange(low, high))
        shifted = Flights(started[low:high], *window.columns()[1:])
        for rows in Air(at_ns, reel.step_ns, reel.hold_ns).advance(shifted, at_ns + reel.step_ns):
            starts = rows.flights.start_ns + reel.start_ns
            yield Rows(rows.layer, rows.time_ns, rows.lengths, Flights(starts, *rows.flights.columns()[1:]), rows.reach)


def read_story(
    trace: Path, cast: Cast, reel: Reel, options: ReplayOptions, progress: Progress = lambda what, done, total: None
) -> Story:
    """Read a trace.

    Args:
        trace: The trace.
        cast: Who takes part in it.
        reel: Which instants to show.
        options: Message kinds and nodes to show.
        progress: Told how far it is.

    Raises:
        TraceError: If the trace cannot be read or is damaged.
    """
    state, traffic = State(cast), _Traffic(cast, reel, options)
    times_ns = reel.times_ns.tolist()
    moments: list[Moment] = []
    for count, (time_ns, event) in enumerate(_events(trace, reel, state.topics)):
        while len(moments) < reel.count and times_ns[len(moments)] < time_ns:
            moments.append(state.moment(times_ns[len(moments)]))
        state.take(time_ns, event)
        traffic.take(time_ns, event)
        if count % _LOOK_EVERY == 0:
            progress("reading", max(0, time_ns - reel.start_ns) / 1e9, (reel.end_ns - reel.start_ns) / 1e9)
    moments += [state.moment(time_ns) for time_ns in times_ns[len(moments) :]]
    flights = traffic.flights()
    return Story(reel, moments, flights, traffic.kinds, traffic.places, traffic.rates(), traffic.has_strobes)


def _events(trace: Path, reel: Reel, lasting: set[str]) -> Iterator[tuple[int, Event]]:
    """What still holds from before the window, and what happens in it; of frames those that end after it too.

    Messages from before the window give kinds their colours.
    """
    lead_ns = max(0, reel.start_ns - reel.hold_ns - _LEAD_NS)
    before = read_trace(trace, {*lasting, MessageSent.topic}, 0, lead_ns) if lead_ns else iter(())
    topics = {*lasting, Frame.topic, MessageSent.topic}
    window = read_trace(trace, topics, lead_ns, reel.end_ns)
    after = read_trace(trace, {Frame.topic}, reel.end_ns, reel.end_ns + _LEAD_NS)
    return chain(before, window, after)


@dataclass
class _Block:
    """Frames not yet turned into flights."""

    frames: list[Frame] = field(default_factory=list)
    kinds: list[int] = field(default_factory=list)

    def columns(self) -> Frames:
        def ints(name: str) -> Ints:
            return np.array([getattr(frame, name) for frame in self.frames], np.int64)

        def flat(name: str) -> Ints:
            return np.concatenate([np.asarray(getattr(frame, name), np.int64) for frame in self.frames])

        return Frames(
            start_ns=ints("t_start_ns"),
            source=ints("source"),
            destination=ints("destination"),
            kind=np.array(self.kinds, np.int64),
            carries_nothing=(ints("is_ack") | ints("is_strobe")) != 0,
            lengths=np.array([len(frame.rx_node) for frame in self.frames], np.int64),
            listener=flat("rx_node"),
            outcome=flat("rx_outcome"),
        )


class _Traffic:
    """Frames as flights, and messages counted."""

    def __init__(self, cast: Cast, reel: Reel, options: ReplayOptions) -> None:
        self._cast = cast
        self._reel = reel
        self._wanted = options.kinds
        ids = np.asarray(cast.nodes.node)
        self._shown = np.ones(len(ids), bool) if options.nodes is None else np.isin(ids, list(options.nodes))
        self._audience = Audience(cast.rows, self._shown, good_links(cast.links, cast.rows, cast.motion))
        self._block = _Block()
        self._parts: list[Flights] = []
        self._counts: dict[tuple[int, int], int] = {}
        self._places: dict[str, int] = {}
        self.kinds: list[str] = []
        self.has_strobes = False

    @property
    def places(self) -> list[int]:
        return [self._places[kind] for kind in self.kinds]

    def take(self, time_ns: int, event: Event) -> None:
        if isinstance(event, MessageSent):
            self._places.setdefault(event.kind, len(self._places))
        if isinstance(event, Frame):
            self._take_frame(event)
        elif isinstance(event, MessageSent) and self._reel.start_ns <= time_ns <= self._reel.end_ns:
            row, kind = self._cast.row(event.source), self._kind(event.kind)
            if kind >= 0 and row >= 0 and self._shown[row]:
                key = kind, min((time_ns - self._reel.start_ns) // self._reel.bin_ns, self._bars - 1)
                self._counts[key] = self._counts.get(key, 0) + 1

    def _take_frame(self, frame: Frame) -> None:
        if frame.t_start_ns + self._reel.hold_ns <= self._reel.start_ns or frame.t_start_ns > self._reel.end_ns:
            return
        self.has_strobes |= bool(frame.is_strobe)
        self._block.frames.append(frame)
        self._block.kinds.append(self._kind(frame.kind))
        if len(self._block.frames) == _BLOCK:
            self._flush()

    def _kind(self, kind: str) -> int:
        self._places.setdefault(kind, len(self._places))
        if self._wanted is not None and kind not in self._wanted:
            return -1
        if kind not in self.kinds:
            self.kinds.append(kind)
        return self.kinds.index(kind)

    def _flush(self) -> None:
        if self._block.frames:
            self._parts.append(self._audience.flights(self._block.columns()))
            self._block = _Block()

    def flights(self) -> Flights:
        self._flush()
        parts = zip(*(part.columns() for part in [NO_FLIGHTS, *self._parts]), strict=True)
        together = Flights(*(np.concatenate(column) for column in parts))
        return together.pick(np.argsort(together.start_ns, kind="stable"))

    @property
    def _bars(self) -> int:
        return max(1, -(-(self._reel.end_ns - self._reel.start_ns) // self._reel.bin_ns))

    def rates(self) -> NDArray[np.float64]:
        table = np.zeros((len(self.kinds), self._bars))
        for (kind, slot), count in self._counts.items():
            table[kind, slot] = count / (self._reel.bin_ns / 1e9)
        return table
