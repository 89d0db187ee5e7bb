"""Battery chemistry: published lifetimes, deaths by hand, and the closed form against formula and brute force."""

import csv
import math
from collections import defaultdict
from decimal import Decimal, getcontext
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.models.batteries import (
    FW_PER_MW,
    NS_PER_MIN,
    LinearCell,
    PeukertCell,
    PeukertParameters,
    RakhmatovVrudhulaParameters,
)
from netsim.units import NS_PER_S

VOLT = 4.0
ITSY = RakhmatovVrudhulaParameters(alpha_ma_min=35_220.0, beta_per_sqrt_min=0.637, supply_v=VOLT)
DUALFOIL = RakhmatovVrudhulaParameters(alpha_ma_min=40_027.0, beta_per_sqrt_min=0.276, supply_v=VOLT)
TOLERANCE_S = 60.0


def load_fw(current_ma):
    return round(current_ma * VOLT * FW_PER_MW)


def lifetime_ns(parameters, profile):
    """How long a cell lasts under (start_ns, load) steps, the last of which goes on for ever; and the loads until then."""
    cell, done = parameters.cell(), []
    for (start_ns, power_fw), (end_ns, _) in pairwise([*profile, (None, None)]):
        lasts_ns = cell.lasts_ns(power_fw)
        if lasts_ns is not None and (end_ns is None or start_ns + lasts_ns <= end_ns):
            cell.pass_time(power_fw, lasts_ns)
            assert cell.is_empty
            return start_ns + lasts_ns, [*done, (start_ns, start_ns + lasts_ns, power_fw)]
        if end_ns is None:
            return None, done
        cell.pass_time(power_fw, end_ns - start_ns)
        assert not cell.is_empty
        done.append((start_ns, end_ns, power_fw))
    raise AssertionError


@pytest.mark.parametrize(
    ("current_ma", "published_s"), [(640, 2844), (320, 6146), (128, 16052), (64, 32561), (32, 65580)]
)
def test_constant_loads_last_as_published(current_ma, published_s):
    """ns-3's figures for the Itsy cell; its own tolerance is 120 s."""
    lasts_ns = ITSY.cell().lasts_ns(load_fw(current_ma))
    assert lasts_ns / NS_PER_S == pytest.approx(published_s, abs=1.0)


@pytest.fixture(scope="module")
def published(measured_data):
    """Load profiles and lifetimes in minutes by name."""
    steps, lifetimes = defaultdict(list), {}
    with (measured_data / "rv-battery-loads.csv").open() as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            start_ns = round(float(row["start_min"]) * NS_PER_MIN)
            steps[row["profile"]].append((start_ns, load_fw(1e3 * float(row["current_a"]))))
            lifetimes[row["profile"]] = (float(row["itsy_lifetime_min"]), float(row["dualfoil_lifetime_min"]))
    return steps, lifetimes


PROFILES = [f"C{number}" for number in range(1, 23)]


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(("cell", "column"), [(ITSY, 0), (DUALFOIL, 1)], ids=["itsy", "dualfoil"])
def test_load_profiles_last_as_published(published, profile, cell, column):
    """44 lifetimes of Rakhmatov and Vrudhula, printed to a tenth of a minute.

    C22 on the Itsy cell is an exception: the published formula itself gives 77.0 s less than the published 112.2 min
    (ns-3, in steps of a second and with a tolerance of 120 s, does not notice).
    """
    steps, lifetimes = published
    assert len(lifetimes) == len(PROFILES)
    late_s = lifetime_ns(cell, steps[profile])[0] / NS_PER_S - 60.0 * lifetimes[profile][column]
    if (profile, column) == ("C22", 0):
        assert late_s == pytest.approx(-77.0, abs=0.5)
    else:
        assert abs(late_s) < TOLERANCE_S


def exact_sigma(parameters, loads, at_ns):
    """sigma by the formula, in 40 digits: each load's closed-form integral up to an instant."""
    getcontext().prec = 40
    beta = Decimal(parameters.beta_per_sqrt_min)
    total = Decimal(0)
    for begin_ns, end_ns, power_fw in loads:
        if begin_ns >= at_ns:
            break
        current = Decimal(power_fw) / Decimal(FW_PER_MW) / Decimal(parameters.supply_v)
        since = Decimal(at_ns - begin_ns) / NS_PER_MIN
        until = Decimal(at_ns - min(end_ns, at_ns)) / NS_PER_MIN
        weight = since - until
        for m in range(1, parameters.terms + 1):
            rate = (beta * m) ** 2
            weight += 2 * ((-rate * until).exp() - (-rate * since).exp()) / rate
        total += current * weight
    return total


LOADS = st.lists(
    st.tuples(st.integers(1, 40 * NS_PER_MIN), st.sampled_from([0.0, 0.5, 20.0, 130.0, 420.0, 700.0])),
    min_size=1,
    max_size=8,
)


@settings(max_examples=60, deadline=None)
@given(LOADS, st.sampled_from([ITSY, DUALFOIL]))
def test_death_is_at_the_exact_nanosecond(steps, cell):
    """The state's recursion against the formula in many digits: not yet empty a nanosecond before, empty then.

    A float knows sigma to 1e-16 of alpha, which at these loads is less than a nanosecond; two are allowed.
    """
    profile, at_ns = [], 0
    for time_ns, current_ma in [*steps, (0, 600.0)]:
        profile.append((at_ns, load_fw(current_ma)))
        at_ns += time_ns
    end_ns, loads = lifetime_ns(cell, profile)
    begin_ns, _, power_fw = loads[-1]
    loads[-1] = (begin_ns, end_ns + 10, power_fw)
    alpha = Decimal(cell.alpha_ma_min)
    assert exact_sigma(cell, loads, end_ns + 2) >= alpha
    assert exact_sigma(cell, loads, end_ns - 2) < alpha
    for share in range(1, 20):  # and not at any time before
        assert exact_sigma(cell, loads, begin_ns + (end_ns - begin_ns) * share // 20) < alpha


def test_death_agrees_with_fine_integration():
    """The diffusion's differential equations in steps of 50 ms: u' = i - lambda u, charge' = i."""
    profile = [(0, load_fw(600.0)), (20 * NS_PER_MIN, load_fw(0.0)), (35 * NS_PER_MIN, load_fw(450.0))]
    step_min, time_min, charge = 0.05 / 60.0, 0.0, 0.0
    rates = [(ITSY.beta_per_sqrt_min * m) ** 2 for m in range(1, 11)]
    locked = [0.0] * 10
    while charge + 2.0 * sum(locked) < ITSY.alpha_ma_min:
        middle_ns = (time_min + step_min / 2) * NS_PER_MIN
        current = [power for start_ns, power in profile if start_ns <= middle_ns][-1] / VOLT / FW_PER_MW
        charge += current * step_min
        locked = [
            (u * (1 - rate * step_min / 2) + current * step_min) / (1 + rate * step_min / 2)
            for u, rate in zip(locked, rates, strict=True)
        ]
        time_min += step_min
    assert lifetime_ns(ITSY, profile)[0] / NS_PER_S == pytest.approx(60.0 * time_min, abs=0.06)


def test_a_cell_recovers_at_rest():
    cell = ITSY.cell()
    cell.pass_time(load_fw(628.0), 19 * NS_PER_MIN)
    tired_j = cell.left_j(0, 0)
    assert cell.left_j(0, 10 * NS_PER_MIN) > tired_j
    cell.pass_time(0, 1000 * NS_PER_MIN)
    unlocked_j = ITSY.energy_j - 19 * 628.0 * VOLT * 0.06
    assert cell.left_j(0, 0) == pytest.approx(unlocked_j, rel=1e-9)
    assert cell.lasts_ns(0) is None


def test_the_first_crossing_is_found_where_sigma_rises_and_falls():
    """A short rest after a heavy load: light load fills the fast terms again while the slow ones still recover."""
    cell = DUALFOIL.cell()
    heavy = load_fw(700.0)
    cell.pass_time(heavy, cell.lasts_ns(heavy) - NS_PER_S)
    cell.pass_time(0, 2 * NS_PER_S)
    light = load_fw(600.0)
    lasts_ns = cell.lasts_ns(light)
    values = [cell.left_j(light, lasts_ns * share // 1000) for share in range(1000)]
    assert min(values) > 0.0
    assert cell.left_j(light, lasts_ns) == 0.0


@given(LOADS, st.sampled_from([0.5, 130.0, 700.0]))
@settings(max_examples=60, deadline=None)
def test_the_quick_bound_is_never_late(steps, current_ma):
    cell = DUALFOIL.cell()
    for time_ns, before_ma in steps:
        lasts_ns = cell.lasts_ns(load_fw(before_ma))
        if lasts_ns is not None and lasts_ns <= time_ns:
            return
        cell.pass_time(load_fw(before_ma), time_ns)
    assert 1 <= cell.lasts_at_least_ns(load_fw(current_ma)) <= cell.lasts_ns(load_fw(current_ma))


# Peukert

CELL = PeukertParameters(capacity_mah=1000.0, rated_current_ma=100.0, exponent=1.2, supply_v=3.0)


@pytest.mark.parametrize(
    ("current_ma", "hours"),
    [
        (100.0, 10.0),  # as rated
        (200.0, 10.0 * 0.5**1.2),  # 4.353 h instead of 5 h
        (1600.0, 10.0 * 2.0**-4.8),
        (50.0, 20.0),  # below the rated current: its charge, and no more
    ],
)
def test_peukert_lifetimes_by_hand(current_ma, hours):
    lasts_ns = PeukertCell(CELL).lasts_ns(round(current_ma * 3.0 * FW_PER_MW))
    assert lasts_ns == pytest.approx(hours * 3600 * NS_PER_S, rel=1e-12)


def test_peukert_dies_at_the_exact_nanosecond():
    """k = 2 makes round numbers: 200 mA feel like 400, so 1000 mAh last 2.5 h; after an hour 600 mAh last 6 h at 100 mA."""
    cell = PeukertCell(PeukertParameters(capacity_mah=1000.0, rated_current_ma=100.0, exponent=2.0, supply_v=3.0))
    heavy, rated = 600 * FW_PER_MW, 300 * FW_PER_MW
    assert cell.lasts_ns(heavy) == 9000 * NS_PER_S
    cell.pass_time(heavy, 3600 * NS_PER_S)
    assert cell.left_j(0, 0) == pytest.approx(600 * 3.6 * 3.0)
    assert cell.lasts_ns(rated) == 6 * 3600 * NS_PER_S
    cell.pass_time(rated, 6 * 3600 * NS_PER_S - 1)
    assert not cell.is_empty
    cell.pass_time(rated, 1)
    assert cell.is_empty


# linear


def test_a_linear_cell_fills_up_and_spills():
    cell = LinearCell(1.0)
    assert cell.pass_time(100 * FW_PER_MW, NS_PER_S) == 0
    assert cell.left_j(0, 0) == 0.9
    assert cell.lasts_ns(-100 * FW_PER_MW) is None
    assert cell.pass_time(-100 * FW_PER_MW, 3 * NS_PER_S) == 2 * 100 * FW_PER_MW * NS_PER_S
    assert cell.left_j(0, 0) == 1.0
    assert cell.left_j(-100 * FW_PER_MW, NS_PER_S) == 1.0


def test_mains_power_never_ends():
    cell = LinearCell(math.inf)
    cell.pass_time(10**20, 10**18)
    assert (cell.is_empty, cell.lasts_ns(10**20), cell.left_j(10**20, 1)) == (False, None, math.inf)
