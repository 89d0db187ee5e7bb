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
from netsim.units import s_to_ns

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


class _Down:
    """When nodes were down: of each whether it is, since when, and the last time it was."""

    def __init__(self) -> None:
        self._is: dict[int, tuple[int, str]] = {}
        self._was: dict[int, tuple[int, int, str]] = {}

    def begins(self, node: int, how: str, now_ns: int) -> None:
        """A node goes down, or is down in another way."""
        since_ns, _ = self._is.get(node, (now_ns, how))
        self._is[node] = (since_ns, how)

    def ends(self, node: int, now_ns: int) -> None:
        """It is up, again or still."""
        if node in self._is:
            since_ns, how = self._is.pop(node)
            self._was[node] = (since_ns, now_ns, how)

    def before(self, node: int, now_ns: int) -> str:
        """How a node has been down since before now; empty if it has not."""
        since_ns, how = self._is.get(node, (now_ns, ""))
        return how if since_ns < now_ns else ""

    def within(self, node: int, start_ns: int, end_ns: int) -> str:
        """How a node was down within an interval; empty if it was not. To touch its ends does not count."""
        begun_ns, over_ns, how = self._was.get(node, (end_ns, start_ns, ""))
        return self.before(node, end_ns) or (how if begun_ns < end_ns and over_ns > start_ns else "")


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
        self._radios, self._lives = _Down(), _Down()
        self._begun: defaultdict[int, deque[int]] = defaultdict(deque)
        self._longest_ns = 0
        delay_s = run.medium.get("delay_s", 0.0)
        self._delay_ns = s_to_ns(delay_s) if isinstance(delay_s, int | float) else 0

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._senders, self._listeners, self._states)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {RadioState: self._enter, NodeLife: self._live, Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`. What began less than the longest frame's time ago may be on its way at the end."""
        latest_ns = end.time_ns - self._longest_ns - self._delay_ns
        for node, begun in self._begun.items():
            if begun and begun[0] < latest_ns and end.is_whole:
                self._states.found(f"transmit at {seconds(begun[0])} s, but no such frame", end.time_ns, node)

    def _enter(self, event: RadioState, now_ns: int) -> None:
        if event.state in _DOWN:
            self._radios.begins(event.node, _DOWN[event.state], now_ns)
        else:
            self._radios.ends(event.node, now_ns)
        if self._is_full and event.state == _TRANSMIT:
            self._begun[event.node].append(now_ns)

    def _live(self, event: NodeLife, now_ns: int) -> None:
        if event.event in ("died", "crashed"):
            self._lives.begins(event.node, event.event, now_ns)
        elif event.event == "rebooted":
            self._lives.ends(event.node, now_ns)

    def _look(self, event: Frame, now_ns: int) -> None:
        self._senders.looked += 1
        self._longest_ns = max(self._longest_ns, event.t_end_ns - event.t_start_ns)
        during = (event.source, event.t_start_ns, event.t_end_ns)
        state = self._lives.within(*during) or self._radios.within(*during)
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
                state = self._lives.before(node, now_ns) or self._radios.before(node, now_ns)
                if state:
                    what = f"frame {event.frame_id} was {OUTCOMES[outcome]} while the listener was {_doing(state)}"
                    self._listeners.found(what, now_ns, node)

    def _match(self, event: Frame, now_ns: int) -> None:
        """Find the beginning of a frame among the sender's; those before it must have been recorded by now.

        On the ideal medium a frame that a crash breaks off is recorded at once, before others that are still under way.
        """
        self._states.looked += 1
        begun, start_ns = self._begun[event.source], event.t_start_ns
        if start_ns in begun:
            begun.remove(start_ns)
        else:
            what = f"frame {event.frame_id} began at {seconds(start_ns)} s, its radio not in the state transmit"
            self._states.found(what, now_ns, event.source)
        while begun and begun[0] < start_ns and start_ns + self._delay_ns < now_ns:
            self._states.found(f"transmit at {seconds(begun.popleft())} s, but no such frame", now_ns, event.source)


def _doing(state: str) -> str:
    return {"sleep": "asleep", "idle": "idle", "off": "off", "died": "dead", "crashed": "down"}.get(state, state)


def is_for(frame: Frame, node: int) -> bool:
    """Whether a frame is addressed to a node, or to all."""
    return frame.destination in (node, BROADCAST)
