"""Tracking: how far estimates are from the targets, whom the tracks follow, and whether they know.

All figures are functions of what the trace says: `TruthTargets`, `Estimate` (its `target` is the number of a track, one for
the whole network, whichever node speaks for it) and `Identity`. See `docs/metrics.md` for the definitions.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from netsim.kernels.consistency import nees, nees_interval
from netsim.kernels.semiring import FloatArray
from netsim.kernels.set_distance import gospa, match, ospa
from netsim.metrics.following import Following
from netsim.metrics.tracks import CUT_OFF_M, Fix, TargetTruth, TrackHistory, as_array, cut_off_of
from netsim.trace.events import Estimate, Identity, Problem, TruthTargets
from netsim.trace.recorder import Handler
from netsim.units import s_to_ns

ORDER: Final = 2.0
"""Order p of OSPA and GOSPA: 2 weighs errors as a root mean square does."""
STEP_S: Final = 1.0
"""Time between the samples of sets of tracks."""
HOLD_S: Final = 5.0
"""How long an estimate speaks for its track: several times the usual second between estimates, so that one that is late
does not end the track. A target without a track for so long is lost."""
CONFIDENCE: Final = 0.95
"""Of the interval for the mean NEES."""


@dataclass(slots=True)
class _Errors:
    """What the single estimates add up to: errors of those that follow a target."""

    metres: list[float] = field(default_factory=list)
    nees: list[float] = field(default_factory=list)
    unassigned: int = 0


class Tracking:
    """Scores tracks against targets.

    Args:
        cut_off_m: Distance from which on a track does not follow a target, unless the problem says another one; also the c
            of OSPA and GOSPA.
    """

    def __init__(self, cut_off_m: float = CUT_OFF_M) -> None:
        self._cut_off_m = cut_off_m
        self._truth = TargetTruth()
        self._tracks = TrackHistory(HOLD_S)
        self._identities: list[tuple[int, int, FloatArray]] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            Problem: self._on_problem,
            TruthTargets: self._truth.add,
            Estimate: self._on_estimate,
            Identity: self._on_identity,
        }

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where nobody estimated anything, or there are no targets."""
        if not self._tracks.fixes or self._truth.is_empty:
            return {}
        return self._single() | self._sets() | self._identity()

    def _on_problem(self, event: Problem, _: int) -> None:
        self._cut_off_m = cut_off_of(event, self._cut_off_m)

    def _on_estimate(self, event: Estimate, now_ns: int) -> None:
        x_m, y_m = float(event.x_m), float(event.y_m)
        if math.isfinite(x_m) and math.isfinite(y_m):
            xx, xy, yy = map(float, event.covariance_m2) if len(event.covariance_m2) == 3 else (math.nan,) * 3
            covariance_m2 = None if math.isnan(xx + xy + yy) else (xx, xy, yy)
            self._tracks.fixes.append(Fix(now_ns, event.target, (x_m, y_m), covariance_m2))

    def _on_identity(self, event: Identity, now_ns: int) -> None:
        self._identities.append((now_ns, event.track, np.asarray(event.probability, dtype=float)))

    def _single(self) -> dict[str, Any]:
        errors = _Errors()
        times_ns = sorted({fix.time_ns for fix in self._tracks.fixes})
        for time_ns, tracks in self._tracks.at_each(times_ns):
            whom = self._followed(tracks)
            for fix in tracks.values():
                if fix.time_ns == time_ns:
                    self._take(errors, fix, whom.get(fix.track))
        count = len(errors.metres)
        low, high = nees_interval(len(errors.nees), 2, CONFIDENCE) if errors.nees else (None, None)
        return {
            "estimates": count + errors.unassigned,
            "estimates_unassigned": errors.unassigned,
            "position_error_mean_m": math.fsum(errors.metres) / count if count else None,
            "position_error_rms_m": _rms(errors.metres),
            "position_error_max_m": max(errors.metres, default=None),
            "nees_estimates": len(errors.nees),
            "nees_mean": math.fsum(errors.nees) / len(errors.nees) if errors.nees else None,
            "nees_mean_low": low,
            "nees_mean_high": high,
        }

    def _take(self, errors: _Errors, fix: Fix, target: int | None) -> None:
        if target is None:
            errors.unassigned += 1
            return
        error = np.subtract(fix.place_m, self._truth.at(fix.time_ns)[target])
        errors.metres.append(float(np.hypot(*error)))
        if fix.covariance_m2 is not None:
            xx, xy, yy = fix.covariance_m2
            squared = nees(error, np.array([[xx, xy], [xy, yy]]))
            if squared is not None:
                errors.nees.append(squared)

    def _followed(self, tracks: Mapping[int, Fix]) -> dict[int, int]:
        """The target that each track follows: an optimal assignment, each estimate against the truth at its own instant."""
        truths = [self._truth.at(fix.time_ns) for fix in tracks.values()]
        targets = sorted(set().union(*truths))
        nowhere = (math.inf, math.inf)
        there = np.array([[truth.get(target, nowhere) for target in targets] for truth in truths], dtype=float)
        if not targets:
            return {}
        places = as_array(fix.place_m for fix in tracks.values())
        distance = np.linalg.norm(there - places[:, None, :], axis=2)
        numbers = list(tracks)
        return {numbers[row]: targets[column] for row, column in match(distance, self._cut_off_m, ORDER)}

    def _sample_times_ns(self) -> Iterator[int]:
        """Every step after the first estimate, so that all may have spoken once, and the last instant of all."""
        end_ns = max(self._truth.last_ns, self._tracks.fixes[-1].time_ns)
        step_ns = s_to_ns(STEP_S)
        yield from range(self._tracks.fixes[0].time_ns + step_ns, end_ns, step_ns)
        yield end_ns

    def _sets(self) -> dict[str, Any]:
        following = Following(self._cut_off_m, ORDER, HOLD_S)
        distances_m: list[float] = []
        parts: list[tuple[float, float, float]] = []
        for time_ns, tracks in self._tracks.at_each(self._sample_times_ns()):
            truth = self._truth.at(time_ns)
            found = {track: fix.place_m for track, fix in tracks.items()}
            sets = as_array(truth.values()), as_array(found.values())
            distances_m.append(ospa(*sets, self._cut_off_m, ORDER))
            whole = gospa(*sets, self._cut_off_m, ORDER)
            parts.append((whole.localisation, whole.missed, whole.false))
            following.sample(time_ns, truth, found)
        localisation, missed, false = (math.fsum(column) / len(parts) for column in zip(*parts, strict=True))
        return {
            "ospa_mean_m": math.fsum(distances_m) / len(distances_m),
            "ospa_last_m": distances_m[-1],
            "gospa_rms_m": math.sqrt(localisation + missed + false),
            "gospa_localisation_rms_m": math.sqrt(localisation),
            "gospa_missed_rms_m": math.sqrt(missed),
            "gospa_false_rms_m": math.sqrt(false),
        } | following.figures()

    def _identity(self) -> dict[str, Any]:
        if not self._identities:
            return {}
        right: list[bool] = []
        chances: list[float] = []
        last: dict[int, float] = {}
        told = iter(self._identities)
        pictures = self._tracks.at_each(time_ns for time_ns, _, _ in self._identities)
        for (_, tracks), (_, track, probability) in zip(pictures, told, strict=True):
            target = self._followed(tracks).get(track)
            if target is not None:
                known = target < len(probability)
                right.append(known and int(np.argmax(probability)) == target)
                chances.append(float(probability[target]) if known else 0.0)
                last[track] = chances[-1]
        return {
            "identities": len(self._identities),
            "identity_accuracy": sum(right) / len(right) if right else None,
            "identity_probability_mean": math.fsum(chances) / len(chances) if chances else None,
            "identity_probability_last": math.fsum(last.values()) / len(last) if last else None,
        }


def _rms(values: list[float]) -> float | None:
    return math.sqrt(math.fsum(value * value for value in values) / len(values)) if values else None
