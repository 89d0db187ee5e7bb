"""Target distribution: how wrong the numbers of targets are, and how wrong they would be without any communication."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.counting_exact import exact_counts
from netsim.kernels.counting_model import count_log_prior
from netsim.kernels.semiring import FloatArray
from netsim.kernels.target_distribution import DistributionInstance, Subregion
from netsim.trace.events import Marginals, Problem, TruthCounts
from netsim.trace.recorder import Handler

TIE = 1e-9
"""Probabilities closer than this to the largest one count as equal to it."""

Beliefs = Mapping[int, FloatArray]
Loss = Callable[[Subregion, int], FloatArray]
"""What each possible answer for a subregion with that true number costs, shape (counts,)."""


def _scaled(subregion: Subregion, count: int) -> FloatArray:
    """How far off, over the number of states (eq 20)."""
    return np.asarray(np.abs(np.array(subregion.counts, dtype=float) - count) / len(subregion.counts))


def _distance(subregion: Subregion, count: int) -> FloatArray:
    """How far off, in targets."""
    return np.asarray(np.abs(np.array(subregion.counts, dtype=float) - count))


def _wrong(subregion: Subregion, count: int) -> FloatArray:
    return np.array([float(other != count) for other in subregion.counts])


class CountError:
    """Error of the most probable numbers of targets, after the last round and before the first.

    Where several numbers are equally probable, each of them is taken as often: the first would be right too often where
    the window is cut at 0.
    """

    def __init__(self) -> None:
        self._instance: DistributionInstance | None = None
        self._truth: dict[int, int] = {}
        self._beliefs: dict[int, dict[int, FloatArray]] = {}
        self._is_max = False

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, TruthCounts: self._on_truth, Marginals: self._on_marginals}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for another kind of problem."""
        if self._instance is None or not self._truth:
            return {}
        prior = {each.vertex: count_log_prior(self._instance.model, each) for each in self._instance.subregions}
        start = {vertex: np.exp(log_belief) for vertex, log_belief in prior.items()}
        last = {vertex: rounds[max(rounds)] for vertex, rounds in self._beliefs.items()}
        told = start | last
        exact = self._exact(self._instance)
        return {
            "subregions": len(self._instance.subregions),
            "count_error": self._error(told, _scaled) if last else None,
            "count_error_wrong": self._error(told, _wrong) if last else None,
            "count_distance": self._error(told, _distance) if last else None,
            "count_distance_prior": self._error(start, _distance),
            "count_error_prior": self._error(start, _scaled),
            "count_error_prior_wrong": self._error(start, _wrong),
            "count_error_exact": self._error(exact, _scaled) if exact else None,
            "count_marginal_error_linf": _farthest(last, exact) if exact and last and not self._is_max else None,
            "count_error_by_round": self._by_round(start),
        }

    def _exact(self, instance: DistributionInstance) -> Beliefs:
        """The exact marginals; empty where they are out of reach."""
        try:
            found = exact_counts(instance)
        except ScenarioError:
            return {}
        return {each.vertex: np.exp(belief) for each, belief in zip(instance.subregions, found, strict=True)}

    def _error(self, beliefs: Beliefs, loss: Loss) -> float:
        """Mean over the subregions."""
        subregions = self._instance.subregions if self._instance is not None else ()
        return float(np.mean([_expected(beliefs[s.vertex], loss(s, self._truth[s.vertex])) for s in subregions]))

    def _by_round(self, start: Beliefs) -> list[float]:
        """After each round; what was not heard of yet stands at its prior."""
        numbers = sorted({number for rounds in self._beliefs.values() for number in rounds})
        told, errors = dict(start), []
        for number in numbers:
            told.update({vertex: rounds[number] for vertex, rounds in self._beliefs.items() if number in rounds})
            errors.append(self._error(told, _scaled))
        return errors

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "target-distribution":
            self._instance = DistributionInstance.from_json(event.content_json)

    def _on_truth(self, event: TruthCounts, _: int) -> None:
        self._truth = dict(zip(map(int, event.variable), map(int, event.count), strict=True))

    def _on_marginals(self, event: Marginals, _: int) -> None:
        if int(event.variable) in self._truth:
            self._beliefs.setdefault(event.variable, {})[event.round] = np.asarray(event.probability)
            self._is_max = bool(event.is_max)


def _farthest(beliefs: Beliefs, exact: Beliefs) -> float:
    """Largest absolute difference of a probability."""
    return max(float(np.abs(belief - exact[vertex]).max()) for vertex, belief in beliefs.items())


def _expected(belief: FloatArray, losses: FloatArray) -> float:
    """Mean loss of the most probable answers."""
    return float(losses[belief >= belief.max() - TIE].mean())
