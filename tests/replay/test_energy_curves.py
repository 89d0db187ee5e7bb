"""The curves of energy: in which unit, and as how many."""

from pathlib import Path

import pytest
from recordings import MS, Table, named_nodes, recording, timed
from synthetic import write_synthetic

from netsim.trace.events import NodeEnergy
from netsim.trace.writer import TraceWriter


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("grid") / "grid.mcap"
    write_synthetic(path, duration_s=20.0)
    return path


def energy_of(folder: Path, full_j: list[float], left_j: list[float]) -> Table:
    """What is recorded of two samples of energy: full, and this much left."""
    with TraceWriter(folder / "energy.mcap", {}) as writer:
        nodes = range(len(full_j))
        writer.write(named_nodes(*(f"n{node}" for node in nodes), battery_j=full_j), 0)
        writer.write(NodeEnergy(nodes, [0.0] * len(full_j), full_j), 0)
        used = [full - left for full, left in zip(full_j, left_j, strict=True)]
        writer.write(NodeEnergy(nodes, used, left_j), 10 * MS)
    return recording(folder / "energy.mcap", folder)


def test_unequal_batteries_are_plotted_as_fractions(tmp_path: Path) -> None:
    rows = energy_of(tmp_path, [1.0, 18000.0], [0.25, 17820.0])
    assert timed(rows["/plots/energy/n0"], "Scalars:scalars") == {0: [100.0], 10 * MS: [25.0]}
    assert timed(rows["/plots/energy/n1"], "Scalars:scalars") == {0: [100.0], 10 * MS: [99.0]}


def test_like_batteries_are_plotted_in_joules(tmp_path: Path) -> None:
    rows = energy_of(tmp_path, [1.0, 3.0], [0.25, 2.0])
    assert timed(rows["/plots/energy/n1"], "Scalars:scalars") == {0: [3.0], 10 * MS: [2.0]}


def test_small_drains_are_plotted_as_energy_used(tmp_path: Path) -> None:
    rows = energy_of(tmp_path, [1.0, 18000.0], [0.95, 17999.0])
    assert timed(rows["/plots/energy/n1"], "Scalars:scalars") == {0: [0.0], 10 * MS: [1.0]}


def test_curves_that_coincide_are_shown_as_one(tmp_path: Path) -> None:
    rows = energy_of(tmp_path, [10.0] * 20, [5.0] * 19 + [4.9])
    assert [row["SeriesLines:names"] for row in rows["/plots/energy_of_all"] if "simulated_time" not in row] == [
        ["20 nodes, all within 1 %"]
    ]
    assert timed(rows["/plots/energy_of_all"], "Scalars:scalars")[10 * MS] == pytest.approx([4.995])
    assert "/plots/energy_of_all" not in energy_of(tmp_path, [10.0] * 20, [5.0] * 19 + [1.0])


def test_on_mains_the_energy_consumed_is_plotted(tmp_path: Path) -> None:
    write_synthetic(tmp_path / "mains.mcap", duration_s=3.0, mains=True)
    rows = recording(tmp_path / "mains.mcap", tmp_path)
    assert timed(rows["/plots/energy/n01"], "Scalars:scalars")[0] == [0.0]
    assert len(set(map(tuple, timed(rows["/map/nodes"], "Points2D:colors").values()))) == 1


def test_many_nodes_are_summarised(grid: Path, tmp_path: Path) -> None:
    rows = recording(grid, tmp_path, detail_nodes=10)
    assert {path for path in rows if path.startswith("/plots/energy")} == {
        f"/plots/energy/{name}" for name in ("least", "mean", "most")
    }
    assert not any(path.startswith("/radio") for path in rows)
