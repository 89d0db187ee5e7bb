"""Grid beliefs: how far their estimates are off, how wide they are, and what handing them over takes.

The figures that Liu, Reich, Zhao 2002 print in their Tables 4 and 5, and what they leave out. The first belief of a track
tells of how it was started, not of how it is followed; means are therefore given with and without it.
"""

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from netsim.kernels.grid_belief import Grid, GridBelief
from netsim.metrics.tracks import CUT_OFF_M, Fix, TargetTruth, cut_off_of
from netsim.trace.events import Belief, Estimate, Handoff, Problem, TruthTargets
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S, s_to_ns

Values = Sequence[float]


class EstimateErrors:
    """Distance of every estimate from the nearest target, however far: no assignment and no cut-off."""

    def __init__(self) -> None:
        self._cut_off_m = CUT_OFF_M
        self._truth = TargetTruth()
        self._fixes: list[Fix] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, TruthTargets: self._truth.add, Estimate: self._on_estimate}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where nobody estimated anything, or there are no targets."""
        if not self._fixes or self._truth.is_empty:
            return {}
        errors_m = [(fix, self._truth.nearest_m(fix.time_ns, fix.place_m)) for fix in self._fixes]
        known = [(fix, error_m) for fix, error_m in errors_m if error_m is not None]
        every = [error_m for _, error_m in known]
        begun_ns = _begun_ns([(fix.track, fix.time_ns) for fix in self._fixes])
        return {
            "estimate_error_mean_m": _mean(every),
            "estimate_error_mean_after_start_m": _mean([e for fix, e in known if fix.time_ns > begun_ns[fix.track]]),
            "estimate_error_max_m": max(every, default=None),
            "estimates_lost_share": _mean([float(error_m >= self._cut_off_m) for error_m in every]),
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        self._cut_off_m = cut_off_of(event, self._cut_off_m)

    def _on_estimate(self, event: Estimate, now_ns: int) -> None:
        place_m = float(event.x_m), float(event.y_m)
        if all(map(math.isfinite, place_m)):
            self._fixes.append(Fix(now_ns, event.target, place_m))


@dataclass(slots=True)
class _Told:
    """Of one belief: its track and step, when it was told, its mean and its size."""

    track: int
    step: int
    time_ns: int
    mean_m: tuple[float, float]
    variance_m2: float
    cells: int


class Beliefs:
    """How wide the beliefs are, how old, and how far off at the instant of their last reading."""

    def __init__(self) -> None:
        self._told: list[_Told] = []
        self._truth = TargetTruth()
        self._reading_ns: int | None = None

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, TruthTargets: self._truth.add, Belief: self._on_belief}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty without a belief."""
        if not self._told:
            return {}
        begun_ns = _begun_ns([(each.track, each.time_ns) for each in self._told])
        later = [each for each in self._told if each.time_ns > begun_ns[each.track]]
        return {
            "beliefs": len(self._told),
            "belief_variance_mean_m2": _mean([each.variance_m2 for each in self._told]),
            "belief_variance_mean_after_start_m2": _mean([each.variance_m2 for each in later]),
            "belief_cells_mean": _mean([each.cells for each in self._told]),
            "belief_cells_mean_after_start": _mean([each.cells for each in later]),
        } | self._at_readings(later, self._reading_ns)

    def _at_readings(self, later: Sequence[_Told], reading_ns: int | None) -> dict[str, Any]:
        """Judged at the instants of the readings; missing where the problem does not say when these are."""
        if reading_ns is None:
            return {}
        errors_m = [self._truth.nearest_m(each.step * reading_ns, each.mean_m) for each in later]
        ages_s = [(each.time_ns - each.step * reading_ns) / NS_PER_S for each in self._told]
        return {
            "belief_error_mean_after_start_m": _mean([error_m for error_m in errors_m if error_m is not None]),
            "belief_age_mean_s": _mean(ages_s),
            "belief_age_max_s": max(ages_s),
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "tracking":
            reading_s = json.loads(event.content_json).get("reading_s")
            self._reading_ns = None if reading_s is None else s_to_ns(reading_s)

    def _on_belief(self, event: Belief, now_ns: int) -> None:
        belief = belief_of(event)
        x_m, y_m = belief.mean_m.tolist()
        told = _Told(event.target, event.step, now_ns, (x_m, y_m), belief.variance_m2, len(event.cell))
        self._told.append(told)


def belief_of(event: Belief) -> GridBelief:
    """The belief that an event tells of; its grid has as many rows as the cells need."""
    cells = np.asarray(event.cell, dtype=np.int64)
    columns = int(event.columns)
    grid = Grid((event.origin_x_m, event.origin_y_m), event.cell_m, columns, int(cells.max(initial=0)) // columns + 1)
    return GridBelief(grid, cells, np.asarray(event.probability, dtype=float))


@dataclass(slots=True)
class Handoffs:
    """What leaders chose from, and what it took to hand the belief over."""

    _neighbours: list[int] = field(default_factory=list)
    _payload_byte: list[int] = field(default_factory=list)
    _divergence_bit: list[float] = field(default_factory=list)
    _forms: Counter[str] = field(default_factory=Counter)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Handoff: self._on_handoff}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty without a hand-off."""
        if not self._neighbours:
            return {}
        lost_bit = math.fsum(self._divergence_bit) / len(self._divergence_bit)
        return {
            "handoffs": len(self._neighbours),
            "handoff_neighbours_mean": _mean(self._neighbours),
            "handoff_mean_byte": _mean(self._payload_byte),
            "handoff_max_byte": max(self._payload_byte),
            "handoff_divergence_mean_bit": lost_bit if math.isfinite(lost_bit) else None,
            "handoffs_by_form": dict(sorted(self._forms.items())),
        }

    def _on_handoff(self, event: Handoff, _: int) -> None:
        self._neighbours.append(len(event.candidate))
        self._payload_byte.append(int(event.payload_byte))
        self._divergence_bit.append(float(event.divergence_bit))
        self._forms[event.form] += 1


def _begun_ns(told: Sequence[tuple[int, int]]) -> dict[int, int]:
    """When each track was first heard of, from (track, time) in the order of time."""
    return {track: time_ns for track, time_ns in reversed(told)}


def _mean(values: Values) -> float | None:
    return math.fsum(values) / len(values) if values else None
