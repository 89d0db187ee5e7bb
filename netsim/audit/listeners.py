"""One outcome a listener: none twice, none missing, each such as may befall that listener."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from netsim.audit.columns import plain
from netsim.audit.frames import is_for
from netsim.audit.rule import End, Run
from netsim.audit.tally import Tally
from netsim.trace.events import BROADCAST, OUTCOME_CODE, OUTCOMES, Event, Frame, LinkTable, NodePositions
from netsim.trace.recorder import Handler

_RECEIVED, _OVERHEARD = OUTCOME_CODE["received"], OUTCOME_CODE["overheard"]


class Outcomes:
    """A listener is in a frame once and is not its sender; what is `received` was for it, what is `overheard` was not."""

    def __init__(self, run: Run) -> None:
        self._tally = Tally("one outcome a listener", "receptions")
        self._is_summary = run.detail == "summary"

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _look(self, event: Frame, now_ns: int) -> None:
        nodes, codes = plain(event.rx_node), plain(event.rx_outcome)
        self._tally.looked += len(nodes)
        if len(set(nodes)) < len(nodes):
            twice = next(node for node in nodes if nodes.count(node) > 1)
            self._tally.found(f"the listener is {nodes.count(twice)} times in frame {event.frame_id}", now_ns, twice)
        for node, code in zip(nodes, codes, strict=False):
            what = self._wrong(event, node, code)
            if what:
                self._tally.found(f"frame {event.frame_id}: {what}", now_ns, node)
        if np.isnan(event.rx_sinr_db).any() or not np.isfinite(event.rx_rssi_dbm).all():
            self._tally.found(f"frame {event.frame_id}: a received power or SINR is no number", now_ns)

    def _wrong(self, event: Frame, node: int, code: int) -> str:
        if node == event.source:
            return "its sender is among the listeners"
        if code >= len(OUTCOMES):
            return f"expected an outcome below {len(OUTCOMES)}, got {code}"
        if code in (_RECEIVED, _OVERHEARD) and (code == _RECEIVED) != is_for(event, node):
            return f"{OUTCOMES[code]}, but its destination is {event.destination}"
        if self._is_summary and node != event.destination:
            return "at detail summary only the addressee has an outcome"
        return ""


class EveryListener:
    """Whoever the link table says can hear a sender has an outcome in each of its frames; at `summary` the addressee.

    Where links vary (fading, varying noise) a frame may be too faint for a node of the table; links of nodes that have moved
    are no longer those of the table.
    """

    def __init__(self, run: Run) -> None:
        self._tally = Tally("every listener has an outcome", "frames")
        self._is_summary = run.detail == "summary"
        self._varies = "" if run.scenario else "the trace carries no scenario that says whether its links vary"
        noise = run.medium.get("noise")
        if run.medium.get("fading") is not None:
            self._varies = "links vary by fading"
        elif isinstance(noise, dict) and noise.get("type") != "constant":
            self._varies = "links vary with the noise"
        self._audible: defaultdict[int, set[int]] = defaultdict(set)
        self._moved: set[int] = set()
        self._has_table = False

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {LinkTable: self._learn, NodePositions: self._move, Frame: self._look}

    def conclude(self, end: End) -> None:
        """See `Rule`."""
        if self._varies:
            self._tally.note = f"not checked: {self._varies}"
        elif not self._has_table:
            self._tally.note = "not checked: no link table (/links/info)"
        elif self._moved:
            self._tally.note = f"without links of {len(self._moved)} nodes after they moved"

    def _learn(self, event: LinkTable, _: int) -> None:
        self._has_table = True
        for source, destination in zip(event.source, event.destination, strict=False):
            self._audible[int(source)].add(int(destination))

    def _move(self, event: NodePositions, _: int) -> None:
        moved = {int(node) for node in event.node} - self._moved
        self._moved |= moved
        for source, listeners in self._audible.items():
            self._audible[source] = set() if source in moved else listeners - moved

    def _look(self, event: Frame, now_ns: int) -> None:
        if self._varies or not self._has_table:
            return
        self._tally.looked += 1
        audible = self._audible.get(event.source, set())
        expected = audible & {event.destination} if self._is_summary else audible
        missing = expected.difference(plain(event.rx_node))
        if missing:
            node = event.destination if event.destination in missing else min(missing)
            who = "its addressee" if node == event.destination and node != BROADCAST else "a node in range"
            self._tally.found(f"frame {event.frame_id} has no outcome at {who}", now_ns, node)
