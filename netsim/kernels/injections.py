"""Partial injections: the ways in which some targets can share out a sensor's measurements.

A partial injection of `k` targets into `q` measurements is a tuple `(u_1, ..., u_k)` with `u_r = 0` for a missed
target, `u_r = a` for one that gave measurement `a - 1`, and no measurement used twice. Their canonical order is
lexicographic. Which measurements one uses is a bit mask, bit `a - 1` for measurement `a - 1`.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import comb, factorial, prod

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.kernels.semiring import FloatArray, Semiring, reduce

IntArray = NDArray[np.int64]

STATE_LIMIT = 5_000_000
"""Largest table a single vertex may build (entries); beyond it a problem is refused rather than left to fill memory."""


PAIR_LIMIT = 20_000_000
"""Most pairs of masks that the dynamic programme goes through to bring one group of targets in (some 0.3 s)."""

STORED_PAIRS = 1_000_000
"""Up to so many pairs their unions are kept (8 MB); beyond it they are made again, block by block, when needed."""

_BLOCK_PAIRS = 1 << 18


def count_pairs(targets: int, measurements: int) -> int:
    """Pairs of a mask of used measurements and one that `targets` targets can use."""
    return sum(comb(measurements, used) for used in range(min(targets, measurements) + 1)) << measurements


def count_injections(targets: int, measurements: int) -> int:
    """Number of partial injections: over the number used, choose targets, choose measurements, pair them."""
    used = range(min(targets, measurements) + 1)
    return sum(comb(targets, s) * comb(measurements, s) * factorial(s) for s in used)


def left_over(measurements: int) -> IntArray:
    """How many measurements each mask of used ones leaves over, shape (2^measurements,)."""
    check_states(1 << measurements, f"the table of used measurements of a sensor with {measurements}")
    masks = np.arange(1 << measurements)
    return measurements - sum((masks >> bit & 1 for bit in range(measurements)), np.zeros_like(masks))


def check_states(count: int, what: str, limit: int = STATE_LIMIT) -> None:
    """Refuse a table that is too large.

    Raises:
        ScenarioError: When `count` exceeds the limit.
    """
    if count > limit:
        text = f"{what} has {count} entries, more than the {limit} supported: use fewer targets or sensors there"
        raise ScenarioError(text)


@dataclass(frozen=True, eq=False)
class Injections:
    """All partial injections of some targets into some measurements, with what the mask dynamic programme needs.

    Attributes:
        states: Shape (n, targets), canonical order; entry 0 is missed, a is measurement a - 1.
        masks: Measurements used by each, shape (n,).
        used: How many measurements each uses, shape (n,).
        cells: Position of each in the flattened grid of all tuples, valid or not, shape (n,).
        grid: Shape of that grid, (q + 1,) a target.
        order: Permutation that sorts the states by mask, stable.
        starts: Where each mask begins in that order, shape (m,).
        distinct: The m masks, ascending.
        unions: For every mask S of used measurements (rows) and each of the m masks T (columns), the mask of both, or
            2^q where they overlap; shape (2^q, m). None when there are more than `STORED_PAIRS`.
        pairs: Its number of entries, kept or not.
    """

    states: IntArray
    masks: IntArray
    used: IntArray
    cells: IntArray
    grid: tuple[int, ...]
    order: IntArray
    starts: IntArray
    distinct: IntArray
    unions: IntArray | None
    pairs: int

    def by_mask(self, weights: FloatArray, semiring: Semiring) -> FloatArray:
        """Combine log weights of the states that use the same measurements, shape (m,)."""
        ordered = weights[self.order]
        peak = np.maximum.reduceat(ordered, self.starts)
        if semiring is Semiring.MAX:
            return np.asarray(peak)
        shift = np.where(np.isneginf(peak), 0.0, peak)
        lengths = np.diff(np.append(self.starts, len(ordered)))
        total = np.add.reduceat(np.exp(ordered - np.repeat(shift, lengths)), self.starts)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(total) + shift)

    def absorb(self, table: FloatArray, weights: FloatArray, semiring: Semiring) -> FloatArray:
        """Bring these targets into the dynamic programme.

        Args:
            table: Log weight of everything absorbed so far given that all others use the mask S, shape (2^q,).
            weights: Log weight of each state, shape (n,).
            semiring: How the states are combined.

        Returns:
            The same with these targets among the absorbed ones, shape (2^q,).
        """
        padded, by_mask = np.append(table, -np.inf), self.by_mask(weights, semiring)
        if self.unions is not None:
            return reduce(semiring, padded[self.unions] + by_mask, 1)
        rows, size = max(1, _BLOCK_PAIRS // len(self.distinct)), len(table)
        blocks = (np.arange(first, min(first + rows, size)) for first in range(0, size, rows))
        return np.concatenate(
            [reduce(semiring, padded[_unions(used, self.distinct, size)] + by_mask, 1) for used in blocks]
        )

    def on_grid(self, weights: FloatArray) -> FloatArray:
        """Log weights of the states on the grid of all tuples, -inf where a tuple uses a measurement twice."""
        dense = np.full(self.grid, -np.inf)
        dense.reshape(-1)[self.cells] = weights
        return dense

    def after(self, table: FloatArray, used_mask: int) -> FloatArray:
        """Value of a table once each state is added to a mask already used; -inf where they overlap. Shape (n,)."""
        return np.where(self.masks & used_mask, -np.inf, table[self.masks | used_mask])


def _states(targets: int, measurements: int) -> IntArray:
    check_states(count_injections(targets, measurements), "the joint association of targets shared by two sensors")
    states = np.zeros((1, 0), dtype=np.int64)
    choices = np.arange(measurements + 1)
    for _ in range(targets):
        clash = (states[:, None, :] == choices[None, :, None]).any(axis=2) & (choices > 0)[None, :]
        row, choice = np.nonzero(~clash)
        states = np.column_stack([states[row], choice])
    return states


def _unions(used: IntArray, masks: IntArray, none: int) -> IntArray:
    """For each pair the mask of both, `none` where they overlap; shape (used, masks)."""
    return np.where(used[:, None] & masks, none, used[:, None] | masks)


@lru_cache(maxsize=256)
def injections(targets: int, measurements: int) -> Injections:
    """All partial injections of `targets` targets into `measurements` measurements (arrays are read-only).

    Raises:
        ScenarioError: When they are too many to hold.
    """
    pairs = count_pairs(targets, measurements)
    check_states(pairs, f"the table of used measurements of a sensor with {measurements}", PAIR_LIMIT)
    states = _states(targets, measurements)
    masks = np.where(states > 0, 1 << np.maximum(states - 1, 0), 0).sum(axis=1)
    order = np.argsort(masks, kind="stable")
    distinct, starts = np.unique(masks[order], return_index=True)
    grid = (measurements + 1,) * targets
    check_states(prod(grid), "the joint association of targets shared by two sensors")
    cells = states @ np.array([prod(grid[axis + 1 :]) for axis in range(targets)], dtype=np.int64)
    unions = _unions(np.arange(1 << measurements), distinct, 1 << measurements) if pairs <= STORED_PAIRS else None
    used = (states > 0).sum(axis=1)
    made = Injections(states, masks, used, cells, grid, order, starts, distinct, unions, pairs)
    for array in (states, masks, used, cells, order, starts, distinct, *(() if unions is None else (unions,))):
        array.setflags(write=False)
    return made
