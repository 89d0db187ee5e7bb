"""Sums over all matchings of measurements and events, exactly: number, partition function, association probabilities.

A feasible association event is a matching of the bipartite graph of measurements and events, and has the weight
prod w_jk over its edges, w_jk = alpha L_jk (Oh 2010, eqs 8 and 9). The sums go over the measurements one by one (or over the
events, whichever are more) and keep one number for every set of the other side that is taken already: 2^K numbers instead
of every matching. Components of the graph are independent and are summed each for itself.

Weights are arrays of shape (N, K), measurements by events, zero where a pair is not gated.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from netsim.errors import ScenarioError
from netsim.kernels.semiring import FloatArray

MOST_NUMBERS: Final = 50_000_000
"""Largest table: rows times 2^columns of a component (400 MB)."""

Table = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Component:
    """A connected part of the graph.

    Attributes:
        measurements: Its rows of the weights.
        events: Its columns.
    """

    measurements: NDArray[np.intp]
    events: NDArray[np.intp]


def components(weights: FloatArray) -> tuple[Component, ...]:
    """The connected parts that have an edge, in the order of their first measurements."""
    rows, columns = weights.shape
    j, k = np.nonzero(weights)
    graph = csr_array((np.ones(len(j)), (j, rows + k)), shape=(rows + columns, rows + columns))
    _, label = connected_components(graph, directed=False)
    parts = [np.flatnonzero(label == number) for number in dict.fromkeys(label[:rows].tolist())]
    found = [Component(part[part < rows], part[part >= rows] - rows) for part in parts]
    return tuple(part for part in found if len(part.events))


def table_size(weights: FloatArray) -> int:
    """Numbers in the largest table that the sums over these matchings need."""
    sizes = [sorted((len(part.measurements), len(part.events))) for part in components(weights)]
    return max((larger << smaller for smaller, larger in sizes), default=1)


def require_within_reach(weights: FloatArray) -> None:
    """Refuse what is too large.

    Raises:
        ScenarioError: When a component needs a table above `MOST_NUMBERS`.
    """
    size = table_size(weights)
    if size > MOST_NUMBERS:
        needed = f"{size:.3g}" if size < 1 << 1000 else f"2^{size.bit_length() - 1}"
        text = (
            f"exact association probabilities need a table of {needed} numbers, more than {MOST_NUMBERS:.3g}: "
            "use fewer events, or a narrower gate"
        )
        raise ScenarioError(text)


def count_matchings(weights: FloatArray) -> int:
    """Number of association events, the empty one included.

    Raises:
        ScenarioError: When it is out of reach.
    """
    require_within_reach(weights)
    total = 1
    for part in components(weights):
        table, _ = _all_rows((_tall(_block(weights, part)) > 0).astype(object))
        total *= int(table.sum())
    return total


def log_partition(weights: FloatArray) -> float:
    """Log Z(G), the sum of all association events' weights (Oh 2010, eq 9).

    Raises:
        ScenarioError: When it is out of reach.
    """
    require_within_reach(weights)
    total = 0.0
    for part in components(weights):
        table, log_scale = _all_rows(_tall(_block(weights, part)))
        total += log_scale + float(np.log(table.sum()))
    return total


def association_probabilities(weights: FloatArray) -> FloatArray:
    """The probability of every pair, beta_jk (Oh 2010, eq 2).

    Args:
        weights: Shape (N, K).

    Returns:
        Shape (N, K). What is missing to one in a column is the probability that the event has no measurement, in a row that
        the measurement is false.

    Raises:
        ScenarioError: When it is out of reach.
    """
    require_within_reach(weights)
    found = np.zeros(weights.shape)
    for part in components(weights):
        block = _block(weights, part)
        tall = _tall(block)
        probabilities = _tall_probabilities(tall)
        found[np.ix_(part.measurements, part.events)] = probabilities if tall.shape == block.shape else probabilities.T
    return found


def _block(weights: FloatArray, part: Component) -> FloatArray:
    return np.asarray(weights[np.ix_(part.measurements, part.events)], dtype=float)


def _tall(block: FloatArray) -> FloatArray:
    """With the smaller side as columns."""
    return block if block.shape[0] >= block.shape[1] else block.T


def _row_by_row(block: Table) -> Iterator[tuple[Table, float]]:
    """Before the first row and after each: the sums over what the rows so far do, by the set of columns they take.

    Yields:
        The table and the logarithm of what it is divided by, so that its largest number is 1; whole numbers stay what they
        are.
    """
    table, log_scale = np.zeros(1 << block.shape[1], dtype=block.dtype), 0.0
    table[0] = 1  # nothing taken yet, for certain
    yield table, log_scale
    for row in block:
        table = _with_row(table, row)
        if block.dtype != object:
            largest = table.max()
            table, log_scale = table / largest, log_scale + float(np.log(largest))
        yield table, log_scale


def _all_rows(block: Table) -> tuple[Table, float]:
    """What comes after the last row."""
    return deque(_row_by_row(block), maxlen=1)[0]


def _halves(table: Table, column: int) -> tuple[Table, Table]:
    """Views of the sets without a column and, in the same order, of those with it."""
    pairs = table.reshape(-1, 2, 1 << column)
    return pairs[:, 0], pairs[:, 1]


def _with_row(table: Table, row: Table) -> Table:
    """Sums over the ways in which the rows so far take exactly a set of columns, with one more row."""
    grown = table.copy()
    for column in np.flatnonzero(row):
        free, _ = _halves(table, int(column))
        _, taken = _halves(grown, int(column))
        taken += row[column] * free
    return grown


def _before_row(later: Table, row: Table) -> Table:
    """Sums over what a row and those after it may do when a set of columns is taken already."""
    grown = later.copy()
    for column in np.flatnonzero(row):
        _, taken = _halves(later, int(column))
        free, _ = _halves(grown, int(column))
        free += row[column] * taken
    return grown


def _tall_probabilities(block: FloatArray) -> FloatArray:
    """Forward and backward sums, each rescaled row by row; for every row both have one common scale."""
    tables = [table for table, _ in _row_by_row(block[:-1])]
    found = np.zeros(block.shape)
    later = np.ones(1 << block.shape[1])
    for number in reversed(range(len(block))):
        row, before = block[number], tables.pop()
        with_row = _before_row(later, row)
        total = float(before @ with_row)
        for column in np.flatnonzero(row):
            free, _ = _halves(before, int(column))
            _, taken = _halves(later, int(column))
            found[number, column] = row[column] * float((free * taken).sum()) / total
        later = with_row / with_row.max()
    return found
