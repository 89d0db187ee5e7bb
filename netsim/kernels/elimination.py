"""Variable elimination and the junction tree it implies, on log tables in either semiring."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from netsim.kernels.semiring import FloatArray, Semiring, reduce

Table = tuple[tuple[int, ...], FloatArray]
"""Variables, and a log table with one axis for each."""


def elimination_order(tables: Sequence[Table]) -> list[int]:
    """An order that keeps tables small: next the variable with fewest edges to fill in, of equals the lowest."""
    links = _links(tables)
    order = []
    while links:
        best = min(links, key=lambda variable: (_fill(links, variable), variable))
        order.append(best)
        around = links.pop(best)
        for other in around:
            links[other] = (links[other] | around) - {best, other}
    return order


def _links(tables: Sequence[Table]) -> dict[int, set[int]]:
    links: dict[int, set[int]] = {}
    for scope, _ in tables:
        for variable in scope:
            links.setdefault(variable, set()).update(set(scope) - {variable})
    return links


def _fill(links: dict[int, set[int]], variable: int) -> int:
    """Twice the number of edges that eliminating a variable would add."""
    around = links[variable]
    return sum(len(around - links[other]) - 1 for other in around)


def largest_table(tables: Sequence[Table], order: Sequence[int]) -> float:
    """Entries of the largest table that elimination in this order builds."""
    sizes = {variable: size for scope, table in tables for variable, size in zip(scope, table.shape, strict=True)}
    links, widest = _links(tables), 1.0
    for variable in order:
        around = links.pop(variable)
        widest = max(widest, float(np.prod([float(sizes[other]) for other in {variable, *around}])))
        for other in around:
            links[other] = (links[other] | around) - {variable, other}
    return widest


def expand(table: Table, scope: Sequence[int]) -> FloatArray:
    """A table with its axes in the order of a larger scope, of length 1 where it has none."""
    present = [variable for variable in scope if variable in table[0]]
    ordered = np.transpose(table[1], [table[0].index(variable) for variable in present])
    shape = [table[1].shape[table[0].index(variable)] if variable in table[0] else 1 for variable in scope]
    return ordered.reshape(shape)


def multiply(tables: Sequence[Table]) -> Table:
    """The product of log tables over the union of their variables, ascending."""
    scope = tuple(sorted({variable for variables, _ in tables for variable in variables}))
    total: FloatArray = np.zeros(())
    for table in tables:
        total = total + expand(table, scope)
    return scope, total


def _project(table: Table, keep: Sequence[int], semiring: Semiring) -> Table:
    """Combine all variables but some."""
    axes = tuple(axis for axis, variable in enumerate(table[0]) if variable not in keep)
    return tuple(variable for variable in table[0] if variable in keep), reduce(semiring, table[1], axes)


def eliminate(tables: Sequence[Table], order: Sequence[int], semiring: Semiring) -> tuple[list[Table], float]:
    """Combine all variables away, one after another.

    Args:
        tables: The factors; every variable occurs.
        order: All variables, in the order of elimination.
        semiring: How states are combined.

    Returns:
        For each variable the product it was eliminated from, and the log of what is left: the partition function or the
        best score.
    """
    left, products = list(tables), []
    for variable in order:
        products.append(multiply([table for table in left if variable in table[0]]))
        left = [table for table in left if variable not in table[0]]
        left.append(_project(products[-1], _without(products[-1][0], variable), semiring))
    return products, sum(float(table) for _, table in left)


def _without(scope: Sequence[int], variable: int) -> tuple[int, ...]:
    return tuple(other for other in scope if other != variable)


@dataclass(frozen=True, slots=True)
class _Clique:
    """The tables met when a variable was eliminated, where they came from, and where the result went.

    Attributes:
        parts: Tables, each with the variable whose elimination made it; None for a factor.
        separator: Variables of the result.
        parent: The variable it met next; None when it had no variables left.
    """

    parts: list[tuple[int | None, Table]]
    separator: tuple[int, ...]
    parent: int | None


def marginals(tables: Sequence[Table], order: Sequence[int], semiring: Semiring) -> dict[int, FloatArray]:
    """(Max-)marginals of all variables, log domain, not normalised: elimination inward, then messages outward.

    Args:
        tables: The factors; every variable occurs in one of its own at least.
        order: All variables, in the order of elimination.
        semiring: How states are combined.
    """
    cliques = _inward(tables, order, semiring)
    answers: dict[int, FloatArray] = {}
    for variable in reversed(order):
        clique = cliques[variable]
        if clique.parent is not None:
            parent = cliques[clique.parent]
            others = [table for sender, table in parent.parts if sender != variable]
            clique.parts.append((clique.parent, _project(multiply(others), clique.separator, semiring)))
        product = multiply([table for _, table in clique.parts])
        answers[variable] = _project(product, (variable,), semiring)[1]
    return answers


def _inward(tables: Sequence[Table], order: Sequence[int], semiring: Semiring) -> dict[int, _Clique]:
    pending: list[tuple[int | None, Table]] = [(None, table) for table in tables]
    place = {variable: position for position, variable in enumerate(order)}
    cliques = {}
    for variable in order:
        parts = [entry for entry in pending if variable in entry[1][0]]
        pending = [entry for entry in pending if variable not in entry[1][0]]
        product = multiply([table for _, table in parts])
        separator = _without(product[0], variable)
        cliques[variable] = _Clique(parts, separator, min(separator, key=place.__getitem__) if separator else None)
        pending.append((variable, _project(product, separator, semiring)))
    return cliques
