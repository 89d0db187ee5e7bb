"""The subregions into which the sensors' coverage divides a field: one for each set of sensors that cover some of it.

Discs are overlaid exactly by shapely (an optional cost, hence imported late): polygons of `SEGMENTS` sides, scaled so that
a whole disc has its true area. What is left of the error: a border lies at most r * 4e-5 from the circle it stands for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from netsim.kernels.semiring import FloatArray

if TYPE_CHECKING:
    from shapely import Polygon

SEGMENTS = 512
"""Sides of the polygon that stands for a circle."""

Box = tuple[float, float, float, float]
"""Least x, least y, greatest x, greatest y of a field, in metres."""


@dataclass(frozen=True, slots=True)
class Region:
    """Where one set of sensors covers the field; it may be in several parts.

    Attributes:
        sensors: The sensors, ascending.
        area_m2: Area of all parts.
        centre_m: Their common centroid, which may lie outside of them.
    """

    sensors: tuple[int, ...]
    area_m2: float
    centre_m: tuple[float, float]


def disc_regions(sensors_m: FloatArray, radius_m: float, field_m: Box) -> tuple[Region, ...]:
    """The regions of sensors that each cover a disc, in the order of their sets; what none covers is left out.

    Args:
        sensors_m: Positions, shape (N, 2).
        radius_m: Radius of the discs, borders included.
        field_m: The field; what lies outside is left out.
    """
    if not len(sensors_m):
        return ()
    parts: dict[tuple[int, ...], list[Polygon]] = {}
    for face in _faces(sensors_m, radius_m, field_m):
        point = face.representative_point()
        covering = disc_cover(np.array([[point.x, point.y]]), sensors_m, radius_m)[0]
        if covering and _within(point.x, point.y, field_m):
            parts.setdefault(covering, []).append(face)
    return tuple(_region(sensors, faces) for sensors, faces in sorted(parts.items()))


def disc_cover(points_m: FloatArray, sensors_m: FloatArray, radius_m: float) -> list[tuple[int, ...]]:
    """For each point the sensors whose discs contain it, ascending."""
    distances_m = np.linalg.norm(points_m[:, None, :] - sensors_m[None, :, :], axis=2)
    return [tuple(np.flatnonzero(row).tolist()) for row in distances_m <= radius_m]


def _faces(sensors_m: FloatArray, radius_m: float, field_m: Box) -> "Sequence[Polygon]":
    """The faces of all circles and the field's border drawn over one another."""
    import shapely

    step = 2.0 * np.pi / SEGMENTS
    scaled_m = radius_m * np.sqrt(step / np.sin(step))
    angles = step * np.arange(SEGMENTS + 1)
    circle_m = scaled_m * np.column_stack([np.cos(angles), np.sin(angles)])
    circle_m[-1] = circle_m[0]
    places_m = np.unique(sensors_m, axis=0)
    rings = [shapely.LinearRing(place_m + circle_m) for place_m in places_m]
    lines = shapely.unary_union([*rings, shapely.box(*field_m).exterior])
    return list(shapely.get_parts(shapely.polygonize([lines])))


def _within(x_m: float, y_m: float, field_m: Box) -> bool:
    return field_m[0] <= x_m <= field_m[2] and field_m[1] <= y_m <= field_m[3]


def _region(sensors: tuple[int, ...], faces: "Sequence[Polygon]") -> Region:
    areas = [face.area for face in faces]
    points = [face.centroid for face in faces]
    total = sum(areas)
    x_m = sum(area * point.x for area, point in zip(areas, points, strict=True)) / total
    y_m = sum(area * point.y for area, point in zip(areas, points, strict=True)) / total
    return Region(sensors, total, (x_m, y_m))


@dataclass(frozen=True, slots=True)
class CellGrid:
    """A field divided into equal cells; each sensor covers a block of them.

    The block is the one whose centre is nearest to the sensor among those that end on lines of the grid (endless: what
    lies outside the field is cut off).

    Attributes:
        rows: Cells along y.
        columns: Cells along x.
        block_rows: Of a block.
        block_columns: Of a block.
        field_m: The field.
    """

    rows: int
    columns: int
    block_rows: int
    block_columns: int
    field_m: Box

    @property
    def _cell_m(self) -> tuple[float, float]:
        left, low, right, top = self.field_m
        return (right - left) / self.columns, (top - low) / self.rows

    def blocks(self, sensors_m: FloatArray) -> tuple[frozenset[int], ...]:
        """The cells each sensor covers; cell = row * columns + column, row 0 at the least y."""
        width_m, height_m = self._cell_m
        columns = np.floor((sensors_m[:, 0] - self.field_m[0]) / width_m - self.block_columns / 2 + 0.5).astype(int)
        rows = np.floor((sensors_m[:, 1] - self.field_m[1]) / height_m - self.block_rows / 2 + 0.5).astype(int)
        return tuple(
            frozenset(
                row * self.columns + column
                for row in range(max(0, first_row), min(self.rows, first_row + self.block_rows))
                for column in range(max(0, first), min(self.columns, first + self.block_columns))
            )
            for first_row, first in zip(rows.tolist(), columns.tolist(), strict=True)
        )

    def cover(self, sensors_m: FloatArray) -> Mapping[int, tuple[int, ...]]:
        """For each covered cell, ascending, the sensors that cover it, ascending."""
        covering: dict[int, list[int]] = {}
        for sensor, cells in enumerate(self.blocks(sensors_m)):
            for cell in cells:
                covering.setdefault(cell, []).append(sensor)
        return {cell: tuple(covering[cell]) for cell in sorted(covering)}

    def region(self, cell: int, sensors: tuple[int, ...]) -> Region:
        """A cell with the sensors that cover it."""
        width_m, height_m = self._cell_m
        row, column = divmod(cell, self.columns)
        centre_m = (self.field_m[0] + (column + 0.5) * width_m, self.field_m[1] + (row + 0.5) * height_m)
        return Region(sensors, width_m * height_m, centre_m)

    def cells_of(self, points_m: FloatArray) -> list[int]:
        """The cell of each point of the field."""
        width_m, height_m = self._cell_m
        columns = np.clip((points_m[:, 0] - self.field_m[0]) // width_m, 0, self.columns - 1).astype(int)
        rows = np.clip((points_m[:, 1] - self.field_m[1]) // height_m, 0, self.rows - 1).astype(int)
        return [int(cell) for cell in rows * self.columns + columns]
