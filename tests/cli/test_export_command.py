"""`netsim export`: several outputs at once, what is refused, what is left after a failure, a trace that was cut short."""

import io
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from in_process import netsim as run_netsim
from rich.console import Console

import netsim
from netsim.export import FORMATS, Job, Selection, export
from netsim.trace.reader import trace_metadata

HAS_FOXGLOVE = find_spec("foxglove_schemas_protobuf") is not None
NAMES = [name for name in FORMATS if name != "foxglove" or HAS_FOXGLOVE]


@pytest.fixture(scope="module")
def run(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "out"
    netsim.run(netsim.load(scenarios / "quickstart.yaml", ["duration_s=6"]), folder=folder)
    return folder


def places(folder: Path, names: list[str] = NAMES) -> dict[str, Path]:
    return {name: folder / (f"{name}.d" if FORMATS[name].is_folder else f"x{FORMATS[name].ending}") for name in names}


def options(outputs: dict[str, Path]) -> list[str]:
    return [word for name, path in outputs.items() for word in (f"--{name}", str(path))]


def test_several_outputs_in_one_call_and_again_with_force(run: Path, tmp_path: Path) -> None:
    outputs = places(tmp_path)
    done = run_netsim("export", run, *options(outputs))
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split(";")[0] for line in done.stdout.splitlines()] == [f"wrote {path}" for path in outputs.values()]
    again = run_netsim("export", run, *options(outputs))
    assert again.returncode == 2
    assert "got one that exists; name another, or replace it (--force)" in again.stderr
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert run_netsim("export", run, *options(outputs), "--force").returncode == 0
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_part_of_a_run(run: Path, tmp_path: Path) -> None:
    done = run_netsim(
        "export", run, "--parquet", tmp_path / "p", "--start", 1, "--end", 5, "--kinds", "belief", "--nodes", "n04"
    )
    assert done.returncode == 0, done.stderr
    frames = pq.read_table(tmp_path / "p" / "frames.parquet").to_pydict()
    assert set(frames["kind"]) == {"belief"}
    assert all(4 in ends for ends in zip(frames["source"], frames["destination"], strict=True))
    assert 1 <= min(frames["time_s"]) <= max(frames["time_s"]) < 5


REFUSED = {
    "no output": ([], "expected at least one output (--pcap, --csv, "),
    "ending": (["--pcap", "x.cap"], "expected the name of a file that ends in .pcap, got x.cap"),
    "folder missing": (["--pcap", "none/x.pcap"], "expected a folder that exists, got none; make it"),
    "file for a folder": (["--csv", "file.csv"], "expected a folder, got something else of this name"),
    "foreign files": (["--csv", "mixed", "--force"], "nothing but an earlier export, got one with notes.txt"),
    "foreign tables": (["--csv", "tables", "--force"], "nothing but an earlier export, got one with mine.csv"),
    "not empty": (["--csv", "mixed"], "expected a new or empty folder, got one with files"),
    "same place twice": (["--csv", "a", "--parquet", "a"], "got the same one twice"),
    "node without capture": (["--csv", "a", "--pcap-node", "n01"], "--pcap-node: expected --pcap as well"),
    "no such node": (["--pcap", "x.pcap", "--pcap-node", "n99"], "expected some of n00, "),
    "window after the end": (["--csv", "a", "--start", "90"], "expected a time up to 6 s, where the trace ends"),
    "window turned round": (
        ["--csv", "a", "--start", "3", "--end", "2"],
        "expected a time after the start (3 s), got 2 s",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(run: Path, tmp_path: Path, case: str) -> None:
    (tmp_path / "file.csv").write_text("mine")
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "notes.txt").write_text("mine")
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "mine.csv").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    arguments, expected = REFUSED[case]
    done = run_netsim("export", run, *arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert expected in done.stderr
    assert done.stderr.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_into_the_folder_where_one_is_and_through_links(run: Path, tmp_path: Path) -> None:
    here, linked = tmp_path / "here", tmp_path / "linked"
    here.mkdir()
    linked.symlink_to(here)
    assert run_netsim("export", run, "--csv", ".", cwd=here).returncode == 0
    assert (here / "frames.csv").exists()
    assert run_netsim("export", run, "--csv", linked, "--force").returncode == 0
    assert linked.is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here", "linked"]


def test_a_trace_is_never_replaced(run: Path) -> None:
    trace = run / "trace.mcap"
    done = run_netsim("export", run, "--foxglove", trace, "--force")
    assert done.returncode == 2
    assert "got a trace, which would be lost" in done.stderr
    assert trace_metadata(trace)


def test_of_a_run_without_frames_nothing_is_named_that_is_not_there(scenarios: Path, tmp_path: Path) -> None:
    silent = netsim.load(scenarios / "quickstart.yaml", ["algorithm.type=independent"])
    netsim.run(silent, folder=tmp_path / "silent")
    done = run_netsim("export", tmp_path / "silent", "--pcap", tmp_path / "x.pcap", "--csv", tmp_path / "x")
    assert done.returncode == 0
    assert "pcap: no frame is in the part that was asked for" in done.stderr
    assert f"pandas.read_csv('{tmp_path}/x/nodes.csv')" in done.stdout
    assert (tmp_path / "x" / "nodes.csv").exists()
    drawn = run_netsim("inspect", tmp_path / "silent", "--sequence", tmp_path / "x.svg")
    assert drawn.returncode == 2
    assert "the run sent no frames" in drawn.stderr


def test_a_missing_library_is_told_with_its_remedy(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove_schemas_protobuf", None)  # importing it fails
    done = run_netsim("export", run, "--foxglove", tmp_path / "x.mcap")
    assert done.returncode == 1
    assert "--foxglove: expected the package foxglove-schemas-protobuf" in done.stderr
    assert "pip install -e '.[foxglove]'" in done.stderr


def test_ctrl_c_leaves_nothing(run: Path, tmp_path: Path) -> None:
    def stop(now_ns: int, end_ns: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(Job(trace=run / "trace.mcap"), places(tmp_path), progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_a_terminal_shows_how_far_it_is(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Console(file=io.StringIO(), force_terminal=True, width=100)
    monkeypatch.setattr("netsim.cli.watching.is_terminal", lambda: True)
    monkeypatch.setattr("netsim.cli.watching.err", screen)
    done = run_netsim("export", run, "--pcap", tmp_path / "x.pcap")
    assert (done.returncode, done.stderr) == (0, "")
    assert isinstance(screen.file, io.StringIO)
    assert "exporting" in screen.file.getvalue()
    assert "of 6 s" in screen.file.getvalue()


@contextmanager
def small_files(limit_byte: int) -> Iterator[None]:
    """No file may grow beyond a size, as if the disk were full then."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit_byte, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit on the size of files")
@pytest.mark.parametrize("name", NAMES)
def test_a_full_disk_is_one_line_and_leaves_nothing(run: Path, tmp_path: Path, name: str) -> None:
    outputs = places(tmp_path, [name])
    with small_files(2500):
        done = run_netsim("export", run, *options(outputs))
    assert done.returncode == 1
    assert done.stderr == f"error: {outputs[name]}: cannot write the export: File too large\n"
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_earlier_export_as_it_was(run: Path, tmp_path: Path) -> None:
    outputs = places(tmp_path, ["pcap", "csv"])
    assert run_netsim("export", run, *options(outputs)).returncode == 0
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with small_files(2500):
        assert run_netsim("export", run, *options(outputs), "--force").returncode == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def without_end(content: bytes) -> bytes:
    """An MCAP file up to its record DATA_END (15)."""
    at = 8
    while content[at] != 15:
        at += 9 + int.from_bytes(content[at + 1 : at + 9], "little")
    return content[:at]


@pytest.mark.parametrize("window", [[], ["--start", "1"]])
def test_of_a_trace_that_was_cut_short_the_part_that_is_there(run: Path, tmp_path: Path, window: list[str]) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(without_end((run / "trace.mcap").read_bytes()))
    outputs = places(tmp_path)
    done = run_netsim("export", cut, *options(outputs), *window)
    assert done.returncode == 0
    assert done.stderr.startswith(f"warning: {cut}: the trace is cut short: what came after ")
    assert done.stderr.count("\n") == 1
    assert all(path.exists() for path in outputs.values())


def test_an_empty_window_gives_what_is_told_at_the_start(run: Path, tmp_path: Path) -> None:
    selection = Selection(start_ns=2_900_000_000, end_ns=2_900_000_001)
    with pytest.warns(UserWarning, match="no frame"):
        export(Job(trace=run / "trace.mcap", selection=selection), places(tmp_path, ["parquet", "pcap"]))
    found = {path.stem for path in (tmp_path / "parquet.d").iterdir()}
    assert found == {"nodes", "links", "field", "problem", "variables", "variable_edges", "metrics"}
    assert (tmp_path / "x.pcap").stat().st_size == 24
