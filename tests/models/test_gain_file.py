"""TOSSIM's gain files: what is read, what is refused, and the 225 nodes."""

from pathlib import Path

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.models.gain_file import read_gains


def test_gains_and_noise(tmp_path: Path) -> None:
    path = tmp_path / "gains.txt"
    path.write_text("# made by hand\ngain 0 2 -60.5\n\ngain\t2\t0\t-61\nnoise 0 -105.0 4.0\nnoise 7 -104 0\n")
    gains = read_gains(path)
    assert (gains.source.tolist(), gains.destination.tolist()) == ([0, 2], [2, 0])
    assert gains.gain_db.tolist() == [-60.5, -61.0]
    assert gains.noise == {0: (-105.0, 4.0), 7: (-104.0, 0.0)}
    assert gains.nodes == {0, 2, 7}


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("gain 0 1 -60\ngain 0 1 -61\n", 2, "0 to 1"),
        ("gain 0 1 -60\ngain 3 3 -61\n", 2, "3 to 3"),
        ("gain 0 1 -60\nnoise 0 -105 4\nnoise 0 -105 4\n", 3, "node 0 again"),
        ("gain 0 1 -60\n0 1 -60\n", 2, "`0 1 -60`"),
        ("gain 0 1\n", 1, "`gain 0 1`"),
        ("gain a 1 -60\n", 1, "`a`"),
        ("gain 0 1 loud\n", 1, "`loud`"),
        ("gain 0 1 nan\n", 1, "`nan`"),
        ("gain 0 1 -60\nnoise 1 -105 -4\n", 2, "`-4`"),
        ("noise 1 -105 4\n", 1, "none"),
        ("", 1, "none"),
    ],
)
def test_each_refusal_names_its_line(tmp_path: Path, text: str, line: int, what: str) -> None:
    path = tmp_path / "gains.txt"
    path.write_text(text)
    with pytest.raises(ScenarioError) as raised:
        read_gains(path)
    assert f"gains.txt:{line}: expected" in str(raised.value)
    assert what in str(raised.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="check the path"):
        read_gains(tmp_path / "none.txt")
    (tmp_path / "packed.gz").write_bytes(b"\x1f\x8b\x08\x00\xff")
    with pytest.raises(ScenarioError, match="got a gzip file; unpack it: a file of the format `k7` may be"):
        read_gains(tmp_path / "packed.gz")


def test_the_225_nodes(measured_data: Path) -> None:
    gains = read_gains(measured_data / "15-15-medium-mica2-grid.txt")
    assert len(gains.gain_db) == 225 * 224
    assert gains.nodes == set(range(225))
    floors = np.array([gains.noise[node] for node in range(225)])
    assert floors[:, 0].mean() == pytest.approx(-105.0, abs=1e-3)
    assert set(floors[:, 1].tolist()) == {4.0}
