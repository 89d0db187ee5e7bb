"""Every joule is accounted for: the ledger closes, the battery closes, and time is booked once.

Tolerances are those of writing exact sums as binary fractions: a relative 1e-9, and some units in the last place of the
battery's capacity, beside which what was drawn may be small.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from netsim.audit.columns import plain
from netsim.audit.rule import End, Run
from netsim.audit.tally import Tally
from netsim.errors import ScenarioError
from netsim.models.device_tables import load_battery
from netsim.trace.events import EnergyHarvest, EnergyLedger, Event, Frame, NodeEnergy, NodeTable
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

RELATIVE = 1e-9
SMALLEST_J = 1e-12
SMALLEST_S = 1e-9
_ULPS = 4
_TOLERANCE = f"to a relative {RELATIVE:g}"

_Entry = tuple[int, str, str]
"""Node, state of its radio, kind of message."""


class LedgerCloses:
    """What the ledger books for a node is what its battery gave; each device's entries fill the whole run, once."""

    def __init__(self) -> None:
        self._joules = Tally("energy closes", "nodes", _TOLERANCE)
        self._times = Tally("time is booked once", "devices", _TOLERANCE)
        self._used_j: dict[int, float] = {}
        self._sampled_ns = -1
        self._has_ledger = False

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._joules, self._times)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {NodeEnergy: self._sample, EnergyLedger: self._close}

    def conclude(self, end: End) -> None:
        """See `Rule`."""
        if not self._has_ledger and end.is_whole:
            self._joules.found("no ledger (/energy/ledger): the run was not concluded", end.time_ns)

    def _sample(self, event: NodeEnergy, now_ns: int) -> None:
        self._used_j = dict(zip(event.node, event.consumed_j, strict=False))
        self._sampled_ns = now_ns

    def _close(self, event: EnergyLedger, now_ns: int) -> None:
        self._has_ledger = True
        joules: defaultdict[int, list[float]] = defaultdict(list)
        times: defaultdict[tuple[int, str], list[float]] = defaultdict(list)
        for node, device, energy_j, time_s in zip(event.node, event.device, event.energy_j, event.time_s, strict=False):
            joules[int(node)].append(float(energy_j))
            times[int(node), device].append(float(time_s))
        if self._sampled_ns != now_ns:
            self._joules.found("the nodes' energy (/nodes/energy) was not sampled at the instant of the ledger", now_ns)
        self._compare_joules(joules, now_ns)
        self._compare_times(times, now_ns)

    def _compare_joules(self, joules: Mapping[int, Sequence[float]], now_ns: int) -> None:
        for node in sorted({*joules, *map(int, self._used_j)}):
            self._joules.looked += 1
            booked_j, used_j = math.fsum(joules.get(node, ())), float(self._used_j.get(node, 0.0))
            if not _near(booked_j, used_j, SMALLEST_J):
                self._joules.found(f"drawn {used_j:.12g} J, booked {booked_j:.12g} J", now_ns, node)

    def _compare_times(self, times: Mapping[tuple[int, str], Sequence[float]], now_ns: int) -> None:
        run_s = now_ns / NS_PER_S
        for (node, device), parts in times.items():
            self._times.looked += 1
            if not _near(math.fsum(parts), run_s, SMALLEST_S) or min(parts) < 0.0:
                what = f"{device}: expected entries of {run_s:.9f} s in all, none below 0, got {math.fsum(parts):.9f} s"
                self._times.found(what, now_ns, node)


class BatteryCloses:
    """What is left and what was used make the capacity and what was harvested; what was used never falls.

    A cell that gives less under heavy load has less left than that, never more.
    """

    def __init__(self, run: Run) -> None:
        self._tally = Tally("batteries close", "samples", _TOLERANCE)
        self._is_linear = _linear_groups(run)
        self._capacity_j: dict[int, float] = {}
        self._linear: set[int] = set()
        self._last: NodeEnergy | None = None
        self._last_used_j: dict[int, float] = {}
        self._early: dict[int, tuple[int, float, float]] = {}
        self._harvested: set[int] = set()

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {NodeTable: self._introduce, NodeEnergy: self._sample, EnergyHarvest: self._harvest}

    def conclude(self, end: End) -> None:
        """See `Rule`. Before the end nobody knows who has a harvester: only now is too much left a finding."""
        for node, (time_ns, used_j, left_j) in self._early.items():
            if node not in self._harvested and end.is_whole:
                self._complain(node, time_ns, used_j, left_j, 0.0)
        inexact = len(self._capacity_j) - len(self._linear)
        if inexact:
            self._tally.note += f"; of {inexact} whose cells are not linear, or not known, only that no more is left"

    def _introduce(self, event: NodeTable, _: int) -> None:
        for node, group, capacity_j in zip(event.node, event.group, event.battery_j, strict=False):
            self._capacity_j[int(node)] = float(capacity_j)
            if self._is_linear.get(group, math.isinf(capacity_j)):
                self._linear.add(int(node))

    def _sample(self, event: NodeEnergy, now_ns: int) -> None:
        self._last = event
        for node, used_j, left_j in zip(plain(event.node), plain(event.consumed_j), plain(event.left_j), strict=False):
            self._tally.looked += 1
            if not used_j >= self._last_used_j.get(node, 0.0):
                self._tally.found(f"expected consumed_j never to fall, got {used_j:.12g} J", now_ns, node)
            self._last_used_j[node] = used_j
            if node not in self._early and not self._closes(node, used_j, left_j, 0.0):
                self._early[node] = (now_ns, used_j, left_j)

    def _harvest(self, event: EnergyHarvest, now_ns: int) -> None:
        last, self._harvested = self._last, {int(node) for node in event.node}
        if last is None:
            return
        nodes = plain(last.node)
        used_j, left_j = (dict(zip(nodes, plain(column), strict=False)) for column in (last.consumed_j, last.left_j))
        for node, offered_j, spilled_j in zip(
            plain(event.node), plain(event.offered_j), plain(event.spilled_j), strict=False
        ):
            gain_j = offered_j - spilled_j
            self._tally.looked += 1
            if not 0.0 <= spilled_j <= offered_j * (1.0 + RELATIVE):
                self._tally.found(f"spilled {spilled_j:.12g} J of {offered_j:.12g} J offered", now_ns, node)
            if node in used_j and node in left_j and not self._closes(node, used_j[node], left_j[node], gain_j):
                self._complain(node, now_ns, used_j[node], left_j[node], gain_j)

    def _closes(self, node: int, used_j: float, left_j: float, gain_j: float) -> bool:
        capacity_j = self._capacity_j.get(node, math.inf)
        if math.isinf(capacity_j):
            return math.isinf(left_j)
        excess_j = math.fsum((left_j, used_j, -capacity_j, -gain_j))
        slack_j = RELATIVE * (used_j + gain_j) + _ULPS * math.ulp(capacity_j) + SMALLEST_J
        return abs(excess_j) <= slack_j if node in self._linear else excess_j <= slack_j

    def _complain(self, node: int, time_ns: int, used_j: float, left_j: float, gain_j: float) -> None:
        has_j = self._capacity_j.get(node, math.inf)
        what = f"left {left_j:.12g} J and used {used_j:.12g} J, but the capacity is {has_j:.12g} J"
        self._tally.found(f"{what} and {gain_j:.12g} J were harvested" if gain_j else what, time_ns, node)


class AirtimeIsBooked:
    """The time a node's ledger has for transmitting each kind of message is the time its frames of it were on the air."""

    _LABELS: Mapping[str, tuple[bool, bool, bool]] = {
        "strobe_transmit": (True, False, False),
        "ack_transmit": (False, True, False),
        "retransmit": (False, False, True),
        "transmit": (False, False, False),
    }

    def __init__(self, run: Run) -> None:
        self._tally = Tally("airtime is booked", "ledger entries", "but for what was on its way at the end")
        self._under_way_ns = run.delay_ns
        self._air_ns: defaultdict[_Entry, int] = defaultdict(int)
        self._longest_ns = 0

    @property
    def tallies(self) -> Sequence[Tally]:
        """See `Rule`."""
        return (self._tally,)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Rule`."""
        return {Frame: self._add, EnergyLedger: self._close}

    def conclude(self, end: End) -> None:
        """See `Rule`."""

    def _add(self, event: Frame, _: int) -> None:
        airtime_ns = event.t_end_ns - event.t_start_ns
        self._air_ns[event.source, _label(event), event.kind] += airtime_ns
        self._longest_ns = max(self._longest_ns, airtime_ns)

    def _close(self, event: EnergyLedger, now_ns: int) -> None:
        booked: defaultdict[_Entry, list[float]] = defaultdict(list)
        columns = (event.node, event.device, event.state, event.kind, event.time_s)
        for node, device, state, kind, time_s in zip(*columns, strict=False):
            if device == "radio" and state in self._LABELS:
                booked[int(node), state, kind].append(float(time_s))
        for entry in sorted({*booked, *self._air_ns}):
            node, state, kind = entry
            self._tally.looked += 1
            booked_s, air_s = math.fsum(booked.get(entry, ())), self._air_ns[entry] / NS_PER_S
            more_s = booked_s - air_s
            slack_s = RELATIVE * booked_s + SMALLEST_S
            if not -slack_s <= more_s <= slack_s + (self._longest_ns + self._under_way_ns) / NS_PER_S:
                what = f"{state} `{kind}`: booked {booked_s:.9f} s, on the air {air_s:.9f} s"
                self._tally.found(what, now_ns, node)


def _label(frame: Frame) -> str:
    if frame.is_strobe:
        return "strobe_transmit"
    return "ack_transmit" if frame.is_ack else ("retransmit" if frame.attempt else "transmit")


def _near(first: float, second: float, smallest: float) -> bool:
    return math.isclose(first, second, rel_tol=RELATIVE, abs_tol=smallest)


def _linear_groups(run: Run) -> dict[str, bool]:
    """By group of nodes, whether every joule of its batteries can be had at any load; unknown ones are left out."""
    groups = run.scenario.get("nodes")
    found: dict[str, bool] = {}
    for group in groups if isinstance(groups, list) else []:
        battery = group.get("battery") if isinstance(group, dict) else None
        if isinstance(battery, dict):
            linear = _is_linear(battery, run.folder)
            if linear is not None:
                found[str(group.get("name"))] = linear
    return found


def _is_linear(battery: Mapping[str, Any], folder: Path) -> bool | None:
    if battery.get("type") != "device":
        return True
    try:
        return load_battery(str(battery.get("device")), folder).chemistry is None
    except ScenarioError:  # a table of the user's own that is not where the trace is
        return None
