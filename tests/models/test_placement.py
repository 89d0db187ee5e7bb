"""Placements: exact grids, keyed draws, spacing of Poisson disks, statistics, CSV files with every wrong line."""

import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.models.node_files import PlacedNode, read_nodes
from netsim.models.placement import (
    CsvPlacement,
    GridPlacement,
    JitteredGridPlacement,
    ListedPlacement,
    PlacementParameters,
    PoissonDiskPlacement,
    UniformPlacement,
    positions,
)
from netsim.rng import Streams

FIELD_M = (10.0, -5.0, 100.0, 60.0)
HERE = Path(__file__).parent
RANDOM = [
    JitteredGridPlacement(rows=3, columns=4, spacing_m=10.0, jitter_sd_m=2.0, origin_m=(0.0, 0.0)),
    UniformPlacement(count=12),
    PoissonDiskPlacement(count=12, min_distance_m=8.0),
]


def place(parameters: PlacementParameters, seed: int = 1, group: str = "field") -> np.ndarray:
    nodes = positions(parameters, FIELD_M, Streams(seed), group, HERE)
    assert all(node.id is None and node.name is None for node in nodes)
    return np.array([(node.x_m, node.y_m) for node in nodes])


def enlarged(parameters: PlacementParameters) -> PlacementParameters:
    return replace(parameters, **({"rows": 5} if isinstance(parameters, JitteredGridPlacement) else {"count": 20}))


def closest_m(points: np.ndarray) -> float:
    offsets = points[:, np.newaxis] - points
    distances = np.hypot(offsets[..., 0], offsets[..., 1])
    return float(np.min(distances[np.triu_indices(len(points), 1)]))


def inside(points: np.ndarray) -> bool:
    x, y, width, height = FIELD_M
    return bool(np.all((points >= (x, y)) & (points <= (x + width, y + height))))


def test_grid_row_by_row() -> None:
    grid = place(GridPlacement(rows=2, columns=3, spacing_m=5.0, origin_m=(1.0, 2.0)))
    assert grid.tolist() == [[1, 2], [6, 2], [11, 2], [1, 7], [6, 7], [11, 7]]


def test_grid_is_centred_by_default() -> None:
    grid = place(GridPlacement(rows=3, columns=7, spacing_m=10.0))
    assert grid.mean(axis=0).tolist() == pytest.approx([60.0, 25.0])
    assert closest_m(grid) == pytest.approx(10.0)


def test_jitter_of_nothing_is_the_grid() -> None:
    jittered = JitteredGridPlacement(rows=3, columns=4, spacing_m=10.0, jitter_sd_m=0.0)
    assert np.array_equal(place(jittered), place(GridPlacement(rows=3, columns=4, spacing_m=10.0)))


def test_jitter_statistics() -> None:
    grid = GridPlacement(rows=30, columns=30, spacing_m=10.0)
    jittered = JitteredGridPlacement(rows=30, columns=30, spacing_m=10.0, jitter_sd_m=2.0)
    errors = place(jittered) - place(grid)
    assert abs(errors.mean()) < 5 * 2.0 / math.sqrt(errors.size)
    assert abs(errors.std() / 2.0 - 1.0) < 5 / math.sqrt(2 * errors.size)


def test_uniform_fills_the_field_evenly() -> None:
    """Counts in a 5 by 5 partition: chi-square with 24 degrees of freedom below its 0.9999 quantile."""
    points = place(UniformPlacement(count=2000))
    assert inside(points)
    counts, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=5, range=[[10, 110], [-5, 55]])
    assert np.sum((counts - 80) ** 2 / 80) < 59.2


def components_within(points: np.ndarray, within_m: float) -> int:
    graph = nx.random_geometric_graph(len(points), within_m, pos=dict(enumerate(points.tolist())))
    return int(nx.number_connected_components(graph))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 30), st.floats(30.0, 60.0), st.integers(0, 1000))
def test_a_connected_group_is_connected_and_the_first_draw_is_kept_where_it_was(
    count: int, within_m: float, seed: int
) -> None:
    first = place(UniformPlacement(count=count), seed)
    connected = place(UniformPlacement(count=count, connected_within_m=within_m), seed)
    assert inside(connected)
    assert components_within(connected, within_m) == 1
    assert np.array_equal(first, connected) == (components_within(first, within_m) == 1)


def test_a_connected_group_is_the_same_with_the_same_seed() -> None:
    """And all its nodes are drawn anew, not only some."""
    parameters = UniformPlacement(count=100, connected_within_m=12.0)
    again = [place(parameters, seed) for seed in range(4)]
    assert all(np.array_equal(points, place(parameters, seed)) for seed, points in enumerate(again))
    redrawn = [points != place(UniformPlacement(count=100), seed) for seed, points in enumerate(again)]
    assert {bool(moved.all()) for moved in redrawn if moved.any()} == {True}


def test_a_group_that_cannot_be_connected_is_refused() -> None:
    message = (
        r"group `field`: expected 12 nodes that are connected within 1 m in a field of 100 m by 60 m, but none of \d+ draws "
        r".* raise `connected_within_m` or `count`"
    )
    with pytest.raises(ScenarioError, match=message):
        place(UniformPlacement(count=12, connected_within_m=1.0))


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.floats(0.5, 8.0), st.integers(0, 1000))
def test_poisson_disk_keeps_its_distance(count: int, min_distance_m: float, seed: int) -> None:
    points = place(PoissonDiskPlacement(count=count, min_distance_m=min_distance_m), seed)
    assert len(points) == count
    assert inside(points)
    assert count == 1 or closest_m(points) >= min_distance_m * (1 - 1e-12)


def test_poisson_disk_that_cannot_fit_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"group `field`: expected 50 nodes at least 40 m apart .* lower `count`"):
        place(PoissonDiskPlacement(count=50, min_distance_m=40.0))


@pytest.mark.parametrize("parameters", RANDOM, ids=lambda p: p.type)
def test_enlarging_a_group_moves_none_of_its_nodes(parameters: PlacementParameters) -> None:
    small, large = place(parameters), place(enlarged(parameters))
    assert len(large) == 20
    assert np.array_equal(small, large[: len(small)])


@pytest.mark.parametrize("parameters", RANDOM, ids=lambda p: p.type)
def test_same_seed_same_places_and_another_others(parameters: PlacementParameters) -> None:
    first = place(parameters)
    assert np.array_equal(first, place(parameters))
    assert not np.any(first == place(parameters, seed=2))
    assert not np.any(first == place(parameters, group="another"))


def test_listed_positions_are_kept() -> None:
    assert place(ListedPlacement(positions_m=((1.0, 2.0), (-3.5, 4.0)))).tolist() == [[1.0, 2.0], [-3.5, 4.0]]


def test_csv_file(tmp_path: Path) -> None:
    (tmp_path / "nodes.csv").write_text("id,x_m,y_m,name\n7, 1.5,2,door\n\n0,-3e1,.5,\n")
    nodes = positions(CsvPlacement(file="nodes.csv"), FIELD_M, Streams(1), "field", tmp_path)
    assert nodes == [PlacedNode(7, "door", 1.5, 2.0), PlacedNode(0, None, -30.0, 0.5)]


def test_csv_file_of_a_spreadsheet(tmp_path: Path) -> None:
    """Byte-order mark, carriage returns, no name column, a quoted cell."""
    (tmp_path / "nodes.csv").write_bytes('\ufeffid,x_m,y_m\r\n1,"2",3\r\n'.encode())
    assert read_nodes(tmp_path / "nodes.csv") == [PlacedNode(1, None, 2.0, 3.0)]


def test_csv_file_reports_every_wrong_line(tmp_path: Path) -> None:
    rows = ["id,x_m,y_m", "1,0,0", "2,0", "-1,0,0", "1,x,nan", "70000,0,0", "2.5,0,0", "3,0,0"]
    path = tmp_path / "nodes.csv"
    path.write_text("\n".join(rows))
    with pytest.raises(ScenarioError) as caught:
        read_nodes(path)
    assert str(caught.value).splitlines() == [
        f"{path}:3: expected 3 columns, got 2",
        f"{path}:4: id: expected a whole number from 0 to 65533, got `-1`",
        f"{path}:5: id: expected ids that differ, got 1 again; first on line 2",
        f"{path}:5: x_m: expected a number of metres, got `x`",
        f"{path}:5: y_m: expected a number of metres, got `nan`",
        f"{path}:6: id: expected a whole number from 0 to 65533, got `70000`",
        f"{path}:7: id: expected a whole number from 0 to 65533, got `2.5`",
    ]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "nodes.csv:1: expected the header"),
        (b"id;x_m;y_m\n1;2;3\n", "got `id;x_m;y_m`"),
        (b"id,x_m,y_m\n", "at least one node"),
        (b"id,x_m,y_m\n\xff,1,2\n", "expected a CSV file"),
    ],
)
def test_csv_files_that_are_none(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "nodes.csv").write_bytes(content)
    with pytest.raises(ScenarioError, match=message):
        read_nodes(tmp_path / "nodes.csv")


def test_missing_csv_file(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"absent.csv: expected a CSV file"):
        read_nodes(tmp_path / "absent.csv")


def test_every_placement_has_its_own_type_word() -> None:
    words = [get_args(kind.__annotations__["type"])[0] for kind in get_args(PlacementParameters)]
    assert words == ["grid", "jittered-grid", "uniform", "poisson-disk", "listed", "csv"]
