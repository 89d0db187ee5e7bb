"""Reception: golden points, the tail against 60-digit arithmetic, the table against the formula, and their laws."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.reception import (
    LOG_BIT_SUCCESS_RELATIVE_ERROR,
    frame_success_probability,
    log_bit_success,
    log_bit_success_of,
    oqpsk_bit_error_rate,
)

# ns-3's lr-wpan error model test; its 5 dB value has lost digits (it is 1 - (1 - BER) in doubles), hence the tolerance.
GOLDEN = [(5.0, 7.383e-14, 1e-3), (2.0, 5.131e-7, 1e-3), (-1.0, 1.14894e-3, 1e-5), (-4.0, 3.91635e-2, 1e-5),
          (-7.0, 0.175246, 1e-5)]  # fmt: skip


def linear(ratio_db: float) -> float:
    return 10.0 ** (ratio_db / 10.0)


def exact_bit_error_rate(sinr: float) -> Decimal:
    """The standard's sum in 60 digits."""
    with localcontext() as context:
        context.prec = 60
        terms = ((-1) ** k * math.comb(16, k) * (20 * Decimal(sinr) * (Decimal(1) / k - 1)).exp() for k in range(2, 17))
        return sum(terms, Decimal(0)) * 8 / 15 / 16


@pytest.mark.parametrize(("ratio_db", "expected", "tolerance"), GOLDEN)
def test_golden_bit_error_rates(ratio_db: float, expected: float, tolerance: float) -> None:
    assert oqpsk_bit_error_rate(linear(ratio_db)) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("sinr", [0.0, 1e-6, 0.01, 0.1, 0.3, 1.0, 3.0, linear(5.0), 6.5, 20.0])
def test_formula_keeps_its_digits(sinr: float) -> None:
    assert oqpsk_bit_error_rate(sinr) == pytest.approx(float(exact_bit_error_rate(sinr)), rel=1e-11)


def test_array_equals_scalars() -> None:
    sinr = np.linspace(0.0, 7.0, 12).reshape(3, 4)
    rate = oqpsk_bit_error_rate(sinr)
    success = frame_success_probability(sinr, 1064)
    assert rate.shape == success.shape == sinr.shape
    assert rate.ravel().tolist() == [oqpsk_bit_error_rate(float(x)) for x in sinr.ravel()]
    np.testing.assert_allclose(success, (1.0 - rate) ** 1064, rtol=1e-10)


def test_one_percent_loss_of_a_20_byte_frame_is_at_0_4_db() -> None:
    """ns-3: sensitivity -106.58 dBm over a noise floor of -106.987 dBm."""
    assert frame_success_probability(linear(-106.58 + 106.987), 160) == pytest.approx(0.99, abs=2e-4)


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.integers(0, 2000))
def test_more_signal_never_hurts(a: float, b: float, bits: int) -> None:
    low, high = sorted((a, b))
    assert 0.0 <= oqpsk_bit_error_rate(high) <= oqpsk_bit_error_rate(low) * (1 + 1e-11) <= 0.5 * (1 + 1e-11)
    assert 0.0 <= frame_success_probability(low, bits) <= frame_success_probability(high, bits) * (1 + 1e-8) <= 1 + 1e-8
    assert log_bit_success(low) <= log_bit_success(high) <= 0.0


def test_table_is_as_accurate_as_it_says() -> None:
    sinr = np.linspace(0.0, 6.49999, 50_001)
    exact = np.log1p(-oqpsk_bit_error_rate(sinr))
    table = np.array([log_bit_success(x) for x in sinr.tolist()])
    worst = float(np.max(np.abs(table / exact - 1.0)))
    assert worst <= LOG_BIT_SUCCESS_RELATIVE_ERROR < 10 * worst


def test_table_ends() -> None:
    assert log_bit_success(0.0) == pytest.approx(math.log(0.5), rel=1e-12)
    assert log_bit_success(math.inf) == log_bit_success(6.5) == 0.0
    assert oqpsk_bit_error_rate(6.5) < 1e-27


def test_frame_from_table_equals_formula() -> None:
    for ratio_db in np.arange(-8.0, 9.0, 0.37):
        frame = math.exp(1064 * log_bit_success(linear(float(ratio_db))))
        assert frame == pytest.approx(frame_success_probability(linear(float(ratio_db)), 1064), rel=1e-2, abs=1e-5)


def test_the_array_form_equals_the_scalar_one() -> None:
    ratios = np.concatenate([np.linspace(0.0, 8.0, 4001), [6.5, 6.499999, 1e9, np.inf]])
    assert log_bit_success_of(ratios).tolist() == [log_bit_success(ratio) for ratio in ratios.tolist()]
