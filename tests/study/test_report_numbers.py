"""Numbers in a report: digits by their uncertainty, units by their size."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.metrics.catalogue import CATALOGUE
from netsim.study.plots.style import plain_tick
from netsim.study.reporting.names import TITLES, title_with, unit_of
from netsim.study.reporting.numbers import (
    Scale,
    decimals_of,
    interval,
    number,
    percent,
    scale_for,
    signed,
    with_half,
)
from netsim.study.reporting.view import LIFETIMES

PLAIN = Scale()


@pytest.mark.parametrize(
    ("mean", "half", "shown"),
    [
        (0.23149, 0.05421, "0.231 ± 0.054"),
        (1029.31, 12.34, "1029 ± 12"),
        (1029.31, 123.4, "1029 ± 123"),
        (7.613487, 0.00055, "7.61349 ± 0.00055"),
        (56.711848, 0.000056, "56.7118 ± 0.000056"),
        (53.58408, 0.00069, "53.5841 ± 0.00069"),
        (1234567.0, 0.25, "1234567 ± 0.25"),
        (5.0, 0.0, "5 ± 0"),
        (0.23149, math.nan, "0.2315"),
        (-0.0001, 0.05, "0.000 ± 0.050"),
        (math.nan, math.nan, "–"),
        (1.738e-7, 4.1e-8, "(1.74 ± 0.41)e−7"),
        (-2e-7, 3.2e-5, "(0.0 ± 3.2)e−5"),
        (1.738e-7, math.nan, "1.738e−7"),
        (0.0, 0.0, "0 ± 0"),
    ],
)
def test_the_uncertainty_decides_the_digits(mean, half, shown):
    assert with_half(mean, half, PLAIN).replace("\N{NO-BREAK SPACE}", " ") == shown


@given(st.floats(-1e6, 1e6), st.floats(1e-4, 1e6))
def test_rounding_hides_less_than_a_twentieth_of_the_uncertainty_or_the_seventh_digit(mean, half):
    shown = with_half(mean, half, PLAIN).replace("\N{MINUS SIGN}", "-")
    told, wide = map(float, shown.split("\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"))
    sixth = 10.0 ** (math.floor(math.log10(abs(mean))) - 5) if mean else 0.0
    assert abs(told - mean) <= max(0.0501 * half, 0.501 * sixth)
    assert abs(wide - half) <= 0.0501 * half


@given(st.floats(1e-9, 1e9))
def test_a_joule_is_shown_between_one_and_a_thousand(value):
    scale = scale_for("J", [value])
    assert 1 - 1e-9 <= value * scale.factor < 1000 * (1 + 1e-9) or scale.unit == "MJ"
    assert scale.unit.endswith("J")


@pytest.mark.parametrize(
    ("unit", "values", "shown"),
    [
        ("J", [0.064], "mJ"),
        ("J", [7.6, 7.7], "J"),
        ("s", [0.003], "ms"),
        ("s", [4000.0], "s"),
        ("byte", [3654.0], "byte"),
        ("byte", [36540.0], "kB"),
        ("1", [0.2], ""),
        ("day", [20.0], "days"),
        ("nat", [0.1], "nat"),
        ("J", [], "J"),
        ("J", [0.0, math.nan], "J"),
    ],
)
def test_units(unit, values, shown):
    assert scale_for(unit, values).unit == shown


def test_signs_and_intervals():
    assert signed(0.0) == "0"
    assert signed(1.5) == "+1.5"
    assert signed(-1.5) == "\N{MINUS SIGN}1.5"
    assert interval(-0.062, 0.011, PLAIN) == "[\N{MINUS SIGN}0.062, 0.011]"
    assert interval(-0.062, 0.011, Scale(1000.0, "m")) == "[\N{MINUS SIGN}62, 11]"


@pytest.mark.parametrize(
    ("share", "shown"), [(-0.153, "\N{MINUS SIGN}15 %"), (0.0312, "+3.1 %"), (0.0, "0 %"), (0.00013, "+0.013 %")]
)
def test_percents_have_two_digits(share, shown):
    assert percent(share).replace("\N{NO-BREAK SPACE}", " ") == shown


def test_no_percent_of_nothing():
    assert percent(math.nan) == ""
    assert percent(math.inf) == ""


def test_no_number_is_a_dash_and_infinity_a_sign():
    assert number(None) == "–"
    assert number(math.inf) == "∞"
    assert number(-math.inf) == "\N{MINUS SIGN}∞"
    assert decimals_of(0.0) is None
    assert decimals_of(math.nan) is None


def test_titles_are_those_of_metrics_that_there_are():
    assert set(TITLES) <= set(CATALOGUE)
    assert set(LIFETIMES) <= set(CATALOGUE)
    assert {unit_of(name) for name in LIFETIMES} == {"day"}


@pytest.mark.parametrize(
    ("metric", "unit", "shown"),
    [
        ("energy_beyond_listening_j", "mJ", "energy beyond listening (mJ)"),
        ("frame_byte", "byte", "bytes in frames"),
        ("frame_byte", "kB", "bytes in frames (kB)"),
        ("association_error", "", "association error"),
        ("energy_by_state_j.radio.listen", "J", "energy by state: radio.listen (J)"),
        ("my_own_figure_s", "", "my own figure"),
    ],
)
def test_metrics_are_called_by_words_and_unit(metric, unit, shown):
    assert title_with(metric, unit) == shown


def test_ticks_are_written_as_one_writes_them():
    shown = [plain_tick(value) for value in (0.03, 7.61425, 30000.0, -0.5, 0.0)]
    assert shown == ["0.03", "7.61425", "30\N{NARROW NO-BREAK SPACE}000", "\N{MINUS SIGN}0.5", "0"]


def test_a_mean_within_its_interval_has_no_more_digits_than_that() -> None:
    assert with_half(9508, 76790, PLAIN).replace("\N{NO-BREAK SPACE}", " ") == "10000 ± 77000"
    assert with_half(9508, 76.79, PLAIN).replace("\N{NO-BREAK SPACE}", " ") == "9508 ± 77"


@pytest.mark.parametrize(("share", "shown"), [(587.57, "×589"), (99.0, "+9900 %"), (46009858777462.34, "×4.6e13")])
def test_beyond_ten_thousand_percent_factors_are_told(share, shown):
    assert percent(share).replace("\N{NO-BREAK SPACE}", " ") == shown


@given(st.floats(1e-300, 9.9e-5))
def test_small_numbers_keep_their_digits(value):
    assert float(number(-value).replace("\N{MINUS SIGN}", "-")) == pytest.approx(-value, rel=6e-4)
