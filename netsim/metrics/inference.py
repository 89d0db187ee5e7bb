"""Inference: how many graph messages, how many rounds, and how far from the truth and from the exact answer."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from netsim.errors import NetsimError, ScenarioError
from netsim.kernels.assignment import best_assignment
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.metrics.marginals import divergence_nat, exact_marginals_of
from netsim.trace.events import Association, GraphMessages, Marginals, Problem, TruthOrigins, VariablePlacement
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

MOST_MEASUREMENTS_FOR_EXACT_MAP = 600
"""The integer programme takes a second at 70 measurements, some 20 s at 1,300."""

Decisions = Mapping[int, np.ndarray[Any, Any]]

SETTLED = 1e-12
"""Largest divergence between successive messages that counts as no change."""


class GraphTraffic:
    """Communication in the unit of the papers: messages between vertices of the graphical model."""

    def __init__(self) -> None:
        self._hosts: set[int] = set()
        self._sent: defaultdict[int, int] = defaultdict(int)
        self._remote = 0
        self._computed = 0
        self._control: defaultdict[int, int] = defaultdict(int)
        self._change: defaultdict[int, float] = defaultdict(float)
        self._synchronous = True
        self._last_news_ns = 0
        self._late: list[int] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {GraphMessages: self._on_messages, VariablePlacement: self._on_placement}

    def figures(self) -> dict[str, Any]:
        """The metrics; `per_sensor` divides by the nodes that host variables. Rounds only where they are synchronous."""
        if not self._sent:
            return {}
        total = sum(self._sent.values())
        figures = {
            "graph_messages": total,
            "graph_messages_per_sensor": total / len(self._hosts),
            "graph_messages_over_air": self._remote,
            "graph_messages_computed": self._computed,
            "last_news_s": self._last_news_ns / NS_PER_S,
        }
        if self._synchronous:
            return figures | self._by_round()
        return figures | self._until_convergence(None)

    def _by_round(self) -> dict[str, Any]:
        quiet = self._quiet_round()
        return {
            "graph_messages_by_round": [self._sent[number] for number in range(max(self._sent) + 1)],
            "rounds": max(self._sent),
            "converged_round": quiet,
            **self._until_convergence(quiet),
            "rounds_begun_late": len(self._late),
            "round_lateness_max_s": max(self._late, default=0) / NS_PER_S,
        }

    def _until_convergence(self, quiet: int | None) -> dict[str, Any]:
        """Messages a sensor up to a round, or all."""
        rounds = [number for number in self._sent if quiet is None or number <= quiet]
        until, control = sum(self._sent[number] for number in rounds), sum(self._control[number] for number in rounds)
        return {
            "graph_messages_until_convergence_per_sensor": until / len(self._hosts),
            "inference_messages_until_convergence_per_sensor": (until - control) / len(self._hosts),
        }

    def _quiet_round(self) -> int | None:
        """The round from which on nothing was sent, or nothing new; None when the last round still brought news."""
        last = max(self._sent)
        active = [
            number for number in self._sent if number > 0 and self._sent[number] > 0 and self._change[number] > SETTLED
        ]
        quiet = max(active, default=0) + 1
        return quiet if quiet <= last else None

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._hosts = set(map(int, event.host))

    def _on_messages(self, event: GraphMessages, now_ns: int) -> None:
        self._synchronous = self._synchronous and bool(event.is_synchronous)
        self._sent[event.round] += len(event.source)
        self._remote += int(sum(event.remote))
        self._computed += event.computed
        if event.computed == 0:
            self._control[event.round] += len(event.source)
        self._change[event.round] = max(self._change[event.round], event.largest_change)
        if event.late_ns > 0:
            self._late.append(event.late_ns)
        if len(event.source) and event.largest_change > SETTLED:
            self._last_news_ns = now_ns


class AssociationError:
    """Share of measurements associated with the wrong target, beside the exact and the independent decisions.

    The error counts all measurements, false alarms included (Chen et al. 2006, section VI-A); that of the measurements
    that come from a target is given too. The exact MAP and the node-independent decision are computed from the problem
    instance in the trace.
    """

    def __init__(self) -> None:
        self._instance: AssociationInstance | None = None
        self._origins: dict[int, np.ndarray[Any, Any]] = {}
        self._decisions: dict[int, dict[int, np.ndarray[Any, Any]]] = defaultdict(dict)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, TruthOrigins: self._on_origins, Association: self._on_association}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for another kind of problem."""
        if self._instance is None or not self._origins:
            return {}
        last = {node: rounds[max(rounds)] for node, rounds in self._decisions.items()}
        sensors = self._instance.sensor_nodes
        exact = _exact_map(self._instance)
        alone = {
            sensors[vertex.id]: vertex.decide_alone()
            for vertex in instance_vertices(self._instance)
            if isinstance(vertex, SensorVertex)
        }
        return {
            "measurements": int(sum(len(origin) for origin in self._origins.values())),
            "sensors_that_decided": len(last),
            "association_error": self._error(last),
            "association_error_target_originated": self._error(last, targets_only=True),
            "association_error_exact_map": self._error(exact),
            "association_error_independent": self._error(alone),
            "association_differs_from_exact_map": self._differs(last, exact),
            "association_error_by_round": self._by_round(),
        }

    def _by_round(self) -> list[float | None]:
        """The error after each round; a node that stopped deciding is taken at its last word."""
        numbers = sorted({number for rounds in self._decisions.values() for number in rounds})
        return [
            self._error(
                {
                    node: rounds[max(said)]
                    for node, rounds in self._decisions.items()
                    if (said := [other for other in rounds if other <= number])
                }
            )
            for number in numbers
        ]

    def _error(self, decisions: Decisions, targets_only: bool = False) -> float | None:
        """Over all measurements; those of a sensor that never decided count as wrong. None when no sensor decided.

        So do those of a sensor that decided about other measurements than it should have had (a fault).
        """
        wrong = total = 0
        for node, origin in self._origins.items():
            counted = origin >= 0 if targets_only else np.ones(len(origin), bool)
            total += int(counted.sum())
            decided = decisions.get(node)
            wrong += int((counted & _unequal(decided, origin)).sum())
        return wrong / total if total and decisions else None

    def _differs(self, first: Decisions, second: Decisions) -> float | None:
        both = [node for node in self._origins if node in first and node in second]
        pairs = [(np.asarray(first[node]), np.asarray(second[node])) for node in both]
        total = sum(len(one) for one, _ in pairs)
        return sum(int(_unequal(other, one).sum()) for one, other in pairs) / total if total else None

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "association":
            self._instance = AssociationInstance.from_json(event.content_json)

    def _on_origins(self, event: TruthOrigins, _: int) -> None:
        self._origins[event.node] = np.asarray(event.target)

    def _on_association(self, event: Association, _: int) -> None:
        self._decisions[event.node][event.round] = np.asarray(event.target)


def _unequal(decided: np.ndarray[Any, Any] | None, right: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Where a decision is not the right one: everywhere if there is none, or one about other measurements."""
    if decided is None or len(decided) != len(right):
        return np.ones(len(right), bool)
    return np.asarray(decided != right)


def _exact_map(instance: AssociationInstance) -> Decisions:
    """The exact MAP by sensor node; empty where the problem is too large for it, or has no possible association."""
    if sum(len(points) for points in instance.measurements_m) > MOST_MEASUREMENTS_FOR_EXACT_MAP:
        return {}
    try:
        return dict(zip(instance.sensor_nodes, best_assignment(instance).assignment, strict=True))
    except NetsimError:
        return {}


class MarginalError:
    """Distance of the hosts' marginals to the exact ones, where these can be computed.

    Max-product's beliefs are compared with the exact max-marginals, scaled to sum to one.
    """

    def __init__(self) -> None:
        self._problem: Problem | None = None
        self._beliefs: dict[int, np.ndarray[Any, Any]] = {}
        self._semiring = Semiring.SUM
        self._names: dict[int, str] = {}

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, Marginals: self._on_marginals, VariablePlacement: self._on_placement}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for another kind of problem, distances None where the exact answer is out of reach."""
        if self._problem is None or not self._beliefs:
            return {}
        beliefs = {self._names[variable]: belief.tolist() for variable, belief in sorted(self._beliefs.items())}
        try:
            exact = exact_marginals_of(self._problem.content_json, self._semiring)
        except ScenarioError:
            return {"marginals": beliefs, "marginal_error_linf": None, "marginal_error_kl_nat": None}
        worst = max(float(np.abs(self._beliefs[v] - exact[v]).max()) for v in self._beliefs)
        divergence = sum(divergence_nat(exact[v], self._beliefs[v]) for v in self._beliefs) / len(self._beliefs)
        return {
            "marginals": beliefs,
            "marginals_exact": {self._names[v]: exact[v].tolist() for v in sorted(self._beliefs)},
            "marginal_error_linf": worst,
            "marginal_error_kl_nat": divergence if np.isfinite(divergence) else None,
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "factor-graph":
            self._problem = event

    def _on_marginals(self, event: Marginals, _: int) -> None:
        self._beliefs[event.variable] = np.asarray(event.probability)
        self._semiring = Semiring.MAX if event.is_max else Semiring.SUM

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._names = dict(zip(map(int, event.variable), event.name, strict=True))
