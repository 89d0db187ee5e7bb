"""The air: every frame has its time; its sender is awake and sends nothing else meanwhile, and who decodes it is awake."""

from collections import defaultdict, deque
from collections.abc import Mapping, Sequence

from netsim.audit.columns import plain
from netsim.audit.rule import End, Run
from netsim.audit.tally import Tally, seconds
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    OUTCOMES,
    RADIO_STATE_CODE,
    Event,
    Frame,
    NodeLife,
    RadioState,
)
from netsim.trace.recorder import Handler

_RECEIVED, _OVERHEARD = OUTCOME_CODE["received"], OUTCOME_CODE["overheard"]
_DECODED = (_RECEIVED, _OVERHEARD)
_DOWN = {RADIO_STATE_CODE[name]: name for name in ("sleep", "idle", "off", "dead")}
_TRANSMIT = RADIO_STATE_CODE["transmit"]


class FrameTimes:
    """Frames are numbered once, take time, and are recorded at their end or after it; one sender's never overlap.

    It keeps the numbers that are not yet used below the greatest one (of what is on the air), and each sender's last frame.
    """

    def __init__(self) -> None:
        self._times = Tally("frames have their time", "frames")
        self._overlaps = Tally("one frame at a time", "frames")
        self._greatest = 0
        self._open: set[int] = set()
        self._last: dict[int, tuple[int, int]] = {}

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._times, self._overlaps)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _look(self, event: Frame, now_ns: int) -> None:
        start_ns, end_ns, source = event.t_start_ns, event.t_end_ns, event.source
        self._times.looked += 1
        self._overlaps.looked += 1
        self._number(event.frame_id, now_ns, source)
        if not 0 <= start_ns <= end_ns <= now_ns:
            what = f"frame {event.frame_id}: from {seconds(start_ns)} s to {seconds(end_ns)} s, recorded before its end"
            self._times.found(
                what if start_ns <= end_ns else f"frame {event.frame_id} ends before it begins", now_ns, source
            )
        begun_ns, over_ns = self._last.get(source, (-1, -1))
        if start_ns < over_ns and end_ns > begun_ns:
            what = (
                f"frame {event.frame_id} began at {seconds(start_ns)} s, while another lasted to {seconds(over_ns)} s"
            )
            self._overlaps.found(what, now_ns, source)
        if end_ns >= over_ns:
            self._last[source] = (start_ns, end_ns)

    def _number(self, number: int, now_ns: int, source: int) -> None:
        if number > self._greatest:
            self._open.update(range(self._greatest + 1, number))
            self._greatest = number
        elif number in self._open:
            self._open.remove(number)
        else:
            self._times.found(f"a second frame {number}", now_ns, source)


class AwakeNodes:
    """Nobody sends or decodes while its radio sleeps, is off or dead; at detail `full`, a sender's radio says `transmit`.

    It keeps each node's present state, its last time asleep or down, and beginnings of transmissions not yet recorded.
    """

    def __init__(self, run: Run) -> None:
        self._senders = Tally("senders are awake", "frames")
        self._listeners = Tally("listeners are awake", "frames decoded")
        self._states = Tally("radios transmit their frames", "transmissions")
        self._is_full = run.detail == "full"
        if not self._is_full:
            self._states.note = f"needs the detail full, this is {run.detail}"
        self._down: dict[int, tuple[int, str]] = {}
        self._was_down: dict[int, tuple[int, int, str]] = {}
        self._begun: defaultdict[int, deque[int]] = defaultdict(deque)

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._senders, self._listeners, self._states)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {RadioState: self._enter, NodeLife: self._live, Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`. One transmission a node may be on its way at the end."""
        for node, begun in self._begun.items():
            if len(begun) > 1 and end.is_whole:
                self._states.found(f"transmit at {seconds(begun[0])} s, but no such frame", end.time_ns, node)

    def _enter(self, event: RadioState, now_ns: int) -> None:
        if event.state in _DOWN:
            self._fall(event.node, _DOWN[event.state], now_ns)
        elif event.node in self._down:
            since_ns, state = self._down.pop(event.node)
            self._was_down[event.node] = (since_ns, now_ns, state)
        if self._is_full and event.state == _TRANSMIT:
            self._begun[event.node].append(now_ns)

    def _live(self, event: NodeLife, now_ns: int) -> None:
        if event.event in ("died", "crashed"):
            self._fall(event.node, event.event, now_ns)
        elif event.event == "rebooted" and event.node in self._down:
            since_ns, state = self._down.pop(event.node)
            self._was_down[event.node] = (since_ns, now_ns, state)

    def _fall(self, node: int, state: str, now_ns: int) -> None:
        since_ns, before = self._down.get(node, (now_ns, state))
        self._down[node] = (since_ns, before if state in _DOWN.values() else state)

    def _look(self, event: Frame, now_ns: int) -> None:
        self._senders.looked += 1
        state = self._down_in(event.source, event.t_start_ns, event.t_end_ns)
        if state:
            self._senders.found(
                f"frame {event.frame_id} went out while its sender was {_doing(state)}", now_ns, event.source
            )
        self._look_at_listeners(event, now_ns)
        if self._is_full:
            self._match(event, now_ns)

    def _look_at_listeners(self, event: Frame, now_ns: int) -> None:
        for node, outcome in zip(plain(event.rx_node), plain(event.rx_outcome), strict=False):
            if outcome in _DECODED:
                self._listeners.looked += 1
                down = self._down.get(node)
                if down is not None and down[0] < now_ns:
                    what = f"frame {event.frame_id} was {OUTCOMES[outcome]} while the listener was {_doing(down[1])}"
                    self._listeners.found(what, now_ns, node)

    def _down_in(self, node: int, start_ns: int, end_ns: int) -> str:
        """How a node was down within an interval; empty if it was not. Touching its ends does not count."""
        since_ns, state = self._down.get(node, (end_ns, ""))
        if since_ns < end_ns:
            return state
        begun_ns, over_ns, state = self._was_down.get(node, (end_ns, start_ns, ""))
        return state if begun_ns < end_ns and over_ns > start_ns else ""

    def _match(self, event: Frame, now_ns: int) -> None:
        self._states.looked += 1
        begun = self._begun[event.source]
        while begun and begun[0] < event.t_start_ns:
            self._states.found(f"transmit at {seconds(begun.popleft())} s, but no such frame", now_ns, event.source)
        if begun and begun[0] == event.t_start_ns:
            begun.popleft()
        else:
            what = f"frame {event.frame_id} began at {seconds(event.t_start_ns)} s, its radio not in the state transmit"
            self._states.found(what, now_ns, event.source)


def _doing(state: str) -> str:
    return {"sleep": "asleep", "idle": "idle", "off": "off", "died": "dead", "crashed": "down"}.get(state, state)


def is_for(frame: Frame, node: int) -> bool:
    """Whether a frame is addressed to a node, or to all."""
    return frame.destination in (node, BROADCAST)
