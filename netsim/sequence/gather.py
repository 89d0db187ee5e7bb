"""Reading a window of a trace into what a sequence chart shows."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.metrics.causes import Causes
from netsim.sequence.aim import Aim
from netsim.sequence.powers import radio_powers_w
from netsim.sequence.records import Change, Exchange, Noted, Transmission
from netsim.sequence.trains import joined, numbered
from netsim.trace.events import (
    RADIO_STATES,
    AlgorithmRecord,
    Event,
    Frame,
    GraphMessages,
    LinkTable,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    NodePositions,
    NodeTable,
    RadioState,
    Role,
    VariablePlacement,
)
from netsim.trace.reader import last_time_ns, read_trace, trace_metadata
from netsim.units import NS_PER_S, NS_PER_US

FRAME_LIMIT = 3000
"""Frames in a chart, if nothing else is asked for: about what a browser draws without delay."""
_STANDING = (NodeTable, LinkTable, NodePositions, VariablePlacement, NodeLife, RadioState, Role)
_BEFORE = {each.topic for each in (*_STANDING, MessageSent)}
_INSIDE = _BEFORE | {each.topic for each in (Frame, GraphMessages, AlgorithmRecord, MessageDelivered, MessageDropped)}


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What to show of a trace.

    Attributes:
        start_ns: From here on.
        end_ns: Before this; None for up to the end.
        nodes: Frames from and to these nodes only; None for all.
        kinds: Messages of these kinds only; None for all.
        limit: With more frames than this the chart is refused.
        time: `nonlinear`, `linear` or `events` (see `netsim.sequence.scale`).
    """

    start_ns: int = 0
    end_ns: int | None = None
    nodes: Collection[int] | None = None
    kinds: Collection[str] | None = None
    limit: int = FRAME_LIMIT
    time: str = "nonlinear"


def gather(trace: Path, asked: Asked) -> Exchange:
    """The exchange of frames that end in a window.

    Kinds are coloured in the order in which they are first met from the start of the trace on, whatever the window, so
    that charts of one run agree.

    Raises:
        ScenarioError: If the window or the kinds are none of the trace's, nothing was sent there, or too much.
        TraceError: If the trace cannot be read.
    """
    end_ns = _end_ns(trace, asked)
    reader = _Reader(trace, asked, end_ns)
    for time_ns, event in read_trace(trace, _BEFORE, 0, asked.start_ns):
        reader.take_early(time_ns, event)
    for time_ns, event in read_trace(trace, _INSIDE, asked.start_ns, end_ns):
        reader.take_early(time_ns, event)
        reader.take(time_ns, event)
    return reader.result()


def _end_ns(trace: Path, asked: Asked) -> int:
    last_ns = last_time_ns(trace)
    if asked.start_ns > last_ns:
        message = f"--start: expected a time up to {_s(last_ns)} s, where the trace ends, got {_s(asked.start_ns)} s"
        raise ScenarioError(message)
    if asked.end_ns is not None and asked.end_ns <= asked.start_ns:
        message = f"--end: expected a time after --start ({_s(asked.start_ns)} s), got {_s(asked.end_ns)} s"
        raise ScenarioError(message)
    return last_ns + 1 if asked.end_ns is None else min(last_ns + 1, asked.end_ns)


class _Reader:
    """Takes the events of a trace, in order."""

    def __init__(self, trace: Path, asked: Asked, end_ns: int) -> None:
        self._trace = trace
        self._asked = asked
        title = trace_metadata(trace).get("scenario", trace.stem)
        self._exchange = Exchange(title, asked.start_ns, end_ns)
        self._told = Causes()
        self._aim = Aim(asked.nodes, radio_powers_w(trace))
        self._kinds: dict[str, None] = {}
        self._found: list[Transmission] = []
        self._frames = 0
        self._limit_ns: int | None = None

    def take_early(self, time_ns: int, event: Event) -> None:
        """What holds from its instant on, and what gives kinds their order."""
        match event:
            case NodeTable():
                self._exchange.names = dict(zip(map(int, event.node), event.name, strict=True))
            case LinkTable() | NodePositions():
                self._aim.learn(event)
            case VariablePlacement():
                self._told.handlers()[VariablePlacement](event, time_ns)
            case RadioState():
                self._take_state(Change(time_ns, event.node, RADIO_STATES[event.state]))
            case Role():
                self._exchange.roles.append(Noted(time_ns, event))
            case NodeLife():
                self._exchange.lives.append(Noted(time_ns, event))
            case MessageSent() | Frame():
                self._kinds.setdefault(event.kind)
            case _:
                pass

    def take(self, time_ns: int, event: Event) -> None:
        """What happened in the window."""
        if isinstance(event, MessageSent | MessageDelivered | GraphMessages):
            self._told.handlers()[type(event)](event, time_ns)
        match event:
            case Frame():
                self._take_frame(event)
            case MessageDelivered():
                there = self._exchange.delivered.setdefault(event.message_id, {})
                there.setdefault(event.node, Noted(time_ns, event))
            case MessageDropped():
                if self._is_wanted(event.kind) and self._is_among({event.node, event.source, event.destination}):
                    self._exchange.dropped.append(Noted(time_ns, event))
            case GraphMessages():
                self._exchange.rounds.append(Noted(time_ns, event))
            case AlgorithmRecord():
                self._exchange.notes.append(Noted(time_ns, event))
            case _:
                pass

    def _take_state(self, change: Change) -> None:
        """Of what was before the window only the last counts."""
        known = self._exchange.radio.setdefault(change.node, [])
        if known and change.time_ns < self._asked.start_ns:
            known.clear()
        known.append(change)

    def _is_wanted(self, kind: str) -> bool:
        return self._asked.kinds is None or kind in self._asked.kinds

    def _is_among(self, nodes: set[int]) -> bool:
        return self._asked.nodes is None or not nodes.isdisjoint(self._asked.nodes)

    def _take_frame(self, frame: Frame) -> None:
        found = self._aim.transmission(frame) if self._is_wanted(frame.kind) else None
        if found is None:
            return
        self._frames += 1
        if self._frames <= self._asked.limit:
            self._found.append(found)
        elif self._limit_ns is None:
            self._limit_ns = frame.t_end_ns

    def result(self) -> Exchange:
        """All of it."""
        if self._limit_ns is not None:
            raise ScenarioError(self._too_many(self._limit_ns))
        if not self._found:
            raise ScenarioError(self._nothing())
        exchange = self._exchange
        exchange.kinds = [kind for kind in self._kinds if kind]
        exchange.sendings = self._told.sendings
        exchange.transmissions = list(numbered(joined(self._found), exchange.sendings))
        _listen_when_awake(exchange)
        return exchange

    def _too_many(self, limit_ns: int) -> str:
        asked, exchange = self._asked, self._exchange
        return (
            f"--sequence: expected at most {asked.limit:,} frames in a chart, got {self._frames:,} from "
            f"{_s(asked.start_ns)} to {_s(exchange.end_ns)} s; narrow the window (--end {_s(limit_ns)} would do), choose "
            "--nodes or --kinds, or raise --limit"
        )

    def _nothing(self) -> str:
        asked, exchange = self._asked, self._exchange
        of = "".join(_filters(asked))
        window = f"from {_s(asked.start_ns)} to {_s(exchange.end_ns)} s"
        unknown = sorted(set(asked.kinds or ()) - set(self._kinds))
        if unknown:
            known = ", ".join(kind for kind in self._kinds if kind) or "none"
            return f"--kinds: expected some of {known}, sent up to {_s(exchange.end_ns)} s; got {', '.join(unknown)}"
        next_ns = self._next_ns()
        is_all = not of and asked.start_ns == 0
        hint = (
            ("the run sent no frames" if is_all else "choose another --start")
            if next_ns is None
            else f"the next frame ends at {_s(next_ns)} s: choose a later --end"
        )
        return f"--sequence: nothing{of} was on the air {window}; {hint}"

    def _next_ns(self) -> int | None:
        """When the first frame after the window ends that is asked for."""
        for time_ns, event in read_trace(self._trace, {Frame.topic}, self._exchange.end_ns):
            if isinstance(event, Frame) and self._is_wanted(event.kind) and self._aim.transmission(event) is not None:
                return time_ns
        return None


def _listen_when_awake(exchange: Exchange) -> None:
    """Traces that tell no receptions tell of waking up only that it begins: from then on the radio listens."""
    if any(change.state in ("receive", "transmit") for changes in exchange.radio.values() for change in changes):
        return
    for node, changes in exchange.radio.items():
        exchange.radio[node] = [replace(each, state="listen") if each.state == "switch" else each for each in changes]


def _filters(asked: Asked) -> Iterator[str]:
    if asked.kinds is not None:
        yield f" of kind {', '.join(sorted(asked.kinds))}"
    if asked.nodes is not None:
        yield " from or to the nodes asked for"


def _s(time_ns: int) -> str:
    """An instant, cut off after the microseconds: frames that end there are not before it."""
    return f"{time_ns // NS_PER_US / (NS_PER_S // NS_PER_US):.6f}".rstrip("0").rstrip(".")
