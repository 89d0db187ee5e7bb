"""How far the probabilities of measurement-to-event association are from the exact ones, and what was certified."""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_bp import propagate
from netsim.kernels.event_association import EventAssociationInstance
from netsim.kernels.matchings import association_probabilities, count_matchings
from netsim.kernels.semiring import FloatArray
from netsim.trace.events import AlgorithmRecord, PairProbabilities, Problem
from netsim.trace.recorder import Handler

ROUNDING = 1e-9
"""An exact probability this little outside an interval is in it."""
_EXACT = 1 << 53
_LARGEST = 10**308

Told = Mapping[tuple[int, int], tuple[float, float, float]]
"""Probability, low and high of a measurement and an event."""


class PairError:
    """Reads the probabilities that owners of measurements state; of a measurement stated twice the last counts."""

    def __init__(self) -> None:
        self._instance: EventAssociationInstance | None = None
        self._told: dict[int, PairProbabilities] = {}
        self._sums: Counter[str] = Counter()
        self._most_open = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, PairProbabilities: self._on_pairs, AlgorithmRecord: self._on_record}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for another kind of problem."""
        if self._instance is None:
            return {}
        weights = self._instance.weights
        exact = _exact(weights)
        told = {
            (variable, int(event)): (float(p), float(low), float(high))
            for variable, each in self._told.items()
            for event, p, low, high in zip(each.event, each.probability, each.low, each.high, strict=True)
        }
        gated = set(zip(*(numbers.tolist() for numbers in np.nonzero(weights)), strict=True))
        return {
            "gated_pairs": len(gated),
            "gated_pairs_told_share": len(gated & told.keys()) / len(gated) if gated else None,
            "matchings": None if exact is None else _number(count_matchings(weights)),
            "pair_error_bp_linf": None if exact is None else _farthest(propagate(weights).probabilities, exact),
            **_errors(told, exact),
            **_widths(told),
            "decay_depth": max((int(each.depth) for each in self._told.values()), default=None),
            "decay_depth_mean": float(np.mean([each.depth for each in self._told.values()])) if self._told else None,
            **self._work(),
        }

    def _work(self) -> dict[str, Any]:
        if not self._sums["nodes"]:
            return {}
        return {
            "reports_passed_on": self._sums["passed_on"],
            "reports_heard_mean": self._sums["reports"] / self._sums["nodes"],
            "reports_asked_for": self._sums["asked"],
            "flood_neighbours_given_up": self._sums["given_up"],
            "factor_requests": self._sums["factor_requests"],
            "factors_stood_in": self._sums["factors_stood_in"],
            "factor_requests_open": self._most_open,
            "events_incomplete_share": (
                self._sums["events_incomplete"] / self._sums["events"] if self._sums["events"] else None
            ),
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "event-association":
            self._instance = EventAssociationInstance.from_json(event.content_json)

    def _on_pairs(self, event: PairProbabilities, _: int) -> None:
        self._told[int(event.variable)] = event

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == "correlation_decay":
            fields = json.loads(event.fields_json)
            self._most_open = max(self._most_open, fields.pop("factor_requests_open"))
            self._sums.update(fields)
            self._sums["nodes"] += 1


def _exact(weights: FloatArray) -> FloatArray | None:
    """The exact probabilities; None where they are out of reach."""
    try:
        return association_probabilities(weights)
    except ScenarioError:
        return None


def _number(count: int) -> float | None:
    """A count as tables can hold it: exactly below 2^53, rounded above, None where no float is as large."""
    if count < _EXACT:
        return count
    return float(count) if count < _LARGEST else None


def _farthest(found: FloatArray, exact: FloatArray) -> float:
    return float(np.abs(found - exact).max(initial=0.0))


def _errors(told: Told, exact: FloatArray | None) -> dict[str, Any]:
    """Against the exact probabilities, over the pairs that were told of."""
    if exact is None or not told:
        return {"pair_error_linf": None, "pair_error_mean": None, "interval_misses": None}
    errors = [abs(p - exact[pair]) for pair, (p, _, _) in told.items()]
    misses = sum(not low - ROUNDING <= exact[pair] <= high + ROUNDING for pair, (_, low, high) in told.items())
    return {
        "pair_error_linf": float(max(errors)),
        "pair_error_mean": float(np.mean(errors)),
        "interval_misses": misses,
    }


def _widths(told: Told) -> dict[str, Any]:
    widths = [
        max(0.0, high - low) for _, low, high in told.values()
    ]  # rounding may turn an interval of one point round
    return {
        "interval_width_max": max(widths) if widths else None,
        "interval_width_mean": float(np.mean(widths)) if widths else None,
    }
