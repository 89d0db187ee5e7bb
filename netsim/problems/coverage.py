"""What sensors cover, as a scenario states it, and the subregions that follow from it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.kernels.coverage_regions import Box, CellGrid, Region, disc_cover, disc_regions
from netsim.kernels.semiring import FloatArray
from netsim.parameters import Positive, PositiveInt, parameters

Located = np.ndarray[tuple[int], np.dtype[np.int64]]


@parameters
class DiscCoverage:
    """Each sensor covers a disc around it; subregions are the exact overlay of the discs, cut at the field's border."""

    type: Literal["discs"] = "discs"
    """Kind of coverage."""
    radius_m: Positive = 4.5
    """Range of a sensor."""


@parameters
class CellCoverage:
    """The field is divided into equal cells; each sensor covers a block of them, the one centred nearest to it."""

    type: Literal["cells"] = "cells"
    """Kind of coverage."""
    rows: PositiveInt = 10
    """Cells along y."""
    columns: PositiveInt = 10
    """Cells along x."""
    block_rows: PositiveInt = 2
    """Cells of a sensor's block along y; what lies outside the field is cut off."""
    block_columns: PositiveInt = 2
    """Cells of a sensor's block along x."""
    merge_cells: bool = False
    """Whether cells covered by the same sensors are one subregion rather than several."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Subregions and where a point belongs.

    Attributes:
        regions: The subregions that some sensor covers.
        locate: For points of shape (n, 2) the number of the subregion of each, -1 where no sensor covers it.
    """

    regions: tuple[Region, ...]
    locate: Callable[[FloatArray], Located]


def coverage_of(parameters: DiscCoverage | CellCoverage, sensors_m: FloatArray, field_m: Box) -> Coverage:
    """The subregions of sensors at the given positions, shape (N, 2), in a field."""
    if isinstance(parameters, DiscCoverage):
        radius_m = parameters.radius_m
        regions = disc_regions(sensors_m, radius_m, field_m)
        numbers = {region.sensors: number for number, region in enumerate(regions)}
        return Coverage(
            regions, lambda points_m: _numbered([numbers.get(s, -1) for s in disc_cover(points_m, sensors_m, radius_m)])
        )
    grid = CellGrid(parameters.rows, parameters.columns, parameters.block_rows, parameters.block_columns, field_m)
    return _cells(grid, sensors_m, parameters.merge_cells)


def _cells(grid: CellGrid, sensors_m: FloatArray, merge: bool) -> Coverage:
    groups: dict[tuple[int, ...] | int, list[Region]] = {}
    number_of: dict[int, int] = {}
    for cell, sensors in grid.cover(sensors_m).items():
        key = sensors if merge else cell
        number_of[cell] = list(groups).index(key) if key in groups else len(groups)
        groups.setdefault(key, []).append(grid.region(cell, sensors))
    regions = tuple(_merged(members) for members in groups.values())
    return Coverage(regions, lambda points_m: _numbered([number_of.get(cell, -1) for cell in grid.cells_of(points_m)]))


def _merged(members: list[Region]) -> Region:
    """One region of several of equal area."""
    centres_m = np.array([region.centre_m for region in members])
    x_m, y_m = centres_m.mean(axis=0).tolist()
    return Region(members[0].sensors, sum(region.area_m2 for region in members), (x_m, y_m))


def _numbered(numbers: list[int]) -> Located:
    return np.array(numbers, dtype=np.int64)
