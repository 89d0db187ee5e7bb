"""What harvesters offer: a day's energy by hand, steps that join without gap."""

import math
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.harvest import NS_PER_DAY, NS_PER_H, ConstantHarvest, DayHarvest
from netsim.units import NS_PER_S


def steps_of(harvest, from_ns):
    """(begin, end, power) of the steps from an instant on."""
    while True:
        step = harvest.step_at(from_ns)
        yield from_ns, step.end_ns, step.power_mw
        from_ns = step.end_ns


def energy_j(harvest, from_ns, to_ns):
    total = 0.0
    for begin_ns, end_ns, power_mw in steps_of(harvest, from_ns):
        total += power_mw * (min(end_ns, to_ns) - begin_ns) * 1e-12
        if end_ns >= to_ns:
            return total
    raise AssertionError


def test_a_constant_harvester():
    step = ConstantHarvest(power_mw=2.0, efficiency=0.75).step_at(10**15)
    assert (step.power_mw, step.end_ns) == (1.5, None)


@pytest.mark.parametrize("step_s", [60.0, 900.0, 7000.0, 86_400.0])
def test_a_day_brings_its_energy_whatever_the_step(step_s):
    day = DayHarvest(peak_mw=10.0, sunrise_h=6.0, sunset_h=18.0, step_s=step_s, efficiency=0.8)
    assert energy_j(day, 0, NS_PER_DAY) == pytest.approx(0.8 * 10e-3 * 12 * 3600 * 2 / math.pi, rel=1e-9)
    assert energy_j(day, 0, 3 * NS_PER_DAY) == pytest.approx(3 * 0.8 * 10e-3 * 12 * 3600 * 2 / math.pi, rel=1e-9)


def test_noon_and_night():
    day = DayHarvest(peak_mw=10.0, step_s=60.0)
    assert day.step_at(12 * NS_PER_H).power_mw == pytest.approx(10.0, rel=1e-5)
    assert day.step_at(9 * NS_PER_H).power_mw == pytest.approx(10.0 * math.sin(math.pi / 4), rel=3e-3)
    night = day.step_at(18 * NS_PER_H)
    assert (night.power_mw, night.end_ns) == (0.0, 30 * NS_PER_H)
    assert day.step_at(6 * NS_PER_H - 1).power_mw == 0.0
    assert day.step_at(6 * NS_PER_H).power_mw > 0.0


def test_a_run_may_begin_at_noon():
    day = DayHarvest(peak_mw=10.0, start_h=12.0, step_s=60.0)
    assert day.step_at(0).power_mw == pytest.approx(10.0, rel=1e-5)
    assert energy_j(day, 0, 6 * NS_PER_H) == pytest.approx(energy_j(day, 18 * NS_PER_H, 24 * NS_PER_H), rel=1e-6)


@given(st.floats(0.0, 20.0), st.floats(0.1, 4.0), st.floats(1.0, 40_000.0), st.integers(0, 3 * NS_PER_DAY))
def test_steps_are_constant_from_begin_to_end(sunrise_h, daylight_h, step_s, time_ns):
    day = DayHarvest(peak_mw=5.0, sunrise_h=sunrise_h, sunset_h=sunrise_h + daylight_h, step_s=step_s)
    for begin_ns, end_ns, power_mw in islice(steps_of(day, time_ns), 5):
        assert begin_ns < end_ns
        assert day.step_at(end_ns - 1).power_mw == power_mw
        assert day.step_at((begin_ns + end_ns) // 2).end_ns == end_ns
        if power_mw > 0.0:
            assert end_ns - begin_ns <= round(step_s * NS_PER_S) + 1


def test_a_day_without_daylight_is_refused():
    with pytest.raises(ValueError, match="sunset_h after sunrise_h"):
        DayHarvest(peak_mw=1.0, sunrise_h=18.0, sunset_h=6.0)
