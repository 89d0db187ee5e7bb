"""Parametric stand-ins for a belief on a grid: normal distributions and mixtures (Liu, Reich, Zhao 2002, section 6).

A fitted distribution becomes a belief again by its density at the centres of the cells, so that the receiver filters on as
with any other belief.
"""

import math
from dataclasses import dataclass

import numpy as np

from netsim.kernels.grid_belief import Grid, GridBelief
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

LEAST_SD_CELLS = 0.3
"""No axis of a fitted distribution is narrower than this, in cells: a belief in one cell has no covariance."""
LEAST_SHARE = 1e-12
"""Cells below this share of the likeliest one are cut off."""
STEPS = 30
"""Steps of expectation and maximisation."""
_DENSITY_OPERATIONS = 15 + FUNCTION_OPERATIONS


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of normal distributions of the plane.

    Attributes:
        weights: Shape (k,), sums to one.
        means_m: Shape (k, 2).
        covariances_m2: xx, xy, yy of each, shape (k, 3), positive definite.
    """

    weights: FloatArray
    means_m: FloatArray
    covariances_m2: FloatArray

    def log_densities(self, points_m: FloatArray) -> FloatArray:
        """Logarithm of each component's density times its weight at points of shape (n, 2): shape (k, n)."""
        offsets_m = points_m[None, :, :] - self.means_m[:, None, :]
        xx, xy, yy = self.covariances_m2.T[:, :, None]
        determinant = xx * yy - xy**2
        dx, dy = offsets_m[..., 0], offsets_m[..., 1]
        squared = (yy * dx**2 - 2.0 * xy * dx * dy + xx * dy**2) / determinant
        with np.errstate(divide="ignore"):
            return np.asarray(
                np.log(self.weights)[:, None] - 0.5 * (squared + np.log(determinant)) - math.log(2.0 * math.pi)
            )


def fitted(belief: GridBelief, components: int) -> Mixture:
    """The mixture of so many components nearest to a belief: moments for one, expectation-maximisation for more.

    It begins with the belief cut into parts of equal probability along its first principal axis; nothing is drawn.
    """
    points_m, weights = belief.centres_m, belief.probability
    first_axis = np.linalg.eigh(belief.covariance_m2)[1][:, -1]
    along = (points_m - belief.mean_m) @ first_axis
    order = np.argsort(along, kind="stable")
    reached = np.empty(len(along))
    reached[order] = np.cumsum(weights[order]) - 0.5 * weights[order]
    part = np.minimum((reached * components).astype(np.int64), components - 1)
    shares = (part[None, :] == np.arange(components)[:, None]) * weights
    mixture = _maximised(points_m, shares, belief.grid.cell_m)
    for _ in range(STEPS if components > 1 else 0):
        logs = mixture.log_densities(points_m)
        shares = np.exp(logs - logs.max(axis=0))
        mixture = _maximised(points_m, shares / shares.sum(axis=0) * weights, belief.grid.cell_m)
    return mixture


def _maximised(points_m: FloatArray, shares: FloatArray, cell_m: float) -> Mixture:
    """Weights, means and covariances of the shares of each component in the points' weights, shape (k, n)."""
    shares = shares[shares.sum(axis=1) > 1e-9]
    mass = shares.sum(axis=1)
    means_m = shares @ points_m / mass[:, None]
    offsets_m = points_m[None, :, :] - means_m[:, None, :]
    moments = np.einsum("kn,kni,knj->kij", shares, offsets_m, offsets_m) / mass[:, None, None]
    values, axes = np.linalg.eigh(moments)
    values = np.maximum(values, (LEAST_SD_CELLS * cell_m) ** 2)
    moments = np.einsum("kij,kj,klj->kil", axes, values, axes)
    covariances_m2 = np.column_stack([moments[:, 0, 0], moments[:, 0, 1], moments[:, 1, 1]])
    return Mixture(mass / mass.sum(), means_m, covariances_m2)


def on_grid(mixture: Mixture, grid: Grid) -> GridBelief:
    """The belief that a mixture stands for: its density at the cells' centres, scaled to sum to one."""
    cells = np.arange(grid.size)
    logs = np.logaddexp.reduce(mixture.log_densities(grid.centres_m(cells)), axis=0)
    weights = np.exp(logs - logs.max())
    kept = weights >= LEAST_SHARE
    return GridBelief(grid, cells[kept], weights[kept] / weights[kept].sum())


def divergence_bit(belief: GridBelief, other: GridBelief) -> float:
    """Kullback-Leibler divergence D(belief || other) in bits; infinite where the other rules out what it does not."""
    there = np.zeros(belief.grid.size)
    there[other.cells] = other.probability
    chances = there[belief.cells]
    if np.any(chances <= 0.0):
        return math.inf
    return max(0.0, float((belief.probability * np.log2(belief.probability / chances)).sum()))


def fit_operations(cells: int, grid_cells: int, components: int) -> int:
    """Elementary operations of `fitted`, `on_grid` and `divergence_bit`.

    Each step takes a density and its share of the moments for every cell and component, the comparison a density for every
    cell of the grid and component, and a logarithm a cell.
    """
    steps = STEPS if components > 1 else 1
    fitting = components * cells * steps * (_DENSITY_OPERATIONS + 15)
    return fitting + on_grid_operations(grid_cells, components) + cells * FUNCTION_OPERATIONS


def on_grid_operations(grid_cells: int, components: int) -> int:
    """Elementary operations of `on_grid`: a density for every cell of the grid and component."""
    return components * grid_cells * _DENSITY_OPERATIONS
