"""Modulations against the formulas they are named after, and the laws that all of them keep."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.device_tables import find_table, load_radio
from netsim.models.modulation import O_QPSK, Cc2420Fit, LoraChirps, NcFsk

MODULATIONS = [O_QPSK, NcFsk(30.0 / 19.2), Cc2420Fit(), LoraChirps(-9.5, 6.0)]
POWERS = st.floats(1e-12, 1e3)


def asked(modulation, signal, interference=0.0, noise=1.0):
    arrays = (np.array([value], float) for value in (signal, interference, noise))
    return float(modulation.log_bit_success(*arrays)[0])


@pytest.mark.parametrize(
    ("snr_db", "ber"), [(5, 7.383e-14), (2, 5.131e-7), (-1, 1.14894e-3), (-4, 3.91635e-2), (-7, 0.175246)]
)
def test_oqpsk_golden_points(snr_db, ber):
    assert -math.expm1(asked(O_QPSK, 10 ** (snr_db / 10))) == pytest.approx(ber, rel=1e-3)


@pytest.mark.parametrize("snr_db", [-10, -3, 0, 3, 6, 9, 12])
def test_nc_fsk_is_the_closed_form(snr_db):
    """Zuniga and Krishnamachari: a frame of f bytes arrives with (1 - 0.5 exp(-snr/2 * 30/19.2))^(8 f)."""
    snr = 10 ** (snr_db / 10)
    per_bit = asked(NcFsk(30.0 / 19.2), snr)
    assert math.exp(8 * 50 * per_bit) == pytest.approx((1 - 0.5 * math.exp(-snr / 2 / 0.64)) ** 400, rel=1e-12)


@pytest.mark.parametrize("snr_db", [-5, 0, 2.3851, 4, 6, 10])
def test_the_cc2420_fit_is_tossims(snr_db):
    """TOSSIM: PRR = (1 - PSE)^46 for 23 bytes, with PSE = 0.5 erfc(0.9794 (snr - 2.3851) / sqrt 2)."""
    symbol_error = 0.5 * math.erfc(0.9794 * (snr_db - 2.3851) / math.sqrt(2))
    per_bit = asked(Cc2420Fit(), 10 ** (snr_db / 10))
    assert math.exp(23 * 8 * per_bit) == pytest.approx((1 - symbol_error) ** 46, rel=1e-9)


def test_lora_is_all_or_nothing():
    sf7 = LoraChirps(threshold_db=-9.0, capture_db=6.0)
    assert [asked(sf7, 10 ** (db / 10)) for db in (-9.1, -8.9)] == [-math.inf, 0.0]
    assert [asked(sf7, 1.0, interference=10 ** (-db / 10), noise=0.1) for db in (5.9, 6.1)] == [-math.inf, 0.0]
    # two interferers of -8 dB each sum up to -5 dB
    assert asked(sf7, 1.0, interference=2 * 10**-0.8, noise=0.1) == -math.inf


@pytest.mark.parametrize("modulation", MODULATIONS, ids=lambda modulation: type(modulation).__name__)
class TestEveryModulation:
    @given(POWERS, st.floats(0.0, 1e3), POWERS, st.floats(1.0, 100.0))
    def test_more_signal_helps_and_more_of_the_rest_harms(self, modulation, signal, interference, noise, factor):
        now = asked(modulation, signal, interference, noise)
        assert -math.inf <= now <= 0.0
        assert asked(modulation, signal * factor, interference, noise) >= now
        assert asked(modulation, signal, interference * factor, noise) <= now
        assert asked(modulation, signal, interference, noise * factor) <= now

    def test_arrays_are_asked_entry_by_entry(self, modulation):
        grid = np.array([[0.1, 1.0, 10.0], [0.5, 2.0, 30.0]])
        found = modulation.log_bit_success(grid, 0.1 * np.ones_like(grid), np.ones_like(grid))
        assert found.shape == grid.shape
        assert found[1, 2] == asked(modulation, 30.0, 0.1, 1.0)


def test_tables_name_their_modulation(tmp_path):
    assert load_radio("cc2420", tmp_path).modulation == O_QPSK
    assert load_radio("cc1000", tmp_path).modulation == NcFsk(30_000 / 19_200)
    (tmp_path / "fit.yaml").write_text(
        "extends: base.yaml\nmodulation: {type: cc2420-fit, source: TOSSIM}\ncapture_sinr_db: {value: 3, source: mine}\n"
    )
    shipped = find_table("radios", "cc2420", tmp_path)
    (tmp_path / "base.yaml").write_text(shipped.read_text())
    assert load_radio("fit.yaml", tmp_path).modulation == Cc2420Fit()
    assert load_radio("fit.yaml", tmp_path).capture_sinr_db == 3.0
