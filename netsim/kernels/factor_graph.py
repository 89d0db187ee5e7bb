"""Factor graphs of discrete variables: the record, its exact answers, and its vertices for message passing."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.elimination import Table, eliminate, elimination_order, largest_table, marginals
from netsim.kernels.factor_vertices import FactorVertex, VariableVertex
from netsim.kernels.pairwise_vertex import PairwiseVertex
from netsim.kernels.semiring import FloatArray, Semiring, log_normalise
from netsim.kernels.vertex import Vertex

STATE_SPACE_LIMIT = 2_000_000
"""Largest table, in entries, that exact inference builds unless told otherwise."""


@dataclass(frozen=True, eq=False)
class Factor:
    """A non-negative function of a few variables.

    Attributes:
        scope: Its variables, each once.
        table: Its values, one axis a variable in the order of `scope`; not logarithms.
    """

    scope: tuple[int, ...]
    table: FloatArray

    @cached_property
    def log_table(self) -> FloatArray:
        """Logarithm of the table; -inf for zeros."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.table))


@dataclass(frozen=True, eq=False)
class FactorGraph:
    """A distribution proportional to a product of factors.

    Attributes:
        cardinalities: Number of states of variables 0, 1, ...
        factors: The factors.

    Raises:
        ScenarioError: For a factor whose table does not fit its variables or is negative or not finite.
    """

    cardinalities: tuple[int, ...]
    factors: tuple[Factor, ...]

    def __post_init__(self) -> None:
        for index, factor in enumerate(self.factors):
            wrong = self._fault(factor)
            if wrong:
                text = f"factor {index}: {wrong}"
                raise ScenarioError(text)

    def _fault(self, factor: Factor) -> str:
        if len(set(factor.scope)) != len(factor.scope) or not set(factor.scope) <= set(range(len(self.cardinalities))):
            return f"expected distinct variables below {len(self.cardinalities)}, got {factor.scope}"
        shape = tuple(self.cardinalities[variable] for variable in factor.scope)
        if factor.table.shape != shape:
            return f"expected a table of shape {shape}, got {factor.table.shape}"
        if not np.isfinite(factor.table).all() or (factor.table < 0).any():
            return "expected finite values of 0 or more"
        return ""

    def log_score(self, states: Sequence[int]) -> float:
        """Log of the product of all factors at one joint state."""
        return sum(float(f.log_table[tuple(states[variable] for variable in f.scope)]) for f in self.factors)


def _tables(graph: FactorGraph) -> list[Table]:
    """Log factors, and a factor of ones for every variable so that each one occurs."""
    ones = [((variable,), np.zeros(states)) for variable, states in enumerate(graph.cardinalities)]
    return [(factor.scope, factor.log_table) for factor in graph.factors] + ones


def _order(graph: FactorGraph, limit: int) -> list[int]:
    """Elimination order, checked."""
    tables = _tables(graph)
    order = elimination_order(tables)
    widest = largest_table(tables, order)
    if widest > limit:
        text = (
            f"exact inference needs a table of {widest:.3g} entries, more than the limit of {limit}: use a smaller or "
            "more tree-like graph, or raise state_space_limit"
        )
        raise ScenarioError(text)
    return order


def exact_marginals(
    graph: FactorGraph, semiring: Semiring, state_space_limit: int = STATE_SPACE_LIMIT
) -> list[FloatArray]:
    """Exact (max-)marginals of every variable, log domain and normalised, by variable elimination.

    Args:
        graph: The model.
        semiring: Sum for marginals, max for max-marginals.
        state_space_limit: Largest table that may be built.

    Raises:
        ScenarioError: When a table would exceed the limit, or the factors contradict one another.
    """
    found = marginals(_tables(graph), _order(graph, state_space_limit), semiring)
    return [log_normalise(found[variable]) for variable in range(len(graph.cardinalities))]


def log_partition(graph: FactorGraph, state_space_limit: int = STATE_SPACE_LIMIT) -> float:
    """Log of the sum over all joint states of the product of all factors.

    Raises:
        ScenarioError: When a table would exceed the limit.
    """
    return eliminate(_tables(graph), _order(graph, state_space_limit), Semiring.SUM)[1]


def most_probable(graph: FactorGraph, state_space_limit: int = STATE_SPACE_LIMIT) -> tuple[tuple[int, ...], float]:
    """A joint state of highest probability and its `FactorGraph.log_score`.

    Elimination backwards settles equal values in the order of elimination for the first state.

    Raises:
        ScenarioError: When a table would exceed the limit, or no state is possible.
    """
    order = _order(graph, state_space_limit)
    products, best_log = eliminate(_tables(graph), order, Semiring.MAX)
    log_normalise(np.array([best_log]))
    states: dict[int, int] = {}
    for variable, (scope, product) in zip(reversed(order), reversed(products), strict=True):
        index = tuple(slice(None) if other == variable else states[other] for other in scope)
        states[variable] = int(np.argmax(product[index]))
    best = tuple(states[variable] for variable in range(len(graph.cardinalities)))
    return best, graph.log_score(best)


def vertices_of(graph: FactorGraph, form: Literal["pairwise", "factor"]) -> list[Vertex]:
    """The graph's vertices for message passing, ascending.

    Args:
        graph: The model.
        form: `factor`: variables are vertices 0 .. n-1 and factors n .. n+m-1. `pairwise`: variables alone, unary
            factors in their node potentials and factors of two in the edges (several on one pair multiplied).

    Raises:
        ScenarioError: For `pairwise` with a factor of three or more variables.
    """
    return _pairwise(graph) if form == "pairwise" else _bipartite(graph)


def _bipartite(graph: FactorGraph) -> list[Vertex]:
    count = len(graph.cardinalities)
    occurs: list[list[int]] = [[] for _ in range(count)]
    for index, factor in enumerate(graph.factors):
        for variable in factor.scope:
            occurs[variable].append(count + index)
    variables = [VariableVertex(v, states, occurs[v]) for v, states in enumerate(graph.cardinalities)]
    factors = [FactorVertex(count + i, factor.scope, factor.log_table) for i, factor in enumerate(graph.factors)]
    return [*variables, *factors]


def _pairwise(graph: FactorGraph) -> list[Vertex]:
    nodes = [np.zeros(states) for states in graph.cardinalities]
    edges: list[dict[int, FloatArray]] = [{} for _ in nodes]
    for index, factor in enumerate(graph.factors):
        if len(factor.scope) > 2:
            text = f"factor {index} has {len(factor.scope)} variables: the pairwise form takes at most 2, use `factor`"
            raise ScenarioError(text)
        if len(factor.scope) == 1:
            nodes[factor.scope[0]] = nodes[factor.scope[0]] + factor.log_table
        elif factor.scope:
            a, b = factor.scope
            edges[a][b] = edges[a].get(b, 0.0) + factor.log_table
            edges[b][a] = edges[b].get(a, 0.0) + factor.log_table.T
    return [PairwiseVertex(variable, node, edges[variable]) for variable, node in enumerate(nodes)]
