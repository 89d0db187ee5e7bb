"""Pairwise models with random potentials on a chain, a tree or a grid."""

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge

from netsim.kernels.factor_graph import Factor, FactorGraph
from netsim.parameters import NonNegative, PositiveInt, parameters

States = Annotated[int, Ge(2)]


@parameters
class ChainGraph:
    """A chain of variables with random potentials."""

    type: Literal["chain"] = "chain"
    """Where the model comes from."""
    variables: PositiveInt = 10
    """How many variables."""
    states: States = 2
    """States of each variable."""
    coupling_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each pair of states of neighbours."""
    field_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each state of a variable."""


@parameters
class TreeGraph:
    """A random tree with random potentials: each variable joins one of those before it."""

    type: Literal["tree"] = "tree"
    """Where the model comes from."""
    variables: PositiveInt = 10
    """How many variables."""
    states: States = 2
    """States of each variable."""
    coupling_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each pair of states of neighbours."""
    field_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each state of a variable."""


@parameters
class GridGraph:
    """A grid of variables with random potentials, rows and columns joined to the next."""

    type: Literal["grid"] = "grid"
    """Where the model comes from."""
    rows: PositiveInt = 5
    """How many rows."""
    columns: PositiveInt = 5
    """How many columns."""
    states: States = 2
    """States of each variable."""
    coupling_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each pair of states of neighbours."""
    field_sd: NonNegative = 1.0
    """Standard deviation of the normal log potential of each state of a variable."""


DrawnGraph = ChainGraph | TreeGraph | GridGraph


def draw_graph(parameters: DrawnGraph, rng: np.random.Generator) -> FactorGraph:
    """A pairwise model with normal log potentials: a factor a variable, then one an edge.

    Args:
        parameters: Shape and strength.
        rng: Random stream.
    """
    count, pairs = _shape(parameters, rng)
    states = parameters.states
    unary = np.exp(parameters.field_sd * rng.standard_normal((count, states)))
    coupling = np.exp(parameters.coupling_sd * rng.standard_normal((len(pairs), states, states)))
    fields = [Factor((variable,), table) for variable, table in enumerate(unary)]
    edges = [Factor(pair, table) for pair, table in zip(pairs, coupling, strict=True)]
    return FactorGraph((states,) * count, (*fields, *edges))


def _shape(parameters: DrawnGraph, rng: np.random.Generator) -> tuple[int, list[tuple[int, int]]]:
    """Number of variables, and the edges with the lower variable first."""
    if isinstance(parameters, GridGraph):
        rows, columns = parameters.rows, parameters.columns
        index = np.arange(rows * columns).reshape(rows, columns)
        along = np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()])
        down = np.column_stack([index[:-1].ravel(), index[1:].ravel()])
        return rows * columns, [(int(a), int(b)) for a, b in np.vstack([along, down])]
    if isinstance(parameters, ChainGraph):
        return parameters.variables, [(i, i + 1) for i in range(parameters.variables - 1)]
    return parameters.variables, [(int(rng.integers(i)), i) for i in range(1, parameters.variables)]
