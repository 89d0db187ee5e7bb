"""`netsim check` and `netsim run` on device tables: traps are warnings, errors say where and why."""

import sys
from pathlib import Path

import pytest

from netsim.cli import main
from netsim.errors import ScenarioError
from netsim.models import device_tables

SHIPPED = Path(device_tables.__file__).parent / "data"
TRAP = "listening draws 0.06 mW but receiving 56.4 mW"
SCENARIO = """\
kind: scenario
schema_version: 1
name: trap
duration_s: 2
nodes:
  - {name: a, radio: mine.yaml, placement: {type: grid, rows: 1, columns: 2, spacing_m: 5}}
  - {name: b, radio: mine.yaml, placement: {type: grid, rows: 1, columns: 2, spacing_m: 7}}
algorithm: {type: neighbour-traffic, period_s: 1, rounds: 1}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A radio that prices listening as power-down, and a scenario with it."""
    (tmp_path / "cc2420.yaml").write_text((SHIPPED / "radios" / "cc2420.yaml").read_text())
    (tmp_path / "mine.yaml").write_text("extends: cc2420.yaml\nlisten_ma: {value: 0.02, source: wishful}\n")
    (tmp_path / "scenario.yaml").write_text(SCENARIO)
    return tmp_path


def netsim(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, str, str]:
    """Run the command line in this process; returns status, standard output, standard error."""
    monkeypatch.setattr(sys, "argv", ["netsim", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return int(ended.value.code or 0), captured.out, captured.err


def test_every_shipped_table_can_be_checked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    files = sorted(map(str, SHIPPED.glob("*/*.yaml")))
    status, out, err = netsim(monkeypatch, capsys, "check", *files)
    assert (status, out.count(": ok (")) == (0, len(files))
    assert all("first-order model" in line for line in err.splitlines())


def test_a_trap_is_a_warning(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = netsim(monkeypatch, capsys, "check", str(folder / "mine.yaml"))
    assert (status, "ok (radio CC2420)" in out, TRAP in err) == (0, True, True)
    status, _, err = netsim(monkeypatch, capsys, "check", str(folder / "scenario.yaml"))
    assert (status, err.count(TRAP)) == (0, 1)
    status, _, err = netsim(monkeypatch, capsys, "run", str(folder / "scenario.yaml"), "--out", str(folder / "run"))
    assert (status, err.count(TRAP)) == (0, 1)
    assert "warning: radio mine.yaml" in err


def test_an_error_in_a_table_has_its_line_and_the_reason(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "mine.yaml").write_text("extends: cc2420.yaml\nsleep_ma: {value: 0.02, source: my notes}\n")
    for file in ("mine.yaml", "scenario.yaml"):
        status, _, err = netsim(monkeypatch, capsys, "check", str(folder / file))
        assert (status, "mine.yaml:2: sleep_ma" in err, "424 uA" in err) == (2, True, True)


def test_a_battery_that_holds_two_things_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "name: both\nenergy_j: {value: 1, source: x}\nchemistry: {type: linear, energy_j: {value: 1, source: x}}\n"
    (folder / "cell.yaml").write_text(text)
    status, _, err = netsim(monkeypatch, capsys, "check", str(folder / "cell.yaml"))
    assert (status, "either energy_j or chemistry" in err) == (2, True)


def test_values_without_a_source_that_was_read_are_listed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _, out, _ = netsim(monkeypatch, capsys, "check", str(SHIPPED / "radios" / "cc2420.yaml"))
    assert "3 of 24 values are recalled or chosen" in out
    assert "switching_ma, power_down_to_idle_us, idle_to_listen_us" in out


def test_a_coin_cell_under_a_listening_radio_is_warned_of(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SCENARIO.replace("radio: mine.yaml", "battery: {type: device, device: coin_cell}")
    (folder / "scenario.yaml").write_text(text)
    status, _, err = netsim(monkeypatch, capsys, "check", str(folder / "scenario.yaml"))
    assert status == 0
    assert "warning: group a: CR2032 coin cell: good for 3 mA over longer times, but CC2420 draws 18.8 mA" in err


@pytest.mark.parametrize(("noise_dbm", "warned"), [(-95.4, True), (-117.03, False)])
def test_a_noise_that_makes_a_radio_deaf_is_warned_of(
    noise_dbm: float, warned: bool, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "lora.yaml"
    path.write_text(
        "kind: scenario\nschema_version: 1\nname: lora\nmac: {type: aloha}\nnetwork: {type: one-hop}\n"
        "nodes: [{name: a, placement: {type: grid, rows: 1, columns: 2, spacing_m: 90}, radio: sx1276, tx_power_dbm: 14}]\n"
        f"medium: {{type: log-distance, noise_dbm: {noise_dbm}}}\nalgorithm: {{type: neighbour-traffic}}\n"
    )
    status, _, err = netsim(monkeypatch, capsys, "check", str(path))
    assert status == 0
    assert ("SX1276 is 22 dB deafer than its sensitivity of -126.5 dBm says; -117.0 dBm meets it" in err) == warned


def test_of_a_table_of_another_kind_only_that_is_said(folder: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        device_tables.load_radio(str(SHIPPED / "cpus" / "msp430.yaml"), folder)
    assert [finding.path for finding in caught.value.findings] == ["kind"]


def test_a_bare_number_is_shown_with_its_source(folder: Path) -> None:
    (folder / "mine.yaml").write_text("extends: cc2420.yaml\nlisten_ma: 18.8\n")
    with pytest.raises(ScenarioError, match=r"write `listen_ma: \{value: 18.8, source: ...\}`"):
        device_tables.load_radio("mine.yaml", folder)
