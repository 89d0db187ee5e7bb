"""Payload encodings: sizes, losses and what must survive."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from netsim.codec import decode_count, decode_floats, encode_count, encode_floats, float_width, size_byte

WIDTHS = ["float64", "float32", "float16", "uint8"]
FLOAT16_MAX = 65504.0
ANY = arrays(np.float64, st.integers(0, 300), elements=st.floats(width=64))
FINITE = arrays(np.float64, st.integers(1, 300), elements=st.floats(-FLOAT16_MAX, FLOAT16_MAX))
SPECIAL = st.sampled_from([-np.inf, np.inf, np.nan])


def ulp16(value: float) -> float:
    """Distance of a number from its neighbours in float16."""
    return float(np.spacing(np.float16(min(abs(value), 65472.0))))


@pytest.mark.parametrize("width", WIDTHS)
@given(values=ANY)
def test_sizes_are_exact_and_specials_survive(width, values):
    data = encode_floats(values, width)
    assert len(data) == size_byte(len(values), width)
    decoded = decode_floats(data, width)
    assert decoded.shape == values.shape
    finite = np.isfinite(values)
    assert np.isfinite(decoded[finite]).all()
    np.testing.assert_array_equal(decoded[~finite], values[~finite])


@given(values=FINITE, specials=st.lists(SPECIAL, max_size=5))
def test_eight_bits_are_off_by_half_a_step_at_most(values, specials):
    low, high = values.min(), values.max()
    span = (high + ulp16(high)) - (low - ulp16(low))  # ends are rounded outwards to float16
    decoded = decode_floats(encode_floats([*values, *specials], "uint8"), "uint8")[: len(values)]
    assert np.abs(decoded - values).max() <= span / 252 / 2 * (1 + 1e-12) + 1e-13


@given(low=st.floats(-200, 0, width=16), width=st.floats(0.125, 200, width=16), share=st.floats(0, 1))
def test_the_half_step_is_that_of_the_arrays_own_range(low, width, share):
    high = float(np.float16(low + width))
    assume(high > low)
    values = [low, low + share * (high - low), high]
    decoded = decode_floats(encode_floats(values, "uint8"), "uint8")
    assert (decoded[0], decoded[2]) == (low, high)  # the ends are float16 numbers here, and exact
    assert abs(decoded[1] - values[1]) <= (high - low) / 504 * (1 + 1e-12) + 1e-13


@given(value=st.floats(-FLOAT16_MAX, FLOAT16_MAX, width=16), size=st.integers(1, 50))
def test_a_constant_array_of_a_float16_number_is_exact(value, size):
    decoded = decode_floats(encode_floats([value] * size, "uint8"), "uint8")
    assert decoded.tolist() == [value] * size


@given(value=st.floats(-100, 100), size=st.integers(1, 50))
def test_other_constant_arrays_stay_constant_and_are_closer_than_float16(value, size):
    decoded = decode_floats(encode_floats([value] * size, "uint8"), "uint8")
    assert len(set(decoded.tolist())) == 1
    assert abs(decoded[0] - value) <= ulp16(value) / 504 * (1 + 1e-9)


def test_the_layout_of_eight_bits_byte_by_byte():
    data = encode_floats([-1.0, 0.0, 1.0, -math.inf, math.inf, math.nan], "uint8")
    assert data == bytes.fromhex("00bc 003c 00 7e fc fd fe ff")  # low -1 and high 1 in float16, then the codes


@given(values=arrays(np.float64, st.integers(1, 300), elements=st.floats(-1, 1)))
def test_quantising_twice_changes_nothing_more_where_the_range_is_kept(values):
    once = encode_floats([-1.0, *values, 1.0], "uint8")
    assert encode_floats(decode_floats(once, "uint8"), "uint8") == once


@pytest.mark.parametrize("width", WIDTHS)
def test_an_empty_array_takes_no_byte(width):
    assert encode_floats([], width) == b""
    assert len(decode_floats(b"", width)) == 0


def test_what_is_beyond_the_range_becomes_the_largest_finite_number():
    decoded = decode_floats(encode_floats([-1e300, 0.0, 1e300], "uint8"), "uint8")
    assert decoded[[0, 2]].tolist() == [-FLOAT16_MAX, FLOAT16_MAX]


def test_nothing_but_impossible_states_stays_so():
    assert decode_floats(encode_floats([-math.inf] * 3, "uint8"), "uint8").tolist() == [-math.inf] * 3


@pytest.mark.parametrize("length", [1, 4])
def test_bytes_without_an_entry_are_no_array(length):
    with pytest.raises(ValueError, match="its range alone takes 4"):
        decode_floats(bytes(length), "uint8")


@pytest.mark.parametrize(("width", "dtype"), [("float64", "<f8"), ("float32", "<f4"), ("float16", "<f2")])
def test_float_widths_are_numpys_bytes(width, dtype):
    values = np.array([-3.25, 0.1, 1e-9, -np.inf, 7.0])
    assert encode_floats(values, width) == values.astype(dtype).tobytes()
    assert float_width(width) == width


def test_numbers_of_different_kinds_go_as_float16():
    assert float_width("uint8") == "float16"


@given(count=st.integers(0, 70_000) | st.integers(0, 2**32 - 1))
def test_a_count_comes_back_and_small_ones_take_two_bytes(count):
    data = encode_count(count)
    assert len(data) == (2 if count < 65_535 else 6)
    assert decode_count(b"ab" + data + b"c", 2) == (count, 2 + len(data))
