"""`netsim trace check`: one line a rule, exit status by what was found; and a real run passes."""

import sys
from pathlib import Path

import pytest
from in_process import netsim

sys.path.insert(0, str(Path(__file__).parents[1] / "audit"))

from good_trace import changed, good_rows, write_rows

from netsim.trace.events import Frame


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, scenarios: Path) -> Path:
    """A run of the quickstart in all detail."""
    folder = tmp_path_factory.mktemp("runs") / "quickstart"
    ended = netsim("run", scenarios / "quickstart.yaml", "--set", "trace.detail=full", "--out", folder)
    assert ended.returncode == 0, ended.stderr
    return folder


def test_a_run_passes(run: Path) -> None:
    ended = netsim("trace", "check", run, run / "trace.mcap")
    assert (ended.returncode, ended.stderr) == (0, "")
    lines = ended.stdout.splitlines()
    assert len(lines) == 2 * 31
    assert lines[0] == str(run / "trace.mcap")
    assert [line.split()[0] for line in lines[1:29]].count("ok") == 26
    assert lines[29].startswith("  fingerprint: ")
    assert lines[30] == "  ok: 26 rules hold"


def test_a_broken_law_is_told_with_its_place(run: Path, tmp_path: Path) -> None:
    broken = write_rows(tmp_path / "broken.mcap", changed(Frame, rx_outcome=[0, 0])(good_rows()))
    ended = netsim("trace", "check", broken, run)
    assert ended.returncode == 1
    assert "  broken  one outcome a listener         4 receptions, 1 wrong\n" in ended.stdout
    assert "            at 0.002 s, node 3: frame 1: received, but its destination is 2\n" in ended.stdout
    assert "1 rule of 28 broken" in ended.stdout
    assert "ok: 26 rules hold" in ended.stdout


def test_a_trace_cut_short_fails_with_a_clear_line(run: Path, tmp_path: Path) -> None:
    data = (run / "trace.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) - 300])
    ended = netsim("trace", "check", cut)
    assert ended.returncode == 1
    assert "cut short: what came after is lost; only the part that is there was checked" in ended.stdout
    assert "fingerprint: none, for want of the end" in ended.stdout
    assert ended.stderr == ""


def test_what_is_no_trace_does_not_stop_the_others(run: Path, tmp_path: Path) -> None:
    (tmp_path / "other.mcap").write_bytes(b"something else")
    ended = netsim("trace", "check", tmp_path / "other.mcap", tmp_path / "none.mcap", run)
    assert ended.returncode == 2
    assert ended.stderr.splitlines() == [
        f"error: {tmp_path / 'other.mcap'}: not an MCAP file",
        f"error: {tmp_path / 'none.mcap'}: cannot read the trace: No such file or directory",
    ]
    assert "ok: 26 rules hold" in ended.stdout
