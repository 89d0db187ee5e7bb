"""Means, differences and intervals of plain numbers against scipy, for any numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from netsim.study.samples import are_equal, holm, merged, moments, paired_sample, sample_of, welch

NUMBERS = st.lists(st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-6), min_size=2, max_size=12)


@given(NUMBERS, st.floats(-10, 10))
def test_an_interval_equals_scipys_for_any_numbers(values, shift):
    got = sample_of(values)
    se = stats.sem(values)
    if se > 1e-9 * max(map(abs, values)):  # else the sum of squares is rounding
        np.testing.assert_allclose(
            [got.mean, got.se, got.low, got.high],
            [np.mean(values), se, *stats.t.interval(0.95, len(values) - 1, np.mean(values), se)],
            rtol=1e-6,
            atol=1e-9 * max(map(abs, values)),
        )
    assert got.low <= got.mean <= got.high or (math.isnan(got.low) and got.sd == 0 and len(values) < 6)
    assert (got.p < 0.05) == (got.low > 0 or got.high < 0)


@given(NUMBERS, NUMBERS)
def test_welchs_interval_is_that_of_the_difference_either_way_round(values, base):
    one, other = welch(values, base), welch(base, values)
    np.testing.assert_allclose([one.mean, one.low, one.high], [-other.mean, -other.high, -other.low], rtol=1e-12)


@given(NUMBERS, st.sampled_from([1e-120, 1e120]))
def test_an_interval_scales_with_its_numbers(values, scale):
    scaled = [value * scale for value in values]
    one, other = sample_of(values), sample_of(scaled)
    np.testing.assert_allclose([other.mean, other.sd], [one.mean * scale, one.sd * scale], rtol=1e-6, atol=1e-6 * scale)
    one, other = welch(values, values[::2]), welch(scaled, scaled[::2])
    np.testing.assert_allclose([other.se, other.high], [one.se * scale, one.high * scale], rtol=1e-6, atol=1e-6 * scale)


@given(st.lists(st.integers(-50, 50), min_size=2, max_size=8), st.sampled_from([0, 10**17, -(10**30)]))
def test_integers_are_exact_however_large(values, shift):
    mean, sd = moments([value + shift for value in values])
    assert mean == float(Fraction(sum(values), len(values)) + shift)
    assert sd == pytest.approx(np.std(values, ddof=1), rel=1e-12)


def test_holms_values_are_those_of_a_worked_example():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert math.isnan(holm([math.nan, 0.02])[0])
    assert holm([math.nan, 0.02])[1] == 0.02


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holms_values_reject_what_the_step_down_procedure_rejects(p):
    rejected = set()
    for rank, index in enumerate(sorted(range(len(p)), key=lambda index: p[index])):
        if p[index] * (len(p) - rank) >= 0.05:
            break
        rejected.add(index)
    assert {index for index, value in enumerate(holm(p)) if value < 0.05} == rejected


@given(st.lists(st.integers(0, 60), min_size=2, max_size=5), st.integers(-59, 59).filter(bool), st.integers(2, 97))
def test_differences_of_shares_that_are_equal_but_for_rounding_have_no_interval_below_six(counts, step, whole):
    """k/n - (k + step)/n is -step/n for every k, up to rounding: the very same difference in every pair."""
    sample = paired_sample([count / whole for count in counts], [(count + step) / whole for count in counts])
    assert sample.mean == pytest.approx(-step / whole)
    assert (sample.sd, math.isnan(sample.low)) == (0.0, True)
    assert sample.p == pytest.approx(2 / 2 ** len(counts))


@given(st.integers(6, 12), st.floats(0.01, 100), st.floats(1e3, 1e6))
def test_rounding_is_a_share_of_what_was_subtracted_not_of_the_difference(n, step, size):
    base = [size * (1 + number / 7) for number in range(n)]
    sample = paired_sample([value + step for value in base], base)
    assert (sample.sd, sample.low) == (0.0, sample.high)
    assert sample.p == pytest.approx(2 / 2**n)


def test_numbers_that_are_equal_but_for_rounding_have_no_spread():
    assert math.isnan(sample_of([0.1 + 0.2, 0.3]).low)
    assert math.isnan(welch([0.1 + 0.2, 0.3], [0.5, 0.5]).low)
    assert welch([0.1 + 0.2, 0.3], [0.5, 0.5]).p == pytest.approx(1 / 3)  # two of the six ways to deal four
    assert sample_of([0.3, 0.3 * (1 + 1e-9)]).sd > 0
    assert are_equal([0.1 + 0.2, 0.3])
    assert not are_equal([])
    assert not are_equal([10**17, 10**17 + 1])


def test_numbers_that_differ_by_rounding_are_merged_and_others_kept():
    assert merged({4: 0.1 + 0.2, 1: 0.3, 2: 0.1, 3: 0.3001}) == {4: 0.3, 1: 0.3, 2: 0.1, 3: 0.3001}
    assert merged({}) == {}
