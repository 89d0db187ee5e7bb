"""LoRa airtimes against the data sheet's formula worked out by hand, and sensitivities against their measurements."""

from dataclasses import replace
from pathlib import Path

import pytest

from netsim.errors import ScenarioError
from netsim.models.device_tables import find_table, load_radio
from netsim.models.devices import lora_radio
from netsim.models.lora import LoraParameters, noise_floor_dbm

HERE = Path(__file__).parent


@pytest.mark.parametrize(
    ("settings", "payload_byte", "airtime_us"),
    [
        # symbol 1.024 ms; (8*10 - 28 + 28 + 16) / 28 = 3.4: 4 blocks of 5, and 8: 28 symbols after 12.25
        ({"spreading_factor": 7}, 10, 41_216),
        # 23 bytes, LoRaWAN's 13 and a payload of 10: 200 / 28 = 7.1: 8 blocks: 48 + 12.25 symbols; calculators: 61.7 ms
        ({"spreading_factor": 7}, 23, 61_696),
        # symbol 32.768 ms, optimised: 180 / 40 = 4.5: 5 blocks: 33 + 12.25 symbols; calculators: 1482.8 ms
        ({"spreading_factor": 12}, 23, 1_482_752),
        # without the optimisation: 180 / 48: 4 blocks: 28 + 12.25 symbols
        ({"spreading_factor": 12, "low_data_rate_optimisation": "off"}, 23, 1_318_912),
        # SF11 at 125 kHz has symbols of 16.384 ms and is optimised too: 184 / 36: 6 blocks: 38 + 12.25
        ({"spreading_factor": 11}, 23, 823_296),
        # symbol 4.096 ms, coding rate 4/8, no header, no checksum, long preamble: (160 - 40 + 28 - 20) / 40: 4 blocks of 8
        (
            {
                "spreading_factor": 10,
                "bandwidth_khz": 250,
                "coding_rate": 4,
                "explicit_header": False,
                "payload_crc": False,
                "preamble_symbols": 12,
            },
            20,
            (16.25 + 8 + 32) * 4_096,
        ),
        # nothing to send: (0 - 48 + 28 + 16) is below 0
        ({"spreading_factor": 12}, 0, (12.25 + 8) * 32_768),
    ],
)
def test_airtime(settings, payload_byte, airtime_us):
    radio = lora_radio(load_radio("sx1276", HERE), LoraParameters(**settings))
    assert radio.airtime_ns(payload_byte) == airtime_us * 1000
    assert isinstance(radio.airtime_ns(payload_byte), int)


def test_settings_become_attributes_of_the_radio():
    radio = lora_radio(load_radio("sx1276", HERE), LoraParameters(spreading_factor=9, bandwidth_khz=250))
    assert (radio.symbol_ns, radio.preamble_ns) == (2_048_000, 12_250 * 2_048)
    assert radio.bitrate_bps == round(9 * 250e3 / 512 * 4 / 5)
    assert radio.transmit_power_mw(14.0) == pytest.approx(44 * 3.3)


@pytest.mark.parametrize(
    ("factor", "sensitivity_dbm"), [(7, -126.5), (8, -127.25), (9, -131.25), (10, -132.75), (11, -134.5), (12, -133.25)]
)
def test_measured_sensitivities_hold_at_the_receivers_own_noise(factor, sensitivity_dbm):
    radio = lora_radio(load_radio("sx1276", HERE), LoraParameters(spreading_factor=factor))
    assert radio.sensitivity_dbm == pytest.approx(sensitivity_dbm)
    assert noise_floor_dbm(125, 6) == pytest.approx(-117.03, abs=0.005)
    assert radio.preamble_lock_sinr_db == pytest.approx(sensitivity_dbm + 117.03, abs=0.005)


def test_twice_the_bandwidth_hears_3_db_less():
    narrow, wide = (
        lora_radio(load_radio("sx1276", HERE), LoraParameters(bandwidth_khz=width)).sensitivity_dbm
        for width in (125, 250)
    )
    assert wide - narrow == pytest.approx(3.0103, abs=1e-4)


def test_other_radios_have_no_such_settings():
    with pytest.raises(ScenarioError, match="CC2420 is not a LoRa radio"):
        lora_radio(load_radio("cc2420", HERE), LoraParameters())


def test_a_table_must_know_every_spreading_factor(tmp_path):
    text = find_table("radios", "sx1276", HERE).read_text()
    line = next(line for line in text.splitlines(keepends=True) if line.startswith("    12: {"))
    (tmp_path / "mine.yaml").write_text(text.replace(line, ""))
    with pytest.raises(ScenarioError, match="every spreading factor from 7 to 12"):
        load_radio("mine.yaml", tmp_path)


def test_settings_do_not_touch_the_price_of_states():
    radio = load_radio("sx1276", HERE)
    slow = lora_radio(radio, LoraParameters(spreading_factor=12))
    assert replace(slow, lora=radio.lora) != radio
    assert (slow.listen_mw, slow.power_down_mw, slow.wake_ns) == (radio.listen_mw, radio.power_down_mw, radio.wake_ns)
