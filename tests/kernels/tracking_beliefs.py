"""Beliefs for tests of tracking kernels, drawn by hypothesis or around a point."""

import numpy as np
from hypothesis import strategies as st

from netsim.kernels.grid_belief import Grid, GridBelief, from_dense, grid_over

FIELD = grid_over((0.0, 0.0, 150.0, 250.0), 5.0)
INSIDE_M = st.tuples(st.floats(0.0, 150.0), st.floats(0.0, 250.0))


def blob(centre_m: tuple[float, float], sd_m: float, grid: Grid = FIELD) -> np.ndarray:
    """Weights of all cells, falling off around a point, cut off below 1e-4; shape (rows, columns)."""
    distance_m = np.hypot(*(grid.centres_m(np.arange(grid.size)) - np.asarray(centre_m)).T)
    weights = np.exp(-0.5 * (distance_m / sd_m) ** 2)
    weights[grid.cell_of(centre_m)] = 1.0
    return np.where(weights > 1e-4, weights, 0.0).reshape(grid.rows, grid.columns)


def compact(centre_m: tuple[float, float], sd_m: float) -> GridBelief:
    """One blob."""
    return from_dense(FIELD, blob(centre_m, sd_m))


def mixtures() -> st.SearchStrategy[GridBelief]:
    """Up to three blobs anywhere in the field, of different weights and widths."""
    part = st.tuples(INSIDE_M, st.floats(2.0, 30.0), st.floats(0.05, 1.0))
    parts = st.lists(part, min_size=1, max_size=3)
    return parts.map(lambda chosen: from_dense(FIELD, sum(share * blob(at_m, sd_m) for at_m, sd_m, share in chosen)))


def scattered() -> st.SearchStrategy[GridBelief]:
    """Any positive weights of some cells of a small grid, also at its borders."""
    grid = Grid((-3.0, 2.0), 5.0, 7, 5)
    chosen = st.dictionaries(st.integers(0, grid.size - 1), st.floats(1e-6, 1.0), min_size=1, max_size=20)

    def belief(weights: dict[int, float]) -> GridBelief:
        cells = np.array(sorted(weights))
        values = np.array([weights[int(cell)] for cell in cells])
        return GridBelief(grid, cells, values / values.sum())

    return chosen.map(belief)
