"""Numbers and words are such as their fields can hold: columns of one length, known words, probabilities that are some."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from netsim.audit.rule import End
from netsim.audit.tally import Tally
from netsim.trace.cdr import wire_types
from netsim.trace.events import (
    EVENT_TYPES,
    RADIO_STATES,
    Belief,
    EnergyBudget,
    EnergyHarvest,
    EnergyLedger,
    Estimate,
    Event,
    Fault,
    FieldInfo,
    Frame,
    GraphMessages,
    Handoff,
    Identity,
    Log,
    Marginals,
    MessageDropped,
    NodeClocks,
    NodeEnergy,
    NodeLife,
    NodePositions,
    NodeTable,
    PairProbabilities,
    Particles,
    RadioState,
    TruthOrigins,
    TruthTargets,
    VariablePlacement,
)
from netsim.trace.recorder import Handler

SUM_TOLERANCE = 1e-6
"""Of probabilities that sum to one: they have been through messages of any width and were scaled again."""
ROUNDING = 1e-12
"""Of a probability that meets its bound."""
_PROBABILITIES = ("probability", "prr", "low", "high")
_SUM_TO_ONE = (Marginals, Identity, Belief)
_TOGETHER: Mapping[type[Any], tuple[tuple[str, ...], ...]] = {
    Frame: (("rx_node", "rx_outcome", "rx_rssi_dbm", "rx_sinr_db"),),
    VariablePlacement: (("variable", "name", "host"), ("edge_a", "edge_b")),
    TruthOrigins: (("x_m", "y_m", "target"),),
    GraphMessages: (("source", "destination", "remote"),),
    PairProbabilities: (("event", "probability", "low", "high"),),
    Belief: (("cell", "probability"),),
    Handoff: (("candidate", "utility"),),
}
"""Columns of one table, where the event is not a table as a whole."""
_FINITE: Mapping[type[Any], tuple[str, ...]] = {
    NodeTable: ("x_m", "y_m"),
    NodePositions: ("x_m", "y_m"),
    NodeClocks: ("ahead_s",),
    NodeEnergy: ("consumed_j",),
    EnergyLedger: ("energy_j", "time_s"),
    TruthTargets: ("x_m", "y_m"),
    FieldInfo: ("x_m", "y_m", "width_m", "height_m"),
    Frame: ("tx_power_dbm",),
    Estimate: ("x_m", "y_m"),
    Belief: ("origin_x_m", "origin_y_m", "cell_m"),
    Particles: ("x_m", "y_m", "weight"),
    EnergyHarvest: ("offered_j", "spilled_j"),
    EnergyBudget: ("spent_j",),
}
_WORDS: Mapping[tuple[type[Any], str], frozenset[Any]] = {
    (NodeTable, "role"): frozenset({"sensor", "sink"}),
    (NodeLife, "event"): frozenset({"started", "finished", "failed", "died", "crashed", "rebooted"}),
    (EnergyLedger, "device"): frozenset({"radio", "cpu", "sensor"}),
    (EnergyBudget, "event"): frozenset({"short", "replenished", "refused", "ended"}),
    (Fault, "event"): frozenset({"begins", "ends", "strikes"}),
    (MessageDropped, "reason"): frozenset(
        {"no_ack", "channel_busy", "queue_full", "no_route", "hop_limit", "reassembly_timeout", "reassembly_full"}
        | {"no_energy", "malformed", "no_sequence", "died", "crashed"}
    ),
    (RadioState, "state"): frozenset(range(len(RADIO_STATES))),
    (Log, "level"): frozenset({1, 2, 3, 4}),
}
_YES_OR_NO = ("is_ack", "is_strobe", "is_max", "is_synchronous", "holds", "remote")


class Columns:
    """Columns of one table are of one length."""

    def __init__(self) -> None:
        self._tally = Tally("columns are of one length", "tables")

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        tables = {event_type: _tables(event_type) for event_type in EVENT_TYPES}
        return {event_type: self._measure(names) for event_type, names in tables.items() if names}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _measure(self, tables: Sequence[Sequence[str]]) -> Handler:
        def look(event: Any, now_ns: int) -> None:
            for names in tables:
                self._tally.looked += 1
                lengths = {len(getattr(event, name)) for name in names}
                if len(lengths) > 1:
                    found = ", ".join(f"{name} {len(getattr(event, name))}" for name in names)
                    self._tally.found(f"{event.topic}: {found}", now_ns, _node_of(event))

        return look


class Values:
    """Words are known ones, flags 0 or 1, places and joules are numbers."""

    def __init__(self) -> None:
        self._tally = Tally("values are in range", "fields")

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        checks = {event_type: list(_checks(event_type)) for event_type in EVENT_TYPES}
        return {event_type: self._apply(found) for event_type, found in checks.items() if found}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _apply(self, checks: Sequence[tuple[str, Callable[[Any], str]]]) -> Handler:
        def look(event: Any, now_ns: int) -> None:
            self._tally.looked += len(checks)
            for name, wrong in checks:
                what = wrong(getattr(event, name))
                if what:
                    self._tally.found(f"{event.topic}: {name}: {what}", now_ns, _node_of(event))

        return look


class Probabilities:
    """Probabilities are within [0, 1], those of one variable sum to one, and bounds enclose what they bound."""

    def __init__(self) -> None:
        self._range = Tally("probabilities are in [0, 1]", "arrays", f"and within their bounds, to {ROUNDING:g}")
        self._sums = Tally("probabilities sum to one", "arrays", f"to {SUM_TOLERANCE:g}")

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._range, self._sums)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        named = {
            event_type: [name for name in _PROBABILITIES if name in wire_types(event_type)]
            for event_type in EVENT_TYPES
        }
        return {event_type: self._watch(event_type, names) for event_type, names in named.items() if names}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _watch(self, event_type: type[Event], names: Sequence[str]) -> Handler:
        sums, bounds = event_type in _SUM_TO_ONE, "low" in names

        def look(event: Any, now_ns: int) -> None:
            for name in names:
                self._range.looked += 1
                values = np.asarray(getattr(event, name))
                if not ((values >= 0.0) & (values <= 1.0)).all():
                    worst = values[~((values >= 0.0) & (values <= 1.0))][0]
                    self._range.found(f"{event.topic}: {name}: got {worst:.12g}", now_ns, _node_of(event))
            if sums:
                self._sum(event, now_ns)
            if bounds:
                self._bound(event, now_ns)

        return look

    def _sum(self, event: Any, now_ns: int) -> None:
        if not len(event.probability):
            return
        self._sums.looked += 1
        total = float(np.sum(event.probability))
        if not abs(total - 1.0) <= SUM_TOLERANCE:
            self._sums.found(f"{event.topic}: the probabilities sum to {total:.12g}", now_ns, _node_of(event))

    def _bound(self, event: Any, now_ns: int) -> None:
        low, value, high = (np.asarray(values) for values in (event.low, event.probability, event.high))
        if len(low) == len(value) == len(high) and not ((low <= value + ROUNDING) & (value <= high + ROUNDING)).all():
            self._range.found(f"{event.topic}: a probability is outside of its bounds", now_ns, _node_of(event))


def _tables(event_type: type[Event]) -> list[tuple[str, ...]]:
    """The groups of fields of an event that are columns of one table: all of them, where all are arrays."""
    if event_type in _TOGETHER:
        return list(_TOGETHER[event_type])
    wires = wire_types(event_type)
    return [tuple(wires)] if len(wires) > 1 and all(wire.endswith("[]") for wire in wires.values()) else []


def _checks(event_type: type[Event]) -> Iterator[tuple[str, Callable[[Any], str]]]:
    """The fields of an event that can be wrong, each with what says how."""
    for name, wire in wire_types(event_type).items():
        allowed = frozenset({0, 1}) if name in _YES_OR_NO else _WORDS.get((event_type, name))
        if allowed is not None:
            yield name, _Among(allowed, wire.endswith("[]"))
        if name in _FINITE.get(event_type, ()):
            yield name, _not_finite


class _Among:
    """Says what is not one of some values."""

    def __init__(self, allowed: frozenset[Any], several: bool) -> None:
        self._allowed = allowed
        self._several = several

    def __call__(self, value: Any) -> str:
        values = list(value) if self._several else [value]
        if self._allowed.issuperset(values):
            return ""
        other = next(each for each in values if each not in self._allowed)
        return f"expected one of {', '.join(map(str, sorted(self._allowed)))}, got {other}"


def _not_finite(values: Any) -> str:
    numbers = np.asarray(values)
    return (
        "" if np.isfinite(numbers).all() else f"expected a finite number, got {numbers[~np.isfinite(numbers)].flat[0]}"
    )


def _node_of(event: Any) -> int | None:
    node = getattr(event, "node", None)
    return node if isinstance(node, int) else None
