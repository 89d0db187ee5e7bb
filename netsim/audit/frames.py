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
_MOST_SKIPPED = 1_000_000
"""Numbers that may be open at once; beyond that a number is nonsense."""


class FrameTimes:
    """Frames are numbered as they begin, take time, and are recorded at their end; one sender's never overlap.

    On the ideal medium they are recorded when its delay has passed as well. Jammers take numbers too, so that numbers are
    missed only where there are none.

    It keeps the numbers that are not yet used below the greatest one (of what is on the air), and each sender's last frame.
    """

    def __init__(self, run: Run) -> None:
        self._times = Tally("frames have their time", "frames")
        self._overlaps = Tally("one frame at a time", "frames")
        if run.has_jammers:
            self._times.note = "a number that is missing may be a jammer's"
        self._misses = bool(run.scenario) and not run.has_jammers
        self._delay_ns = run.delay_ns
        self._greatest = 0
        self._begun_ns = 0
        """When the frame of the greatest number began."""
        self._open: dict[int, tuple[int, int]] = {}
        """Numbers not yet seen, with the beginnings of the frames before and after."""
        self._longest_ns = 0
        self._last: dict[int, tuple[int, int]] = {}

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._times, self._overlaps)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`. What began less than the longest frame's time ago may be on its way at the end."""
        if not self._misses or not end.is_whole:
            return
        latest_ns = end.time_ns - self._longest_ns - self._delay_ns
        for number, (_, before_ns) in self._open.items():
            if before_ns < latest_ns:
                self._times.found(f"frame {number} is missing, which began by {seconds(before_ns)} s")

    def _look(self, event: Frame, now_ns: int) -> None:
        start_ns, end_ns, source = event.t_start_ns, event.t_end_ns, event.source
        self._times.looked += 1
        self._overlaps.looked += 1
        self._longest_ns = max(self._longest_ns, end_ns - start_ns)
        self._number(event, now_ns)
        what = self._wrong(event, now_ns)
        if what:
            self._times.found(f"frame {event.frame_id}{what}", now_ns, source)
        begun_ns, over_ns = self._last.get(source, (-1, -1))
        if start_ns < over_ns and end_ns > begun_ns:
            what = (
                f"frame {event.frame_id} began at {seconds(start_ns)} s, while another lasted to {seconds(over_ns)} s"
            )
            self._overlaps.found(what, now_ns, source)
        if end_ns >= over_ns:
            self._last[source] = (start_ns, end_ns)

    def _wrong(self, event: Frame, now_ns: int) -> str:
        """What is wrong with the times of a frame; one that a crash breaks off is recorded at once."""
        start_ns, end_ns = event.t_start_ns, event.t_end_ns
        if start_ns > end_ns:
            return " ends before it begins"
        lasted = f": from {seconds(start_ns)} s to {seconds(end_ns)} s"
        if start_ns < 0 or end_ns > now_ns:
            return f"{lasted}, recorded before its end"
        if now_ns - end_ns not in (0, self._delay_ns):
            return (
                f"{lasted}, recorded {seconds(now_ns - end_ns)} s after its end, expected {seconds(self._delay_ns)} s"
            )
        return ""

    def _number(self, event: Frame, now_ns: int) -> None:
        number, start_ns, source = event.frame_id, event.t_start_ns, event.source
        if number > self._greatest + _MOST_SKIPPED:
            self._times.found(f"expected a frame of a number near {self._greatest + 1}, got {number}", now_ns, source)
        elif number > self._greatest:
            between = (self._begun_ns, start_ns)
            self._open.update(dict.fromkeys(range(self._greatest + 1, number), between))
            self._order(number, start_ns, (self._begun_ns, start_ns), now_ns, source)
            self._greatest, self._begun_ns = number, start_ns
        elif number in self._open:
            self._order(number, start_ns, self._open.pop(number), now_ns, source)
        else:
            self._times.found(f"a second frame {number}", now_ns, source)

    def _order(self, number: int, start_ns: int, between: tuple[int, int], now_ns: int, source: int) -> None:
        if not between[0] <= start_ns <= between[1]:
            low, high = map(seconds, between)
            what = (
                f"frame {number} began at {seconds(start_ns)} s, those numbered before and after at {low} and {high} s"
            )
            self._times.found(what, now_ns, source)


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
        self._delay_ns = run.delay_ns

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
