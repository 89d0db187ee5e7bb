"""True targets and estimated tracks over time."""

import json
import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.trace.events import Problem, TruthTargets
from netsim.units import s_to_ns

Points = Mapping[int, tuple[float, float]]
"""Positions in metres by number."""

CUT_OFF_M: Final = 10.0
"""From this distance on a track does not follow a target, where the problem says nothing else: twice the 5 m within which
the sensors of the shipped association problems detect one, so that a track beyond it looks for its target among the wrong
sensors."""


def cut_off_of(problem: Problem, otherwise_m: float) -> float:
    """The distance from which on a track does not follow a target: the tracking problem's own, or the given one."""
    if problem.kind not in ("tracking", "energy-tracking"):
        return otherwise_m
    return float(json.loads(problem.content_json).get("cut_off_m", otherwise_m))


class TargetTruth:
    """Where the targets are at any time.

    A target is there when the last record up to that time names it; it is on the straight line to its place in the next
    record, or rests where that does not name it or there is none.
    """

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._records: list[Points] = []

    @property
    def last_ns(self) -> int:
        """Time of the last record; 0 without any."""
        return self._times_ns[-1] if self._times_ns else 0

    @property
    def is_empty(self) -> bool:
        """Whether nothing was ever said of targets."""
        return not self._times_ns

    def add(self, event: TruthTargets, now_ns: int) -> None:
        """Take a record; a second one at the same instant replaces the first."""
        places_m = zip(map(float, event.x_m), map(float, event.y_m), strict=True)
        if self._times_ns and self._times_ns[-1] == now_ns:
            del self._times_ns[-1], self._records[-1]
        self._times_ns.append(now_ns)
        self._records.append(dict(zip(map(int, event.target), places_m, strict=True)))

    def at(self, time_ns: int) -> Points:
        """Positions at a time, by target."""
        number = bisect_right(self._times_ns, time_ns)
        if number == 0:
            return {}
        before = self._records[number - 1]
        if number == len(self._records):
            return before
        after, start_ns = self._records[number], self._times_ns[number - 1]
        share = (time_ns - start_ns) / (self._times_ns[number] - start_ns)
        return {target: _between(place, after.get(target, place), share) for target, place in before.items()}

    def nearest_m(self, time_ns: int, place_m: tuple[float, float]) -> float | None:
        """Distance of a place from the nearest target at a time; None without any."""
        return min((math.dist(place_m, there_m) for there_m in self.at(time_ns).values()), default=None)


def _between(one: tuple[float, float], other: tuple[float, float], share: float) -> tuple[float, float]:
    return one[0] + share * (other[0] - one[0]), one[1] + share * (other[1] - one[1])


@dataclass(frozen=True, slots=True)
class Fix:
    """One estimate of a track's position.

    Attributes:
        time_ns: When.
        track: Which track.
        place_m: Where.
        covariance_m2: xx, xy, yy; None where it was not given.
    """

    time_ns: int
    track: int
    place_m: tuple[float, float]
    covariance_m2: tuple[float, float, float] | None = None


@dataclass(slots=True)
class TrackHistory:
    """Every estimate in the order of time.

    Attributes:
        hold_s: How long an estimate speaks for its track.
        fixes: The estimates.
    """

    hold_s: float
    fixes: list[Fix] = field(default_factory=list)

    def at_each(self, times_ns: Iterable[int]) -> Iterator[tuple[int, dict[int, Fix]]]:
        """The tracks alive at each of some ascending times: their last estimates up to then, if not too old."""
        hold_ns = s_to_ns(self.hold_s)
        latest: dict[int, Fix] = {}
        number = 0
        for time_ns in times_ns:
            while number < len(self.fixes) and self.fixes[number].time_ns <= time_ns:
                latest[self.fixes[number].track] = self.fixes[number]
                number += 1
            alive = {track: fix for track, fix in latest.items() if fix.time_ns >= time_ns - hold_ns}
            latest = dict(sorted(alive.items()))
            yield time_ns, dict(latest)


def as_array(places_m: Iterable[tuple[float, float]]) -> FloatArray:
    """Positions as an array of shape (n, 2)."""
    return np.array(list(places_m), dtype=float).reshape(-1, 2)
