"""Which cells a belief has, as bytes: a list, a bitmap of their bounding box, or runs."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Final

import numpy as np

from netsim.codec import Record
from netsim.kernels.grid_belief import CellArray, Grid

LIST, BITMAP, RUNS = 0, 1, 2
_BOX = Record("HHHH")  # first row, first column, rows, columns
_COUNT = Record("H")
_MOST = 1 << 16


def laid_positions(cells: CellArray, grid: Grid, kind: int) -> bytes:
    """Cells, ascending and at least one, in the layout of a kind."""
    return _LAYOUTS[kind][0](cells, grid)


def read_positions(data: bytes, grid: Grid, kind: int) -> tuple[CellArray, int]:
    """Cells, and how many bytes they took.

    Raises:
        ValueError: For bytes that are no cells of the grid.
    """
    if kind not in _LAYOUTS:
        message = f"a layout of cells numbered {kind}"
        raise ValueError(message)
    cells, used = _LAYOUTS[kind][1](data, grid)
    if not len(cells) or cells[0] < 0 or cells[-1] >= grid.size or np.any(np.diff(cells) <= 0):
        message = "cells that are not ascending, or not of the grid"
        raise ValueError(message)
    return cells, used


def _list(cells: CellArray, _: Grid) -> bytes:
    return _COUNT.pack(len(cells)) + cells.astype("<u2").tobytes()


def _from_list(data: bytes, _: Grid) -> tuple[CellArray, int]:
    (count,) = _COUNT.unpack(_exactly(data, 0, 2))
    numbers = _exactly(data, 2, 2 * count)
    return np.frombuffer(numbers, dtype="<u2").astype(np.int64), 2 + 2 * count


def _bitmap(cells: CellArray, grid: Grid) -> bytes:
    rows, columns = np.divmod(cells, grid.columns)
    low_row, low_column = int(rows.min()), int(columns.min())
    high, wide = int(rows.max()) - low_row + 1, int(columns.max()) - low_column + 1
    bits = np.zeros((high, wide), dtype=np.uint8)
    bits[rows - low_row, columns - low_column] = 1
    return _BOX.pack(low_row, low_column, high, wide) + np.packbits(bits).tobytes()


def _from_bitmap(data: bytes, grid: Grid) -> tuple[CellArray, int]:
    low_row, low_column, high, wide = _BOX.unpack(_exactly(data, 0, _BOX.size_byte))
    if low_row + high > grid.rows or low_column + wide > grid.columns:
        message = "a box beyond the grid"
        raise ValueError(message)
    size = -(-high * wide // 8)
    bits = np.unpackbits(np.frombuffer(_exactly(data, _BOX.size_byte, size), dtype=np.uint8), count=high * wide)
    rows, columns = np.nonzero(bits.reshape(high, wide))
    return (rows + low_row) * grid.columns + columns + low_column, _BOX.size_byte + size


def _runs(cells: CellArray, _: Grid) -> bytes:
    """Number of runs, then for each how many cells were left out before it and how many it has."""
    breaks = np.flatnonzero(np.diff(cells) != 1) + 1
    bounds = [0, *breaks.tolist(), len(cells)]
    data, end = bytearray(_COUNT.pack(len(bounds) - 1)), 0
    for start, stop in pairwise(bounds):
        first = int(cells[start])
        data += _short(first - end) + _short(stop - start)
        end = first + stop - start
    return bytes(data)


def _from_runs(data: bytes, grid: Grid) -> tuple[CellArray, int]:
    (count,) = _COUNT.unpack(_exactly(data, 0, 2))
    place, end, runs = 2, 0, []
    for _ in range(count):
        gap, place = _from_short(data, place)
        length, place = _from_short(data, place)
        first, end = end + gap, end + gap + length
        if end > grid.size:
            message = "a run beyond the grid"
            raise ValueError(message)
        runs.append(np.arange(first, end))
    return (np.concatenate(runs) if runs else np.empty(0, dtype=np.int64)), place


def _short(number: int) -> bytes:
    """A whole number in one byte below 128, in two below 16,384, in three above (seven bits each, the lowest first)."""
    data = bytearray()
    while number >= 128:
        data.append(number & 127 | 128)
        number >>= 7
    return bytes([*data, number])


def _from_short(data: bytes, place: int) -> tuple[int, int]:
    number = shift = 0
    while True:
        (byte,) = _exactly(data, place, 1)
        number, place, shift = number | (byte & 127) << shift, place + 1, shift + 7
        if byte < 128:
            return number, place
        if number >= _MOST << 7:
            message = "a number too large for a cell"
            raise ValueError(message)


def _exactly(data: bytes, start: int, size: int) -> bytes:
    part = data[start : start + size]
    if len(part) < size:
        message = "cells that end too early"
        raise ValueError(message)
    return part


Lay = Callable[[CellArray, Grid], bytes]
Read = Callable[[bytes, Grid], tuple[CellArray, int]]
_LAYOUTS: Final[Mapping[int, tuple[Lay, Read]]] = {
    LIST: (_list, _from_list),
    BITMAP: (_bitmap, _from_bitmap),
    RUNS: (_runs, _from_runs),
}
