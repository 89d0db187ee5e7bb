"""Who takes part: every node that is named has been introduced, and lives as nodes live."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

from netsim.audit.columns import plain
from netsim.audit.rule import GARBLED, End, Run
from netsim.audit.tally import Tally
from netsim.trace.cdr import wire_types
from netsim.trace.events import (
    BROADCAST,
    EVENT_TYPES,
    Event,
    GraphMessages,
    MessageDelivered,
    MessageDropped,
    NodeLife,
    NodeTable,
)
from netsim.trace.recorder import Handler

_NODE_FIELDS = frozenset({"node", "rx_node", "host", "next_hop", "source", "destination", "candidate", "member"})
_OR_ALL = frozenset({"destination", "next_hop"})
_NOT_NODES = {(GraphMessages, "source"), (GraphMessages, "destination")}
"""Variables of the graphical model, not nodes."""

_OF_PACKETS: frozenset[type[Event]] = frozenset({MessageDelivered, MessageDropped})
"""Events that tell what stands in a packet's header."""

_AFTER = {
    None: ("started",),
    "started": ("finished", "failed", "died", "crashed"),
    "rebooted": ("finished", "failed", "died", "crashed"),
    "finished": ("failed", "died", "crashed"),
    "failed": ("finished", "died", "crashed"),
    "crashed": ("rebooted", "died"),
    "died": (),
}
"""What may happen to a node after what. A battery can run empty after a crash: a node that is off may draw power too."""


class KnownNodes:
    """Every node that an event names is a row of the node table, which comes once and first."""

    def __init__(self, run: Run) -> None:
        self._tally = Tally("nodes are known", "events", GARBLED if run.garbles else "")
        self._unsure = _OF_PACKETS if run.garbles else frozenset()
        self._known: set[int] | None = None

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        named = {event_type: list(_node_fields(event_type)) for event_type in EVENT_TYPES}
        named = {event_type: names for event_type, names in named.items() if event_type not in self._unsure}
        watching = {event_type: self._watch(names) for event_type, names in named.items() if names}
        return {**watching, NodeTable: self._introduce}

    def conclude(self, end: End) -> None:
        """See `Rule`."""
        if self._known is None and end.is_whole:
            self._tally.found("no node table (/nodes/info)")

    def _introduce(self, event: NodeTable, now_ns: int) -> None:
        self._tally.looked += 1
        numbers = plain(event.node)
        if self._known is not None:
            self._tally.found("a second node table", now_ns)
        if len(set(numbers)) < len(numbers):
            self._tally.found("a node has two rows in the node table", now_ns)
        self._known = (self._known or set()) | set(numbers)

    def _watch(self, names: Sequence[tuple[str, bool]]) -> Handler:
        def look(event: Any, now_ns: int) -> None:
            self._tally.looked += 1
            for name, is_array in names:
                value = getattr(event, name)
                numbers = plain(value) if is_array else [value]
                known = self._known or set()
                if not known.issuperset(numbers):
                    self._complain(event, name, [number for number in numbers if number not in known], now_ns)

        return look

    def _complain(self, event: Event, name: str, unknown: Sequence[int], now_ns: int) -> None:
        wrong = [number for number in unknown if number != BROADCAST or name not in _OR_ALL]
        if wrong:
            self._tally.found(f"{event.topic} names in `{name}` a node that is not in the node table", now_ns, wrong[0])


class Lives:
    """A node starts once, comes up only after a crash, and does nothing after its death."""

    def __init__(self) -> None:
        self._tally = Tally("nodes live in order", "changes")
        self._last: dict[int, str] = {}

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {NodeLife: self._change}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _change(self, event: NodeLife, now_ns: int) -> None:
        self._tally.looked += 1
        before = self._last.get(event.node)
        if event.event not in _AFTER[before]:
            self._tally.found(f"{event.event} after {before or 'nothing'}", now_ns, event.node)
        if event.event in _AFTER:
            self._last[event.node] = event.event


def _node_fields(event_type: type[Event]) -> Iterator[tuple[str, bool]]:
    """The fields of an event that hold node ids, and whether each holds several."""
    wires = wire_types(event_type)
    for field in fields(event_type):
        if field.name in _NODE_FIELDS and (event_type, field.name) not in _NOT_NODES:
            yield field.name, wires[field.name].endswith("[]")
