"""Device tables: data-sheet values arrive in the right units, wrong tables are refused by name, traps are warned of."""

import math
import pickle
from dataclasses import replace
from pathlib import Path

import pytest

from netsim.errors import InvariantError, ScenarioError
from netsim.models.batteries import PeukertParameters
from netsim.models.device_checks import device_findings
from netsim.models.device_tables import load_battery, load_cpu, load_device, load_radio, shipped
from netsim.models.devices import BatteryDevice, RadioDevice

HERE = Path(__file__).parent
SHIPPED_RADIO = HERE.parents[1] / "netsim" / "models" / "data" / "radios" / "cc2420.yaml"


@pytest.fixture(scope="module")
def cc2420() -> RadioDevice:
    return load_radio("cc2420", HERE)


def test_cc2420_powers_are_the_data_sheet_currents_at_3_volt(cc2420: RadioDevice) -> None:
    powers = (cc2420.off_mw, cc2420.power_down_mw, cc2420.idle_mw, cc2420.listen_mw, cc2420.receive_mw)
    assert powers == pytest.approx((6e-5, 0.06, 1.278, 56.4, 56.4))
    assert cc2420.transmit_mw == pytest.approx({0.0: 52.2, -5.0: 42.0, -10.0: 33.0, -15.0: 29.7, -25.0: 25.5})


def test_cc2420_timing(cc2420: RadioDevice) -> None:
    assert (cc2420.turnaround_ns, cc2420.idle_wake_ns, cc2420.symbol_ns) == (192_000, 192_000, 16_000)
    assert cc2420.wake_ns == 860_000 + 192_000  # the oscillator starts, then the synthesiser locks
    assert cc2420.wake_mw * cc2420.wake_ns == pytest.approx(1.278 * 860_000 + 56.4 * 192_000)
    assert cc2420.preamble_ns == 5 * 32_000
    assert cc2420.turnaround_ns == 12 * cc2420.symbol_ns
    assert isinstance(cc2420.turnaround_ns, int)


@pytest.mark.parametrize(("psdu_byte", "airtime_ns"), [(0, 192_000), (5, 352_000), (20, 832_000), (127, 4_256_000)])
def test_cc2420_airtime(cc2420: RadioDevice, psdu_byte: int, airtime_ns: int) -> None:
    assert cc2420.airtime_ns(psdu_byte) == airtime_ns


@pytest.mark.parametrize("psdu_byte", [-1, 128])
def test_frames_the_radio_cannot_take_are_a_defect(cc2420: RadioDevice, psdu_byte: int) -> None:
    with pytest.raises(InvariantError, match=f"{psdu_byte} bytes .* 0 to 127"):
        cc2420.airtime_ns(psdu_byte)


def test_airtime_is_rounded_to_the_nearest_nanosecond(cc2420: RadioDevice) -> None:
    slow = replace(cc2420, bitrate_bps=19_200, phy_header_byte=0)
    assert [slow.airtime_ns(n) for n in (1, 2, 3)] == [416_667, 833_333, 1_250_000]


def test_transmit_power_at_and_between_levels(cc2420: RadioDevice) -> None:
    for level, power in cc2420.transmit_mw.items():
        assert cc2420.transmit_power_mw(level) == power
    assert cc2420.transmit_power_mw(-2.5) == pytest.approx((52.2 + 42.0) / 2)
    assert cc2420.transmit_power_mw(-17.0) == pytest.approx(0.8 * 29.7 + 0.2 * 25.5)


@pytest.mark.parametrize("level", [0.1, -25.1, math.nan, math.inf])
def test_transmit_power_outside_the_levels_names_them(cc2420: RadioDevice, level: float) -> None:
    with pytest.raises(ScenarioError, match=r"CC2420 .* -25, -15, -10, -5, 0 dBm"):
        cc2420.transmit_power_mw(level)


def test_cpus_and_batteries() -> None:
    msp430, cortex = (load_cpu(name, HERE) for name in ("msp430", "cortex_m4"))
    assert (msp430.active_mw, msp430.sleep_mw) == pytest.approx((5.4, 0.1635))
    assert cortex.operations_per_s > 100 * msp430.operations_per_s
    assert cortex.active_mw / cortex.operations_per_s < msp430.active_mw / msp430.operations_per_s
    assert load_battery("aa_pair", HERE).energy_j == 18_720.0
    assert load_battery("ideal", HERE).energy_j == math.inf
    assert 0.0 < load_battery("coin_cell", HERE).energy_j < load_battery("aa_pair", HERE).energy_j


@pytest.mark.parametrize(
    ("name", "listen_mw", "tx_power_dbm", "transmit_mw", "power_down_mw"),
    [
        ("cc1000", 3 * 7.03, 0, 3 * 8.47, 3 * 0.0002),  # PowerTOSSIM MICA2
        ("cc2420", 3 * 18.8, -5, 3 * 14.0, 3 * 0.020),
        ("cc2538", 3 * 20.0, 7, 3 * 34.0, 3 * 0.0013),
        ("nrf52840", 3 * 6.53, 8, 3 * 16.40, 0.0),
        ("sx1276", 3.3 * 11.2, 14, 3.3 * 44, 3.3 * 0.0015),
    ],
)
def test_powers_of_shipped_radios(
    name: str, listen_mw: float, tx_power_dbm: float, transmit_mw: float, power_down_mw: float
) -> None:
    radio = load_radio(name, HERE)
    found = (radio.listen_mw, radio.receive_mw, radio.transmit_power_mw(tx_power_dbm), radio.power_down_mw)
    assert found == pytest.approx((listen_mw, listen_mw, transmit_mw, power_down_mw))


def test_cpus_of_the_papers() -> None:
    sh4, atmega = load_cpu("sh4_7751", HERE), load_cpu("atmega128l", HERE)
    assert sh4.active_mw / 300e6 * 1e6 == pytest.approx(1.33, abs=0.005)  # nJ an instruction at 300 MIPS
    assert (atmega.active_mw, atmega.sleep_mw) == pytest.approx((24.0, 0.33))


RADIOS = ["cc1000", "cc2420", "cc2538", "first_order", "nrf52840", "sx1276", "wins2"]
CPUS = ["atmega128l", "cortex_m4", "msp430", "sh4_7751"]
BATTERIES = ["aa_pair", "aa_pair_peukert", "coin_cell", "ideal", "itsy_rv"]


def test_what_is_shipped() -> None:
    assert (shipped("radios"), shipped("cpus"), shipped("batteries")) == (RADIOS, CPUS, BATTERIES)


@pytest.mark.parametrize(
    "device",
    [
        *[load_radio(name, HERE) for name in RADIOS if name != "first_order"],
        *[load_cpu(name, HERE) for name in CPUS],
        *[load_battery(name, HERE) for name in BATTERIES],
    ],
    ids=lambda device: device.name,
)
def test_shipped_devices_have_no_trap(device: object) -> None:
    assert device_findings(device) == []  # type: ignore[arg-type]


def test_the_first_order_model_is_warned_of() -> None:
    findings = "\n".join(device_findings(load_radio("first_order", HERE)))
    assert "listening draws 0 mW but receiving 50 mW" in findings
    assert "waking from power-down takes no time" in findings


@pytest.mark.parametrize("folder", ["radios", "cpus", "batteries"])
def test_a_table_is_recognised_for_what_it_is(folder: str) -> None:
    for path in (SHIPPED_RADIO.parents[1] / folder).glob("*.yaml"):
        device = load_device(path)
        assert device is not None
        assert type(device).__name__.lower().startswith({"radios": "radio", "cpus": "cpu", "batteries": "batt"}[folder])


def test_a_table_without_kind_is_known_by_its_keys(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(SHIPPED_RADIO.read_text().replace("kind: radio\n", ""))
    assert isinstance(load_device(tmp_path / "mine.yaml"), RadioDevice)
    (tmp_path / "cell.yaml").write_text("name: cell\nenergy_j: {value: 3, source: mine}\n")
    assert load_device(tmp_path / "cell.yaml") == BatteryDevice("cell", 3.0)
    (tmp_path / "scenario.yaml").write_text("kind: scenario\nname: x\n")
    assert load_device(tmp_path / "scenario.yaml") is None


@pytest.mark.parametrize(("key", "words"), [("sleep_ma", "424 uA"), ("wake_us", "power_down_to_idle_us")])
def test_keys_refused_on_purpose_say_why(tmp_path: Path, key: str, words: str) -> None:
    (tmp_path / "mine.yaml").write_text(SHIPPED_RADIO.read_text() + f"{key}: {{value: 0.02, source: mine}}\n")
    with pytest.raises(ScenarioError) as caught:
        load_radio("mine.yaml", tmp_path)
    (finding,) = caught.value.findings
    assert (finding.path, words in finding.remedy) == (key, True)


def test_devices_travel_to_other_processes(cc2420: RadioDevice) -> None:
    assert pickle.loads(pickle.dumps(cc2420)) == cc2420


def test_own_table_by_relative_path(tmp_path: Path) -> None:
    text = SHIPPED_RADIO.read_text()
    assert text.count("name: CC2420") == 1
    (tmp_path / "mine.yaml").write_text(text.replace("name: CC2420", "name: mine"))
    assert load_radio("mine.yaml", tmp_path).name == "mine"


def test_unknown_device_names_what_there_is_and_the_nearest() -> None:
    with pytest.raises(ScenarioError, match=r"expected one of cc1000, cc2420.* did you mean `cc2420`\?"):
        load_radio("CC2402", HERE)
    with pytest.raises(ScenarioError, match="aa_pair, aa_pair_peukert, coin_cell, ideal, itsy_rv") as caught:
        load_battery("reactor", HERE)
    assert "did you mean" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ("idle_ma:", "idle_mw:", ("idle_ma", "idle_mw")),
        ("{value: 0.426, source:", "{value: -0.426, source:", ("idle_ma",)),
        ("{value: 250000, source:", "{value: fast, source:", ("bitrate_bps",)),
        ('source: "ns-3 lr-wpan: a preamble is caught above -5 dB"', 'unverified: true', ("preamble_lock_sinr_db",)),
        ("supply_v: {value: 3.0", "supply_v: {value: .nan", ("supply_v",)),
    ],
)  # fmt: skip
def test_wrong_tables_are_refused(tmp_path: Path, old: str, new: str, names: tuple[str, ...]) -> None:
    text = SHIPPED_RADIO.read_text()
    assert text.count(old) == 1
    (tmp_path / "wrong.yaml").write_text(text.replace(old, new))
    with pytest.raises(ScenarioError) as caught:
        load_radio("wrong.yaml", tmp_path)
    assert all(name in str(caught.value) for name in names)


@pytest.mark.parametrize(
    ("change", "warning"),
    [
        ({"listen_mw": 0.006}, "listening draws 0.006 mW but receiving 56.4 mW"),
        ({"power_down_mw": 1.4}, "more than idle"),
        ({"power_down_mw": 1.278}, "as idle does"),
        ({"power_down_mw": 1e-6}, "off draws 6e-05 mW, more than power-down"),
        ({"wake_ns": 0}, "waking from power-down takes no time"),
        ({"turnaround_ns": 0}, "turnaround takes no time"),
        ({"cca_threshold_dbm": -110.0}, "below its own sensitivity"),
        ({"transmit_mw": {0.0: 52.2, 20.0: 99.0}}, "radiates more than it draws"),
    ],
)
def test_traps_are_warned_of(cc2420: RadioDevice, change: dict[str, float], warning: str) -> None:
    (finding,) = device_findings(replace(cc2420, **change))  # type: ignore[arg-type]
    assert finding.startswith("CC2420: ")
    assert warning in finding


def test_traps_of_cpus_and_batteries() -> None:
    cpu = load_cpu("cortex_m4", HERE)
    assert "as much as active" in device_findings(replace(cpu, sleep_mw=10.0))[0]
    assert "clock rate" in device_findings(replace(cpu, operations_per_s=64e9))[0]
    assert "draws nothing" in device_findings(replace(cpu, active_mw=0.0, operations_per_s=1e3))[-1]
    peukert = PeukertParameters(capacity_mah=1000.0, rated_current_ma=5000.0, exponent=1.0, supply_v=3.0)
    findings = device_findings(BatteryDevice("mine", peukert.energy_j, peukert))
    assert ["0.2 h" in findings[0], "linear" in findings[1]] == [True, True]


def test_findings_name_the_line(tmp_path: Path) -> None:
    lines = SHIPPED_RADIO.read_text().splitlines()
    line = next(number for number, text in enumerate(lines, 1) if text.startswith("idle_ma:"))
    lines[line - 1] = lines[line - 1].replace("0.426", "much")
    (tmp_path / "wrong.yaml").write_text("\n".join(lines))
    with pytest.raises(ScenarioError) as caught:
        load_radio("wrong.yaml", tmp_path)
    assert [(finding.line, finding.path) for finding in caught.value.findings] == [(line, "idle_ma.value")]


def test_a_radio_without_transmit_levels_is_refused(tmp_path: Path) -> None:
    lines = [text for text in SHIPPED_RADIO.read_text().splitlines() if not text.startswith("  ")]
    text = "\n".join("transmit_ma: {}" if text.startswith("transmit_ma:") else text for text in lines)
    (tmp_path / "mute.yaml").write_text(text)
    with pytest.raises(ScenarioError, match="transmit_ma"):
        load_radio("mute.yaml", tmp_path)


def test_own_table_may_change_a_copy(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(SHIPPED_RADIO.read_text())
    (tmp_path / "mine.yaml").write_text("extends: base.yaml\npower_down_ma: {value: 0.001, source: measured}\n")
    mine = load_radio("mine.yaml", tmp_path)
    assert mine.power_down_mw == pytest.approx(0.003)
    assert mine == replace(load_radio("cc2420", HERE), power_down_mw=mine.power_down_mw)


def test_a_table_that_changes_is_read_again(tmp_path: Path) -> None:
    text = (SHIPPED_RADIO.parents[1] / "cpus" / "cortex_m4.yaml").read_text()
    table = tmp_path / "mine.yaml"
    table.write_text(text)
    before = load_cpu("mine.yaml", tmp_path)
    assert load_cpu("mine.yaml", tmp_path) is before
    table.write_text(text.replace("name: Cortex-M4F at 64 MHz", "name: mine"))
    assert load_cpu("mine.yaml", tmp_path).name == "mine"
    table.unlink()
    with pytest.raises(ScenarioError):
        load_cpu("mine.yaml", tmp_path)
