"""What a trace is converted to passes Rerun's own verification, also of a trace that was cut short."""

import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from synthetic import write_synthetic

from netsim import replay
from netsim.trace.reader import TruncatedTraceWarning


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("verify") / "trace.mcap"
    write_synthetic(path)
    return path


def rerun() -> str:
    """The command `rerun` that comes with the library."""
    found = shutil.which("rerun", path=str(Path(sys.executable).parent)) or shutil.which("rerun")
    if found is None:
        pytest.skip("needs the command `rerun`, which comes with rerun-sdk")
    return found


def verify(recording: Path) -> None:
    ended = subprocess.run([rerun(), "rrd", "verify", str(recording)], capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_a_recording_passes(trace: Path, tmp_path: Path) -> None:
    replay.save(trace, tmp_path / "t.rrd")
    verify(tmp_path / "t.rrd")


def test_a_recording_of_a_cut_trace_passes_after_a_warning(trace: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    data = trace.read_bytes()
    cut.write_bytes(data[: int(len(data) * 0.9)])
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        replay.save(cut, tmp_path / "cut.rrd")
    assert [each.category for each in told if each.category is TruncatedTraceWarning]
    verify(tmp_path / "cut.rrd")
