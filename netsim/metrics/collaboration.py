"""Collaboration groups: how far members are from their leaders, when groups are joint, and how many lead a track.

Tracking by groups of sensors whose readings come at fixed instants (Liu, Chu, Liu, Reich, Zhao 2004). A node leads track N
while it holds the role `leader N`; one that is down leads nothing.
"""

import json
import math
from collections import defaultdict
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from netsim.kernels.consistency import nees
from netsim.kernels.semiring import FloatArray
from netsim.metrics.tracks import TargetTruth, as_array
from netsim.trace.events import (
    AlgorithmRecord,
    EnergyLedger,
    Estimate,
    MessageSent,
    NodeLife,
    NodePositions,
    NodeTable,
    Problem,
    Role,
    TruthTargets,
)
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S, s_to_ns

REPORT_KIND: Final = "reading"
"""Kind of the messages in which members tell their leader what they read."""
_ROLE: Final = "leader "


class Collaboration:
    """Follows the groups of a run of energy tracking."""

    def __init__(self) -> None:
        self._reading_ns = 0
        self._truth = TargetTruth()
        self._places_m: dict[int, tuple[float, float]] = {}
        self._distances_m: list[float] = []
        self._estimates: defaultdict[int, dict[int, Estimate]] = defaultdict(dict)
        self._joint_steps: set[int] = set()
        self._changes = {"merge": 0, "split": 0}
        self._leaders = TrackLeaders()

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            Problem: self._on_problem,
            NodeTable: self._on_places,
            NodePositions: self._on_places,
            TruthTargets: self._truth.add,
            Estimate: self._on_estimate,
            MessageSent: self._on_sent,
            AlgorithmRecord: self._on_record,
            Role: self._leaders.on_role,
            NodeLife: self._leaders.on_life,
            EnergyLedger: self._leaders.on_end,
        }

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for other problems, and where nobody estimated anything."""
        if not self._reading_ns or not self._estimates:
            return {}
        count = len(self._distances_m)
        pairs = self._pairs()
        errors_m = [float(np.hypot(*error)) for _, error in pairs]
        squared = [each for each in map(_squared, pairs) if each is not None]
        return {
            "reading_error_mean_m": math.fsum(errors_m) / len(errors_m) if errors_m else None,
            "reading_nees_mean": math.fsum(squared) / len(squared) if squared else None,
            "group_reports": count,
            "report_distance_sum_m": math.fsum(self._distances_m),
            "report_distance_mean_m": math.fsum(self._distances_m) / count if count else None,
            "group_merges": self._changes["merge"],
            "group_splits": self._changes["split"],
            "joint_readings_share": len(self._joint_steps & self._estimates.keys()) / len(self._estimates),
        } | self._leaders.figures()

    def _pairs(self) -> list[tuple[Estimate, FloatArray]]:
        """Estimates with their errors against the targets as they were at the reading, in each reading's best assignment."""
        found: list[tuple[Estimate, FloatArray]] = []
        for step, by_track in sorted(self._estimates.items()):
            told = list(by_track.values())
            there = as_array(self._truth.at(step * self._reading_ns).values())
            offsets_m = as_array((each.x_m, each.y_m) for each in told)[:, None] - there
            rows, columns = linear_sum_assignment(np.hypot(offsets_m[..., 0], offsets_m[..., 1]))
            found.extend((told[row], offsets_m[row, column]) for row, column in zip(rows, columns, strict=True))
        return found

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "energy-tracking":
            self._reading_ns = s_to_ns(json.loads(event.content_json)["reading_s"])

    def _on_places(self, event: NodeTable | NodePositions, _: int) -> None:
        places_m = zip(map(float, event.x_m), map(float, event.y_m), strict=True)
        self._places_m.update(zip(map(int, event.node), places_m, strict=True))

    def _on_estimate(self, event: Estimate, now_ns: int) -> None:
        if self._reading_ns and math.isfinite(event.x_m) and math.isfinite(event.y_m):
            self._estimates[now_ns // self._reading_ns][event.target] = event

    def _on_sent(self, event: MessageSent, _: int) -> None:
        if event.kind == REPORT_KIND and event.destination in self._places_m:
            self._distances_m.append(math.dist(self._places_m[event.source], self._places_m[event.destination]))

    def _on_record(self, event: AlgorithmRecord, now_ns: int) -> None:
        if event.kind in self._changes:
            self._changes[event.kind] += 1
        elif event.kind == "joint" and self._reading_ns:
            self._joint_steps.add(now_ns // self._reading_ns)


def _squared(pair: tuple[Estimate, FloatArray]) -> float | None:
    """An error's square in terms of the covariance that was told with it; None without one."""
    estimate, error_m = pair
    if len(estimate.covariance_m2) != 3:
        return None
    xx, xy, yy = map(float, estimate.covariance_m2)
    return nees(error_m, np.array([[xx, xy], [xy, yy]]))


class TrackLeaders:
    """Who leads which track: changes, times with two leaders or more, and times without any between two leaders."""

    def __init__(self) -> None:
        self._holders: defaultdict[str, set[int]] = defaultdict(set)
        self._last: dict[str, int] = {}
        self._since_ns: dict[str, int] = {}
        self._doubled_s: list[float] = []
        self._left_ns: dict[str, int] = {}
        self._without_s: list[float] = []
        self._changes = 0

    def figures(self) -> dict[str, Any]:
        """The metrics."""
        return {
            "track_leader_changes": self._changes,
            "track_two_leaders_s": math.fsum(self._doubled_s),
            "track_two_leaders_longest_s": max(self._doubled_s, default=0.0),
            "track_without_leader_s": math.fsum(self._without_s),
            "track_without_leader_longest_s": max(self._without_s, default=0.0),
        }

    def on_role(self, event: Role, now_ns: int) -> None:
        """A node takes or leaves a track."""
        if not event.role.startswith(_ROLE):
            return
        if event.holds:
            self._holders[event.role].add(event.node)
            self._changes += self._last.get(event.role, event.node) != event.node
            self._last[event.role] = event.node
        else:
            self._holders[event.role].discard(event.node)
        self._count(event.role, now_ns)

    def on_life(self, event: NodeLife, now_ns: int) -> None:
        """A node that is down leads nothing."""
        if event.event in ("started", "rebooted"):
            return
        for role in [role for role, nodes in self._holders.items() if event.node in nodes]:
            self._holders[role].discard(event.node)
            self._count(role, now_ns)

    def on_end(self, _: EnergyLedger, now_ns: int) -> None:
        """Two leaders end with the run; a track without any that nobody takes up again has ended."""
        for role in list(self._since_ns):
            self._end(role, now_ns)

    def _count(self, role: str, now_ns: int) -> None:
        if len(self._holders[role]) > 1:
            self._since_ns.setdefault(role, now_ns)
        elif role in self._since_ns:
            self._end(role, now_ns)
        if not self._holders[role]:
            self._left_ns.setdefault(role, now_ns)
        elif (left_ns := self._left_ns.pop(role, now_ns)) < now_ns:
            self._without_s.append((now_ns - left_ns) / NS_PER_S)

    def _end(self, role: str, now_ns: int) -> None:
        length_ns = now_ns - self._since_ns.pop(role)
        if length_ns > 0:
            self._doubled_s.append(length_ns / NS_PER_S)
