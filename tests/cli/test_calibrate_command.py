"""`netsim calibrate`: what it writes can be used, and what is wrong with a log is said with its place."""

import gzip
import sys

import pytest

from netsim.cli import main

GOOD = "source,destination,rssi_dbm,sent,received\n" + "".join(
    f"{a},{b},{-85 - 1.5 * (a + b) + 0.3 * a},100,{max(0, min(100, 300 - 60 * (a + b) + 7 * (b % 2)))}\n"
    for a in range(5)
    for b in range(5)
    if a != b
)
SCENARIO = """\
extends: medium.yaml
kind: scenario
schema_version: 1
name: calibrated
duration_s: 5
field: {width_m: 20, height_m: 20}
nodes:
  - name: sensors
    placement: {type: grid, rows: 2, columns: 2, spacing_m: 5}
problem:
  type: association
  detection_radius_m: 5
  targets: {type: listed, positions_m: [[10, 10]]}
algorithm: {type: csmp, tolerance: 0.1}
"""


def netsim(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Run the command line in this process; returns status, standard output, standard error."""
    monkeypatch.setattr(sys, "argv", ["netsim", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return int(ended.value.code or 0), captured.out, captured.err


def test_the_medium_it_writes_passes_check(tmp_path, monkeypatch, capsys):
    log, nodes, out = tmp_path / "log.csv", tmp_path / "nodes.csv", tmp_path / "medium.yaml"
    log.write_text(GOOD, encoding="utf-8")
    nodes.write_text("id,x_m,y_m\n0,0,0\n1,9,0\n2,18,3\n3,27,1\n4,36,8\n", encoding="utf-8")
    words = ["--positions", str(nodes), "--out", str(out), "--frame-byte", "50"]
    status, shown, told = netsim(monkeypatch, capsys, "calibrate", str(log), *words)
    assert status == 0, told
    assert "Reception against received power" in shown
    assert "path-loss exponent" in shown
    assert "extends: medium.yaml" in told
    assert "exponent:" in out.read_text(encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    status, shown, told = netsim(monkeypatch, capsys, "check", str(tmp_path / "scenario.yaml"))
    assert status == 0, told


def test_a_k7_log_becomes_a_replay_that_passes_check(tmp_path, monkeypatch, capsys):
    lines = ['{"tx_length": 60, "start_date": "2020-01-01T00:00:00", "stop_date": "2020-01-01T01:00:00"}']
    lines += ["datetime,src,dst,channel,mean_rssi,pdr,tx_count"]
    pairs = [(a, b) for a in range(4) for b in range(4) if a != b]
    lines += [f"2020-01-01T00:00:{a:02d},{a},{b},15,{-60 - 3 * (a + b)},{1 - 0.1 * (a + b):.2f},100" for a, b in pairs]
    (tmp_path / "bed.k7").write_text("\n".join(lines) + "\n", encoding="utf-8")
    out = tmp_path / "medium.yaml"
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(tmp_path / "bed.k7"), "--out", str(out))
    assert status == 0, told
    assert "type: trace" in out.read_text(encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    status, _, told = netsim(monkeypatch, capsys, "check", str(tmp_path / "scenario.yaml"))
    assert status == 0, told


def test_without_out_the_medium_is_printed(tmp_path, monkeypatch, capsys):
    log = tmp_path / "log.csv"
    log.write_text(GOOD, encoding="utf-8")
    status, shown, told = netsim(monkeypatch, capsys, "calibrate", str(log))
    assert status == 0
    assert "\nmedium:\n  type: log-distance\n" in shown
    assert "path loss, shadowing and asymmetry are left out" in told


def test_a_picture_is_written(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    (tmp_path / "log.csv").write_text(GOOD, encoding="utf-8")
    picture = tmp_path / "fits.png"
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(tmp_path / "log.csv"), "--plot", str(picture))
    assert status == 0, told
    assert picture.read_bytes().startswith(b"\x89PNG")


CASES = {
    "empty": (b"", ":1:", "an empty file"),
    "header only": (b"source,destination,rssi_dbm,received\n", ":1:", "at least one row"),
    "column misnamed": (b"source,destination,rssi,received\n1,2,-80,1\n", ":1:", "rename `rssi` to `rssi_dbm`"),
    "no counts": (b"source,destination,rssi_dbm\n1,2,-80\n", ":1:", "sent and received; pdr and tx_count"),
    "column twice": (b"source,destination,rssi_dbm,received,received\n1,2,-80,1,1\n", ":1:", "comes twice"),
    "no number": (b"source,destination,rssi_dbm,received\n1,2,-80,1\n1,2,strong,1\n", ":3: rssi_dbm", "`strong`"),
    "raw register": (b"source,destination,rssi_dbm,received\n1,2,200,1\n", ":2: rssi_dbm", "a power in dBm"),
    "not a number": (b"source,destination,rssi_dbm,received\n1,2,nan,1\n", ":2: rssi_dbm", "a power in dBm"),
    "power missing": (b"source,destination,rssi_dbm,received\n1,2,,1\n", ":2: rssi_dbm", "a power where frames"),
    "count for a flag": (
        b"source,destination,rssi_dbm,received\n1,2,-80,7\n",
        ":2: received",
        "for counts give `sent`",
    ),
    "more than sent": (b"source,destination,rssi_dbm,sent,received\n1,2,-80,7,8\n", ":2: received", "as were sent"),
    "ratio above one": (b"source,destination,rssi_dbm,pdr,tx_count\n1,2,-80,1.5,9\n", ":2: pdr", "a ratio from 0 to 1"),
    "half a frame": (b"source,destination,rssi_dbm,pdr,tx_count\n1,2,-80,1,9.5\n", ":2: tx_count", "a whole number"),
    "to itself": (b"source,destination,rssi_dbm,received\n1,1,-80,1\n", ":2: destination", "another node"),
    "nameless": (b"source,destination,rssi_dbm,received\n,1,-80,1\n", ":2: source", "the name of a node"),
    "short row": (b"source,destination,rssi_dbm,received\n1,2,-80\n", ":2:", "expected 4 columns"),
    "not text": (b"source,destination\n\xff\xfe\n", ":2:", "the byte 0xff"),
    "gzip cut short": (gzip.compress(GOOD.encode())[:-30], ":1:", "copy or download it again"),
    "K7 without columns": (b'{"location": "here"}\ndatetime,src,dst\n', ":2:", "mean_rssi"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_with_a_log_is_said_with_its_place(case, tmp_path, monkeypatch, capsys):
    content, place, words = CASES[case]
    log = tmp_path / "log.csv"
    log.write_bytes(content)
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(log))
    assert status == 2
    assert f"{log}{place}" in told
    assert words in told
    assert "Traceback" not in told


def test_a_log_that_is_not_there(tmp_path, monkeypatch, capsys):
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(tmp_path / "none.csv"))
    assert status == 2
    assert "No such file" in told


def test_a_file_is_not_overwritten_unless_forced(tmp_path, monkeypatch, capsys):
    log, out = tmp_path / "log.csv", tmp_path / "medium.yaml"
    log.write_text(GOOD, encoding="utf-8")
    out.write_text("mine", encoding="utf-8")
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(log), "--out", str(out))
    assert (status, out.read_text(encoding="utf-8")) == (2, "mine")
    assert "--force" in told
    assert netsim(monkeypatch, capsys, "calibrate", str(log), "--out", str(out), "--force")[0] == 0
    assert "medium:" in out.read_text(encoding="utf-8")
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(log), "--out", str(tmp_path / "no" / "x.yaml"))
    assert status == 2
    assert "cannot write" in told


def test_semicolons_are_suspected(tmp_path, monkeypatch, capsys):
    log = tmp_path / "log.csv"
    log.write_text(GOOD.replace(",", ";"), encoding="utf-8")
    status, _, told = netsim(monkeypatch, capsys, "calibrate", str(log))
    assert status == 2
    assert "separated by semicolons" in told
