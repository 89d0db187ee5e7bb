"""A table scaled to given sums of its rows and columns: iterative proportional fitting (Deming and Stephan 1940).

Among all tables with these sums the one found is nearest to the first in relative entropy (Csiszar 1975). Where an entry
must vanish for that, alternate scaling comes near only as 1 over the number of sweeps; after some sweeps Newton's method on
the logarithms of the scales goes on (Brauer, Clason, Lorenz and Wirth 2017), under which it falls by a factor of e a step.
"""

from typing import Final

import numpy as np

from netsim.kernels.semiring import FloatArray

SWEEPS: Final = 100
STEPS: Final = 80
ACCURATE: Final = 1e-13
"""Greatest error of a sum at which scaling ends."""

ACCEPTED: Final = 1e-7
"""Greatest error of a sum that is taken for rounding in the table and is rounded away; a greater one is a failure."""

NEGLIGIBLE: Final = 1e-12
"""Singular values below this share of the greatest tell of scales that no longer change anything."""


def fitted(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> FloatArray | None:
    """The table scaled to these sums; None where no scales give them.

    Args:
        table: Not negative, shape (R, C).
        row_sums: Shape (R,), above 0.
        column_sums: Shape (C,), at least 0, of the same total up to rounding.
    """
    columns = column_sums * (row_sums.sum() / column_sums.sum())
    scaled, error = _swept(table, row_sums, columns)
    if error > ACCURATE:
        scaled, error = _newton(scaled, row_sums, columns)
    if error > ACCEPTED:
        return None
    return scaled if error <= ACCURATE else _rounded(scaled, row_sums, columns)


def _rounded(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> FloatArray:
    """A table whose sums are nearly right, moved to right ones (Altschuler, Weed and Rigollet 2017, algorithm 2).

    What sums have too much is scaled away, what is then missing is added as a product of rows and columns: no more than the
    error, and where there was nothing too.
    """
    table = table * np.minimum(_ratio(row_sums, table.sum(axis=1)), 1.0)[:, None]
    table = table * np.minimum(_ratio(column_sums, table.sum(axis=0)), 1.0)
    rows, columns = row_sums - table.sum(axis=1), column_sums - table.sum(axis=0)
    missing = float(rows.sum())
    return table if missing <= 0.0 else table + np.outer(np.maximum(rows, 0.0), np.maximum(columns, 0.0)) / missing


def _swept(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> tuple[FloatArray, float]:
    """Rows and columns scaled in turn, rows last; and the greatest error of a sum."""
    scaled, error = table, np.inf
    for _ in range(SWEEPS):
        scaled = scaled * _ratio(column_sums, scaled.sum(axis=0))
        scaled = scaled * _ratio(row_sums, scaled.sum(axis=1))[:, None]
        error = _error(scaled, row_sums, column_sums)
        if error <= ACCURATE:
            break
    return scaled, error


def _ratio(wanted: FloatArray, there: FloatArray) -> FloatArray:
    return np.divide(wanted, there, out=np.zeros_like(wanted), where=there > 0.0)


def _error(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> float:
    return float(max(np.abs(table.sum(axis=1) - row_sums).max(), np.abs(table.sum(axis=0) - column_sums).max()))


def _newton(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> tuple[FloatArray, float]:
    """Newton's steps on the logarithms of all scales, of at most a factor of e^2 each; the best table met."""
    best, least, scaled = table, _error(table, row_sums, column_sums), table
    for _ in range(STEPS):
        if least <= ACCURATE:
            break
        scaled = _stepped(scaled, row_sums, column_sums)
        error = _error(scaled, row_sums, column_sums)
        if not np.isfinite(error):
            break
        if error < least:
            best, least = scaled, error
    return best, least


def _stepped(table: FloatArray, row_sums: FloatArray, column_sums: FloatArray) -> FloatArray:
    rows, columns = table.sum(axis=1), table.sum(axis=0)
    hessian = np.block([[np.diag(rows), table], [table.T, np.diag(columns)]])
    gradient = np.concatenate([rows - row_sums, columns - column_sums])
    step = -np.linalg.lstsq(hessian, gradient, rcond=NEGLIGIBLE)[0]
    step *= min(1.0, 2.0 / max(float(np.abs(step).max()), 1e-300))
    return np.asarray(table * np.exp(step[: len(rows), None] + step[None, len(rows) :]))
