"""From a scenario's words to devices: LoRa settings, ranges, batteries and harvesters, and what does not go together."""

from pathlib import Path

import pytest

from netsim.errors import ScenarioError
from netsim.models.batteries import PeukertParameters, RakhmatovVrudhulaParameters
from netsim.models.device_tables import shipped
from netsim.models.harvest import DayHarvest
from netsim.rng import Streams
from netsim.scenario.load import load
from netsim.scenario.places import places
from netsim.scenario.run import run

HEAD = """\
kind: scenario
schema_version: 1
name: equipment
duration_s: 60
algorithm: {type: neighbour-traffic, period_s: 5, payload_byte: 20, rounds: 3}
medium: {type: ideal, range_m: 60}
mac: {type: ideal}
nodes:
"""


def scenario(tmp_path: Path, *groups: str) -> Path:
    """A scenario with one group for each text of further settings."""
    path = tmp_path / "scenario.yaml"
    rows = [
        f"  - {{name: g{number}, placement: {{type: grid, rows: 1, columns: 2, spacing_m: 50}}, {group}}}\n"
        for number, group in enumerate(groups)
    ]
    path.write_text(HEAD + "".join(rows))
    return path


def placed(tmp_path: Path, *groups: str):
    return places(load(scenario(tmp_path, *groups)), Streams(1, 0))


def refused(tmp_path: Path, *groups: str) -> str:
    with pytest.raises(ScenarioError) as caught:
        placed(tmp_path, *groups)
    (finding,) = caught.value.findings
    return str(finding)


LORA = "radio: sx1276, tx_power_dbm: 14, lora: {spreading_factor: %d}"


def test_lora_settings_reach_the_radio(tmp_path):
    node = placed(tmp_path, LORA % 9)[0]
    assert (node.radio.symbol_ns, node.radio.lora.settings.spreading_factor) == (4_096_000, 9)
    assert placed(tmp_path, "radio: sx1276")[0].radio.lora.settings.spreading_factor == 7


def test_lora_settings_of_other_radios_are_refused(tmp_path):
    assert "nodes[0].lora: CC2420 is not a LoRa radio" in refused(tmp_path, "lora: {spreading_factor: 9}")


def test_spreading_factors_do_not_hear_each_other(tmp_path):
    text = refused(tmp_path, LORA % 9, LORA % 10)
    assert "nodes[1].radio: expected a radio with the physical layer of SX1276 (LoRa SF9, 125 kHz" in text
    assert "got SX1276 (LoRa SF10" in text
    assert "the same `lora` settings" in text


@pytest.mark.parametrize("other", ["cc1000", "wins2, tx_power_dbm: 10", "first_order"])
def test_modulations_do_not_hear_each_other(tmp_path, other):
    assert "the physical layer of CC2420 (250000 bit/s, o-qpsk)" in refused(
        tmp_path, "radio: cc2420", f"radio: {other}"
    )


def test_radios_of_one_standard_hear_each_other(tmp_path):
    nodes = placed(tmp_path, "radio: cc2420", "radio: cc2538", "radio: nrf52840")
    assert [node.radio.name for node in nodes[::2]] == ["CC2420", "CC2538", "nRF52840"]


def test_a_range_becomes_the_power_of_the_first_order_model(tmp_path):
    node = placed(tmp_path, "radio: first_order, tx_range_m: 50")[0]
    # 10 pJ/bit/m^2 * 2500 m^2 * 1 Mbit/s = 25 mW
    assert node.radio.transmit_power_mw(node.group.tx_power_dbm) == pytest.approx(50.0 + 25.0)
    text = refused(tmp_path, "radio: cc2420, tx_range_m: 50")
    assert "nodes[0].tx_range_m: CC2420 has no law from range to power" in text


def test_batteries_inline_and_from_tables(tmp_path):
    inline = "battery: {type: peukert, capacity_mah: 100, rated_current_ma: 5, exponent: 1.2, supply_v: 3}"
    battery = placed(tmp_path, inline)[0].battery
    assert (battery.energy_j, type(battery.chemistry)) == (pytest.approx(1080.0), PeukertParameters)
    battery = placed(tmp_path, "battery: {type: device, device: itsy_rv}")[0].battery
    assert isinstance(battery.chemistry, RakhmatovVrudhulaParameters)
    assert battery.energy_j == pytest.approx(35_220 * 60e-3 * 3.6)


@pytest.mark.parametrize("battery", ["{type: mains}", "{type: device, device: itsy_rv}"])
def test_only_linear_batteries_can_be_charged(tmp_path, battery):
    text = refused(tmp_path, f"battery: {battery}, harvester: {{type: constant, power_mw: 1}}")
    assert "nodes[0].harvester: expected a linear battery to charge" in text


def test_everything_survives_in_the_resolved_scenario(tmp_path):
    group = (
        LORA % 8
        + ", battery: {type: capacity, energy_j: 5}, harvester: {type: day, peak_mw: 50, start_h: 11, efficiency: 0.5}"
    )
    loaded = load(scenario(tmp_path, group))
    (tmp_path / "run").mkdir()
    first = run(loaded, folder=tmp_path / "run")
    again = load(tmp_path / "run" / "scenario.yaml")
    assert again.scenario.nodes[0].lora.spreading_factor == 8
    assert isinstance(again.scenario.nodes[0].harvester, DayHarvest)
    assert run(again).metrics == first.metrics
    assert first.metrics["energy_harvested_j"] == pytest.approx(
        2 * 25e-3 * first.metrics["simulated_s"] * 0.973, rel=0.01
    )


def test_a_message_over_lora_takes_its_airtime(tmp_path):
    """20 bytes and headers at SF12 are more than a second on the air, each second at 44 mA and 3.3 V."""
    result = run(load(scenario(tmp_path, LORA % 12)))
    sent_j = result.metrics["energy_by_state_j"]["radio.transmit"]
    rows = zip(result.ledger.device, result.ledger.state, result.ledger.time_s, strict=True)
    airtime_s = sum(time_s for device, state, time_s in rows if (device, state) == ("radio", "transmit"))
    assert airtime_s > 6 * 1.0
    assert sent_j == pytest.approx(airtime_s * 44e-3 * 3.3)


@pytest.mark.parametrize("radio", shipped("radios"))
def test_every_radio_can_hold_a_conversation_with_acknowledgements(tmp_path, radio):
    """The MAC counts its waits in the radio's symbols: an acknowledgement must fit into them with every radio."""
    path = scenario(
        tmp_path, f"radio: {radio}, tx_power_dbm: 10" if radio in ("wins2", "sx1276") else f"radio: {radio}"
    )
    path.write_text(path.read_text().replace("mac: {type: ideal}", "mac: {type: csma}"))
    metrics = run(load(path)).metrics
    assert (metrics["delivery_ratio_unicast"], metrics["drops_by_reason"]) == (1.0, {})
