"""Where nodes stand: generators of positions for a group of nodes, as parameters of a scenario.

Random placements draw each node from its own stream, keyed by group and index: enlarging a group moves none of its
nodes. The exception is a uniform placement that has to be connected: its group is drawn anew until it is, and a larger
group may need another number of draws.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from annotated_types import MinLen
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.models.node_files import PlacedNode, read_nodes
from netsim.parameters import Name, NonNegative, PointM, Positive, PositiveInt, parameters
from netsim.rng import Streams

FieldM = tuple[float, float, float, float]
"""The field: lower left corner x and y, width, height, in metres."""


@parameters
class GridPlacement:
    """Nodes on a rectangular grid, row by row from the lower left."""

    type: Literal["grid"] = "grid"
    """Selects this placement."""
    rows: PositiveInt
    """How many along y."""
    columns: PositiveInt
    """How many along x."""
    spacing_m: Positive | None = None
    """Distance between neighbours in a row or column; by default the nodes stand in the middles of equal cells
    that fill the field."""
    origin_m: PointM | None = None
    """Position of the first node; by default the grid is centred in the field."""


@parameters
class JitteredGridPlacement:
    """Nodes on a rectangular grid, each moved by normal errors of its own; it may leave the field."""

    type: Literal["jittered-grid"] = "jittered-grid"
    """Selects this placement."""
    rows: PositiveInt
    """How many along y."""
    columns: PositiveInt
    """How many along x."""
    spacing_m: Positive | None = None
    """Distance between neighbours in a row or column, before the errors; by default the nodes stand in the middles of equal
    cells that fill the field."""
    jitter_sd_m: NonNegative
    """Standard deviation of the error along each axis."""
    origin_m: PointM | None = None
    """Position of the first node before its error; by default the grid is centred in the field."""


@parameters
class UniformPlacement:
    """Nodes anywhere in the field, independently."""

    type: Literal["uniform"] = "uniform"
    """Selects this placement."""
    count: PositiveInt
    """How many."""
    connected_within_m: Positive | None = None
    """Draw the whole group anew until it is connected, where nodes at most this far apart are neighbours (other groups do
    not count); by default the first draw is kept. A group of another `count` may then stand elsewhere."""


@parameters
class PoissonDiskPlacement:
    """Nodes anywhere in the field, but none closer to another of its group than a distance (dart throwing)."""

    type: Literal["poisson-disk"] = "poisson-disk"
    """Selects this placement."""
    count: PositiveInt
    """How many."""
    min_distance_m: Positive
    """Least distance between two nodes of the group."""


@parameters
class ListedPlacement:
    """Nodes at given positions."""

    type: Literal["listed"] = "listed"
    """Selects this placement."""
    positions_m: Annotated[tuple[PointM, ...], MinLen(1)]
    """One a node."""


@parameters
class CsvPlacement:
    """Nodes of a CSV file with the header `id,x_m,y_m` or `id,x_m,y_m,name`."""

    type: Literal["csv"] = "csv"
    """Selects this placement."""
    file: Name
    """Path of the file, relative to the scenario."""


PointPlacement = GridPlacement | JitteredGridPlacement | UniformPlacement | PoissonDiskPlacement | ListedPlacement
PlacementParameters = PointPlacement | CsvPlacement


def positions(
    parameters: PlacementParameters, field_m: FieldM, streams: Streams, group_name: str, base_dir: Path
) -> list[PlacedNode]:
    """Place a group of nodes.

    Args:
        parameters: One of the placements.
        field_m: Lower left corner x and y, width, height.
        streams: The run's random streams; node k of the group draws from `group/<group_name>/<k>/position`.
        group_name: Name of the group, unique in the scenario.
        base_dir: What the CSV file's path is relative to.

    Returns:
        The nodes in order of their index in the group.

    Raises:
        ScenarioError: If the nodes of a Poisson-disk placement do not fit, no draw of a uniform one is connected as it has
            to be, or the CSV file is missing or wrong.
    """
    if isinstance(parameters, CsvPlacement):
        return read_nodes(base_dir / parameters.file)
    points = _points(parameters, field_m, _Draws(streams, group_name))
    return [PlacedNode(id=None, name=None, x_m=x_m, y_m=y_m) for x_m, y_m in points]


def _points(parameters: PointPlacement, field_m: FieldM, draws: "_Draws") -> list[PointM]:
    match parameters:
        case GridPlacement():
            return _grid(parameters, field_m)
        case JitteredGridPlacement():
            return _jittered(_grid(parameters, field_m), parameters.jitter_sd_m, draws)
        case UniformPlacement():
            return _uniform(parameters, field_m, draws)
        case PoissonDiskPlacement():
            return _poisson_disk(parameters, field_m, draws)
        case ListedPlacement():
            return list(parameters.positions_m)


@dataclass(frozen=True, slots=True)
class _Draws:
    """The streams of a group's nodes."""

    streams: Streams
    group_name: str

    def of(self, index: int) -> np.random.Generator:
        return self.streams.generator(f"group/{self.group_name}/{index}/position")


def _grid(parameters: GridPlacement | JitteredGridPlacement, field_m: FieldM) -> list[PointM]:
    rows, columns = parameters.rows, parameters.columns
    x_m, y_m, width_m, height_m = field_m
    across_m, up_m = width_m / columns, height_m / rows
    if parameters.spacing_m is not None:
        across_m = up_m = parameters.spacing_m
    if parameters.origin_m is None:
        first_x_m = x_m + (width_m - (columns - 1) * across_m) / 2
        first_y_m = y_m + (height_m - (rows - 1) * up_m) / 2
    else:
        first_x_m, first_y_m = parameters.origin_m
    return [(first_x_m + column * across_m, first_y_m + row * up_m) for row in range(rows) for column in range(columns)]


def _jittered(points: Sequence[PointM], sd_m: float, draws: _Draws) -> list[PointM]:
    moved = []
    for index, (x_m, y_m) in enumerate(points):
        dx_m, dy_m = (sd_m * draws.of(index).standard_normal(2)).tolist()
        moved.append((x_m + dx_m, y_m + dy_m))
    return moved


def _in_field(unit: NDArray[np.float64], field_m: FieldM) -> PointM:
    """A point of the unit square, stretched over the field."""
    x_m, y_m, width_m, height_m = field_m
    return x_m + width_m * float(unit[0]), y_m + height_m * float(unit[1])


_MAX_GROUPS = 500
"""Draws of a group before it is refused: what is connected in a draw of a hundred is found but for one time in 150."""


def _uniform(parameters: UniformPlacement, field_m: FieldM, draws: _Draws) -> list[PointM]:
    generators = [draws.of(index) for index in range(parameters.count)]
    within_m = parameters.connected_within_m
    for _ in range(_MAX_GROUPS):
        points = [_in_field(generator.random(2), field_m) for generator in generators]
        if within_m is None or _is_connected(np.array(points), within_m):
            return points
    text = (
        f"group `{draws.group_name}`: expected {parameters.count} nodes that are connected within {within_m:g} m in a field "
        f"of {field_m[2]:g} m by {field_m[3]:g} m, but none of {_MAX_GROUPS} draws of the group was: "
        "raise `connected_within_m` or `count`, or make the field smaller"
    )
    raise ScenarioError(text)


def _is_connected(points_m: NDArray[np.float64], within_m: float) -> bool:
    """Whether every point is reached from the first in steps of at most a distance."""
    to_visit, unreached_m = [points_m[0]], points_m[1:]
    while to_visit and len(unreached_m):
        offsets_m = unreached_m - to_visit.pop()
        near = offsets_m[:, 0] ** 2 + offsets_m[:, 1] ** 2 <= within_m**2
        to_visit.extend(unreached_m[near])
        unreached_m = unreached_m[~near]
    return not len(unreached_m)


# Dart throwing jams when disks of half the distance cover 0.547 of the plane (random sequential adsorption); close to
# that almost every dart misses. The throws bound the wait: 8,192 darts miss a free 0.1 % of the field once in 3,600.
_DARTS_AT_ONCE = 64
_MAX_THROWS = 128
_JAMMED_SHARE = 0.547


def _poisson_disk(parameters: PoissonDiskPlacement, field_m: FieldM, draws: _Draws) -> list[PointM]:
    placed = np.empty((parameters.count, 2))
    for index in range(parameters.count):
        spot = _free_spot(placed[:index], parameters.min_distance_m, field_m, draws.of(index))
        if spot is None:
            raise ScenarioError(_does_not_fit(parameters, field_m, index, draws.group_name))
        placed[index] = spot
    return [(x_m, y_m) for x_m, y_m in placed.tolist()]


def _free_spot(
    placed: NDArray[np.float64], min_distance_m: float, field_m: FieldM, generator: np.random.Generator
) -> NDArray[np.float64] | None:
    """The first dart that lands far enough from all placed nodes, or None."""
    corner, size = np.array(field_m[:2]), np.array(field_m[2:])
    for _ in range(_MAX_THROWS):
        darts = corner + size * generator.random((_DARTS_AT_ONCE, 2))
        offsets = darts[:, np.newaxis] - placed
        free = np.all(offsets[..., 0] ** 2 + offsets[..., 1] ** 2 >= min_distance_m**2, axis=1)
        if free.any():
            spot: NDArray[np.float64] = darts[np.argmax(free)]
            return spot
    return None


def _does_not_fit(parameters: PoissonDiskPlacement, field_m: FieldM, fitted: int, group_name: str) -> str:
    distance_m = parameters.min_distance_m
    area_m2, disk_m2 = (field_m[2] + distance_m) * (field_m[3] + distance_m), math.pi * (distance_m / 2) ** 2
    return (
        f"group `{group_name}`: expected {parameters.count} nodes at least {distance_m:g} m apart in a "
        f"field of {field_m[2]:g} m by {field_m[3]:g} m, but only {fitted} found room; at most "
        f"about {_JAMMED_SHARE * area_m2 / disk_m2:.0f} fit: lower `count` or `min_distance_m`, or enlarge the field"
    )
