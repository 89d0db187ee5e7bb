"""A belief about a position as probabilities of the cells of a grid (Liu, Reich, Zhao 2002, section 2.3).

Only cells of nonzero probability are held. The steps of sequential Bayesian filtering (eq 3): `diffuse` is the integral over
the dynamics, `condition` the product with a likelihood, `pruned` drops cells of next to no probability.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve

from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

CellArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Grid:
    """Square cells, row by row from the lower left.

    Attributes:
        origin_m: Lower left corner of the first cell.
        cell_m: Side of a cell.
        columns: Cells along x.
        rows: Cells along y.
    """

    origin_m: tuple[float, float]
    cell_m: float
    columns: int
    rows: int

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def centres_m(self, cells: CellArray) -> FloatArray:
        """Centres of cells, shape (n, 2)."""
        rows, columns = np.divmod(cells, self.columns)
        centres_m: FloatArray = np.column_stack([columns + 0.5, rows + 0.5]) * self.cell_m + np.asarray(self.origin_m)
        return centres_m

    def cell_of(self, point_m: tuple[float, float]) -> int:
        """The cell a point lies in; the nearest one for a point outside."""
        column, row = (math.floor((x - x0) / self.cell_m) for x, x0 in zip(point_m, self.origin_m, strict=True))
        return min(max(row, 0), self.rows - 1) * self.columns + min(max(column, 0), self.columns - 1)


def grid_over(field_m: tuple[float, float, float, float], cell_m: float) -> Grid:
    """The smallest grid from the lower left corner of a field (low x, low y, high x, high y) that covers it."""
    low_x, low_y, high_x, high_y = field_m
    columns, rows = (max(1, math.ceil(extent / cell_m - 1e-9)) for extent in (high_x - low_x, high_y - low_y))
    return Grid((low_x, low_y), cell_m, columns, rows)


@dataclass(frozen=True, eq=False)
class GridBelief:
    """Probabilities of cells.

    Attributes:
        grid: The grid.
        cells: Numbers of the cells of nonzero probability, ascending, shape (n,), n at least 1.
        probability: Theirs; sums to one.
    """

    grid: Grid
    cells: CellArray
    probability: FloatArray

    @cached_property
    def centres_m(self) -> FloatArray:
        """Centres of the cells, shape (n, 2)."""
        return self.grid.centres_m(self.cells)

    @cached_property
    def mean_m(self) -> FloatArray:
        """The estimate of least mean squared error (eq 2), shape (2,)."""
        return np.asarray(self.probability @ self.centres_m)

    @cached_property
    def covariance_m2(self) -> FloatArray:
        """Covariance of the cell centres around the mean, shape (2, 2)."""
        offsets_m = self.centres_m - self.mean_m
        return np.asarray((offsets_m * self.probability[:, None]).T @ offsets_m)

    @property
    def variance_m2(self) -> float:
        """Mean squared distance from the mean, weighted by the probability: the spread of the belief (Tables 4 and 5)."""
        return float(np.trace(self.covariance_m2))

    @property
    def entropy_bit(self) -> float:
        """Entropy over the cells."""
        positive = self.probability[self.probability > 0.0]
        return float(-(positive * np.log2(positive)).sum())


def from_dense(grid: Grid, weights: FloatArray) -> GridBelief:
    """The belief proportional to weights of all cells, shape (rows, columns), of which one at least is above 0."""
    flat = weights.ravel()
    cells = np.flatnonzero(flat)
    return proportional(grid, cells, flat[cells])


def proportional(grid: Grid, cells: CellArray, weights: FloatArray) -> GridBelief:
    """The belief proportional to weights of some cells, ascending, without those that are too small for a probability."""
    probability = weights / weights.sum()
    kept = probability > 0.0
    return GridBelief(grid, cells, probability) if kept.all() else GridBelief(grid, cells[kept], probability[kept])


def uniform(grid: Grid, centre_m: tuple[float, float] | None = None, half_m: float = math.inf) -> GridBelief:
    """Equal probability of all cells, or of those whose centres lie in a square around a point.

    The cell of the point itself always belongs to it.
    """
    cells = np.arange(grid.size)
    if centre_m is not None:
        inside = np.all(np.abs(grid.centres_m(cells) - np.asarray(centre_m)) <= half_m, axis=1)
        inside[grid.cell_of(centre_m)] = True
        cells = cells[inside]
    return GridBelief(grid, cells, np.full(len(cells), 1.0 / len(cells)))


@lru_cache(maxsize=64)
def _disc(radius_cells: float) -> FloatArray:
    """1 in the cells of a square array whose centres lie within a distance of the middle one's."""
    reach = math.floor(radius_cells + 1e-9)
    offsets = np.arange(-reach, reach + 1)
    inside = np.hypot(offsets[:, None], offsets[None, :]) <= radius_cells + 1e-9
    return inside.astype(float)


def diffuse(belief: GridBelief, radius_m: float) -> GridBelief:
    """The belief after the target moved by at most `radius_m` in any direction, each place of the disc alike (eq 3).

    The kernel is the disc's cells: those whose centres lie within the radius. What would leave the grid is cut off.
    """
    disc = _disc(radius_m / belief.grid.cell_m)
    reach = len(disc) // 2
    if reach == 0:
        return belief
    grid = belief.grid
    rows, columns = np.divmod(belief.cells, grid.columns)
    low_row, low_column = max(int(rows.min()) - reach, 0), max(int(columns.min()) - reach, 0)
    high_row = min(int(rows.max()) + reach, grid.rows - 1)
    high_column = min(int(columns.max()) + reach, grid.columns - 1)
    window = np.zeros((high_row - low_row + 1, high_column - low_column + 1))
    window[rows - low_row, columns - low_column] = belief.probability
    spread = convolve(window, disc, mode="constant")
    found_rows, found_columns = np.nonzero(spread > 0.0)
    cells = (found_rows + low_row) * grid.columns + found_columns + low_column
    return proportional(grid, cells, spread[found_rows, found_columns])


def diffusion_operations(before: GridBelief, after: GridBelief, radius_m: float) -> int:
    """Elementary floating-point operations of `diffuse`.

    An addition for each cell of the disc around each cell of the belief before, a sum and a division for each cell after.
    """
    disc_cells = int(_disc(radius_m / before.grid.cell_m).sum())
    return 0 if disc_cells == 1 else disc_cells * len(before.cells) + 2 * len(after.cells)


def condition(belief: GridBelief, log_likelihood: FloatArray) -> tuple[GridBelief, float]:
    """The belief after a measurement, and the logarithm of the measurement's probability under the belief before.

    Args:
        belief: Before.
        log_likelihood: Of the measurement in each of the belief's cells, shape (n,); may be minus infinity.

    Returns:
        The belief after. Where the measurement is impossible everywhere it is the belief before, with minus infinity.
    """
    with np.errstate(divide="ignore"):
        logs = np.log(belief.probability) + log_likelihood
    top = float(logs.max())
    if not math.isfinite(top):
        return belief, -math.inf
    weights = np.exp(logs - top)
    kept = weights > 0.0
    after = proportional(belief.grid, belief.cells[kept], weights[kept])
    return after, top + math.log(float(weights[kept].sum()))


def update_operations(cells: int) -> int:
    """Elementary floating-point operations of `condition` and `pruned` for a belief of so many cells.

    A logarithm, an exponential, the search for the largest, sum, division and comparison for each; the likelihood is apart.
    """
    return (2 * FUNCTION_OPERATIONS + 5) * cells


def pruned(belief: GridBelief, least_probability: float) -> GridBelief:
    """Without the cells below a probability, the others scaled up; unchanged where none would be left."""
    kept = belief.probability >= least_probability
    if kept.all() or not kept.any():
        return belief
    probability = belief.probability[kept]
    return GridBelief(belief.grid, belief.cells[kept], probability / probability.sum())
