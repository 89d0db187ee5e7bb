"""Bad input ends with status 2 and one clear line an error: place, expected, got, remedy; never a traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from netsim.cli import EXIT_PIPE_CLOSED, main

BASE = """\
kind: scenario
schema_version: 1
name: base
duration_s: 5
field: {width_m: 20, height_m: 20}
nodes:
  - name: sensors
    placement: {type: grid, rows: 2, columns: 2, spacing_m: 5}
problem:
  type: association
  detection_radius_m: 5
  targets: {type: listed, positions_m: [[10, 10]]}
algorithm:
  type: csmp
  tolerance: 0.1
"""


def netsim(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, str, str]:
    """Run the command line in this process; returns status, standard output, standard error."""
    monkeypatch.setattr(sys, "argv", ["netsim", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return int(ended.value.code or 0), captured.out, captured.err


CASES = {
    "unknown key": ("  tolerance: 0.1", "  tollerance: 0.1", 15, "algorithm.tollerance", "did you mean `tolerance`?"),
    "wrong unit": ("detection_radius_m: 5", "detection_radius_km: 0.005", 11, "problem.detection_radius_km", "radius_m"),
    "negative radius": ("detection_radius_m: 5", "detection_radius_m: -5", 11, "problem.detection_radius_m", "got -5"),
    "text for a number": ("duration_s: 5", "duration_s: 5 s", 4, "duration_s", "got"),
    "syntax error": ("field: {width_m: 20", "field: {width_m: 20]", 5, "", ""),
    "target outside the field": ("[[10, 10]]", "[[10, 10], [25, 3]]", 12, "problem.targets.positions_m[1]", "[25, 3]"),
    "unknown algorithm": ("type: csmp", "type: cmsp", 14, "algorithm.type", "did you mean `csmp`?"),
    "algorithm module missing": ("type: csmp", "type: nowhere:Thing", 14, "algorithm.type", "cannot import nowhere"),
    "nobody to collect": ("type: csmp\n  tolerance: 0.1", "type: collect-readings", 14, "algorithm.type", "role: sink"),
    "negative retries": ("algorithm:", "network: {type: geographic, retries: -5}\nalgorithm:", 13, "network.retries", "0"),
    "keys of another format": ("algorithm:", "medium: {type: trace, format: tossim, file: g, speed: 2}\nalgorithm:", 13,
        "medium", "no speed with format tossim"),
    "waypoints missing": ("  - name: sensors", "  - name: sensors\n    mobility: {type: waypoints, file: zz.csv}", 8,
        "nodes[0].mobility.file", "zz.csv: expected a CSV file of waypoints, got: no such file"),
    "radio unknown": ("  - name: sensors", "  - name: sensors\n    radio: cc2402", 8, "nodes[0].radio", "cc2420"),
    "power too high": ("  - name: sensors", "  - name: sensors\n    tx_power_dbm: 40", 8, "nodes[0].tx_power_dbm", "levels"),
    "CSV missing": ("{type: grid, rows: 2, columns: 2, spacing_m: 5}", "{type: csv, file: none.csv}", 8, "", "none.csv"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_each_error_names_place_and_remedy(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new, line, path, hint = CASES[case]
    assert old in BASE
    file = tmp_path / "s.yaml"
    file.write_text(BASE.replace(old, new))
    status, _, errors = netsim(monkeypatch, capsys, "check", str(file))
    assert status == 2
    first = errors.splitlines()[0]
    assert "Traceback" not in errors
    if case != "CSV missing":
        assert first.startswith(f"{file}:{line}: {path}"), first
    assert hint in first, first


def test_all_errors_come_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(
        BASE.replace("duration_s: 5", "duration_s: -1").replace("tolerance", "tolerence").replace("rows", "row")
    )
    status, _, errors = netsim(monkeypatch, capsys, "check", str(file))
    assert status == 2
    lines = errors.splitlines()
    assert [line.split(": ")[1] for line in lines[:-1]] == [
        "duration_s",
        "nodes[0].placement.row",
        "algorithm.tolerence",
    ]
    assert lines[-1] == "3 errors"


def test_duplicate_node_id_names_both_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "nodes.csv").write_text("id,x_m,y_m\n3,1,1\n4,2,2\n3,5,5\n")
    file = tmp_path / "s.yaml"
    file.write_text(BASE.replace("{type: grid, rows: 2, columns: 2, spacing_m: 5}", "{type: csv, file: nodes.csv}"))
    status, _, errors = netsim(monkeypatch, capsys, "run", str(file), "--out", str(tmp_path / "out"))
    assert status == 2
    assert "nodes.csv:4" in errors
    assert "3" in errors


def test_duplicate_node_id_across_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("id,x_m,y_m\n7,1,1\n")
    group = "  - name: {0}\n    placement: {{type: csv, file: {0}.csv}}\n"
    file = tmp_path / "s.yaml"
    start, _, rest = BASE.partition(
        "  - name: sensors\n    placement: {type: grid, rows: 2, columns: 2, spacing_m: 5}\n"
    )
    file.write_text(start + group.format("a") + group.format("b") + rest)
    status, _, errors = netsim(monkeypatch, capsys, "check", str(file))
    assert status == 2
    assert errors.startswith(f"{file}:10: nodes[1].placement: expected node ids that no other group uses, got id 7")


@pytest.mark.parametrize("command", ["run", "check"])
def test_missing_file(command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, errors = netsim(monkeypatch, capsys, command, "no/such/scenario.yaml")
    assert status == 2
    assert "no/such/scenario.yaml" in errors
    assert len(errors.splitlines()) <= 2


def test_unwritable_output_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(BASE)
    status, _, errors = netsim(monkeypatch, capsys, "run", str(file), "--out", str(file / "below-a-file"))
    assert status == 2
    assert errors.startswith("error: cannot write to")
    assert len(errors.splitlines()) == 1


def test_folder_of_another_run_is_not_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "s.yaml", tmp_path / "out"
    file.write_text(BASE)
    out.mkdir()
    (out / "thesis.txt").write_text("precious")
    status, _, errors = netsim(monkeypatch, capsys, "run", str(file), "--out", str(out))
    assert status == 2
    assert "--force" in errors
    assert [path.name for path in out.iterdir()] == ["thesis.txt"]


def test_bad_override_names_the_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(BASE)
    status, _, errors = netsim(monkeypatch, capsys, "run", str(file), "--set", "algorithm.tolerence=3")
    assert status == 2
    assert errors.startswith("error: --set algorithm.tolerence:")


@pytest.mark.parametrize("content", [b"", b"not a trace", b"\x89MCAP0\r\n"])
def test_not_a_trace(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "trace.mcap"
    file.write_bytes(content)
    for arguments in (("replay", str(file), "--save", str(tmp_path / "r.rrd")), ("trace", "info", str(file))):
        status, _, errors = netsim(monkeypatch, capsys, *arguments)
        assert status == 2
        assert errors.startswith("error: ")
        assert len(errors.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--save", "trace.mcap"), "--save trace.mcap: expected the name of a file that ends in .rrd"),
        (("--save", "no/r.rrd"), "--save no/r.rrd: expected a folder that exists, got no"),
        (("--save", "folder.rrd"), "--save folder.rrd: expected the name of a file, got that of a folder"),
        (
            ("--screenshot", "trace.mcap", "--at", "1"),
            "--screenshot trace.mcap: expected the name of a file that ends in",
        ),
    ],
)
def test_a_replay_goes_only_where_it_may(
    arguments: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("trace.mcap").write_bytes(b"mine")
    Path("folder.rrd").mkdir()
    status, _, errors = netsim(monkeypatch, capsys, "replay", "trace.mcap", *arguments)
    assert status == 2
    assert errors.startswith(f"error: {said}")
    assert Path("trace.mcap").read_bytes() == b"mine"


def test_plugins_can_be_forbidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "evil_plugin.py").write_text("raise SystemExit('ran')\n")
    file = tmp_path / "s.yaml"
    file.write_text(BASE.replace("type: csmp", "type: evil_plugin:Evil"))
    status, _, errors = netsim(monkeypatch, capsys, "check", "--no-plugins", str(file))
    assert status == 2
    assert "--no-plugins" in errors


def test_full_disk_is_one_line(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full on this system")
    file, out = tmp_path / "s.yaml", tmp_path / "out"
    file.write_text(BASE)
    out.mkdir()
    os.symlink("/dev/full", out / "trace.partial.mcap")
    command = [sys.executable, "-m", "netsim", "run", str(file), "--out", str(out), "--force"]
    code = "from netsim.scenario import folder; folder._clear = lambda *_: None; from netsim.cli import main; main()"
    ended = subprocess.run([sys.executable, "-c", code, *command[3:]], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith("error: ")
    assert "No space left" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("problem:\n  type: association\n  detection_radius_m: 5\n  targets: {type: listed, positions_m: [[10, 10]]}\n", "",
         "expected an algorithm for the problem `none`, got csmp"),
        ("  - name: sensors", "  - name: sensors\n    role: sink", "no node has a sensor"),
    ],
)  # fmt: skip
def test_parts_that_do_not_fit(
    old: str,
    new: str,
    expected: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(
        BASE.replace("{type: listed, positions_m: [[10, 10]]}", "{type: uniform}") if "sink" in new else BASE
    )
    file.write_text(file.read_text().replace(old, new))
    status, _, errors = netsim(monkeypatch, capsys, "check", str(file))
    assert status == 2
    assert errors.startswith(f"{file}:")
    assert expected in errors


@pytest.mark.parametrize("command", [["list"], ["schema"], ["run", "nothing.yaml"]])
def test_reader_who_is_gone_is_neither_success_nor_failure(command: list[str]) -> None:
    """Written by rich, by us in one go, and to standard error; typer and rich alone would end with status 1."""
    reading, writing = os.pipe()
    os.close(reading)
    ended = subprocess.run([sys.executable, "-m", "netsim", *command], stdout=writing, stderr=writing, check=False)
    os.close(writing)
    assert ended.returncode == EXIT_PIPE_CLOSED
