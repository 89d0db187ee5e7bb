"""The first-order radio model: what the books say sending and receiving cost."""

from pathlib import Path

import pytest

from netsim.models.device_tables import load_radio
from netsim.units import energy_j

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def radio():
    return load_radio("first_order", HERE)


def test_the_crossover_distance(radio):
    assert radio.amplifier.crossover_m == pytest.approx(87.7, abs=0.01)


@pytest.mark.parametrize(
    ("range_m", "expected_nj_per_bit"),
    [
        (50.0, 50 + 25.0),  # 10 pJ * 2500 = 25 nJ
        (87.0, 50 + 75.69),
        (100.0, 50 + 130.0),  # 0.0013 pJ * 1e8 = 130 nJ
        (200.0, 50 + 2080.0),
    ],
)
def test_sending_k_bits_over_a_range_costs_the_book_value(radio, range_m, expected_nj_per_bit):
    psdu_byte = 500
    bits = 8 * (radio.phy_header_byte + psdu_byte)
    tx_power_dbm = radio.amplifier.power_for_range_dbm(range_m, radio.bitrate_bps)
    sent_j = energy_j(radio.transmit_power_mw(tx_power_dbm), radio.airtime_ns(psdu_byte))
    assert sent_j == pytest.approx(bits * expected_nj_per_bit * 1e-9, rel=1e-12)
    received_j = energy_j(radio.receive_mw, radio.airtime_ns(psdu_byte))
    assert received_j == pytest.approx(bits * 50e-9, rel=1e-12)


def test_the_two_laws_meet(radio):
    d0 = radio.amplifier.crossover_m
    below, above = (radio.amplifier.amplifier_nj_per_bit(d0 * factor) for factor in (1 - 1e-9, 1 + 1e-9))
    assert below == pytest.approx(above, rel=1e-6)
