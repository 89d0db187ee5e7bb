"""Batteries and ledgers: exact integrals, exact deaths, books that balance."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import InvariantError
from netsim.sim.clock import Clock
from netsim.sim.energy import Account, Battery, Meter
from netsim.units import NS_PER_S

POWERS_MW = st.sampled_from([0.0, 0.00006, 0.06, 1.278, 5.4, 25.5, 42.0, 52.2, 56.4, 60.0])
WAITS_NS = st.one_of(st.integers(0, 1000), st.integers(0, 10 * NS_PER_S))
CHANGES = st.lists(st.tuples(WAITS_NS, st.integers(0, 2), POWERS_MW), max_size=40)


def exact(number: float) -> Fraction:
    """What was meant by a decimal number."""
    return Fraction(str(number))


class Bench:
    """Three meters on one battery, and when it ran empty."""

    def __init__(self, capacity_j=float("inf"), clock=None, cell=None):
        self.clock = clock or Clock()
        self.account = Account()
        self.emptied_ns = []
        self.battery = Battery(self.clock, capacity_j, lambda: self.emptied_ns.append(self.clock.now_ns), cell)
        self.meters = [Meter(self.clock, self.battery, self.account, name) for name in ("radio", "cpu", "sensor")]

    def run(self, changes, tail_ns=0):
        """Apply (wait, meter, power) changes one after the other."""
        at_ns = 0
        for number, (wait_ns, meter, power_mw) in enumerate(changes):
            at_ns += wait_ns
            self.clock.call_after(at_ns, self._change(meter, power_mw, number))
        self.clock.environment.run(until=at_ns + tail_ns + 1)
        for meter in self.meters:
            meter.settle()

    def _change(self, meter, power_mw, number):
        return lambda _: self.meters[meter].draw(power_mw, f"state {number % 3}")


def segments(changes, tail_ns):
    """(duration, total power) of every stretch of constant power, by hand."""
    power = [Fraction(0)] * 3
    for wait_ns, meter, power_mw in changes:
        yield wait_ns, sum(power)
        power[meter] = exact(power_mw)
    yield tail_ns, sum(power)


@settings(max_examples=150, deadline=None)
@given(CHANGES, WAITS_NS)
def test_the_integral_is_the_exact_sum(changes, tail_ns):
    bench = Bench()
    bench.run(changes, tail_ns)
    expected_j = sum(time_ns * power for time_ns, power in segments(changes, tail_ns + 1)) / 10**12
    assert bench.battery.used_j == float(expected_j)
    assert bench.account.total_j == pytest.approx(float(expected_j), rel=1e-12, abs=1e-30)
    bench.battery.check_closure(bench.account, 0)
    for device in ("radio", "cpu", "sensor"):
        booked_ns = sum(entry.time_ns for key, entry in bench.account.entries.items() if key[0] == device)
        assert booked_ns == bench.clock.now_ns


def first_empty_ns(changes, capacity_j):
    """The first whole nanosecond at which the exact draw reaches the capacity, or None."""
    used_pj, at_ns, capacity_pj = Fraction(0), 0, exact(capacity_j) * 10**12
    for time_ns, power in segments(changes, 10**15):
        if power > 0 and used_pj + power * time_ns >= capacity_pj:
            return at_ns + -(-(capacity_pj - used_pj) // power)
        used_pj += power * time_ns
        at_ns += time_ns
    return None


@settings(max_examples=300, deadline=None)
@given(
    CHANGES,
    st.one_of(
        st.sampled_from([1e-9, 5.64e-8, 1e-6, 0.05, 0.1, 0.3, 0.564, 1.0, 1.7]),
        st.integers(1, 10**6).map(lambda number: number / 10**6),
    ),
)
def test_a_battery_is_empty_at_the_exact_nanosecond(changes, capacity_j):
    expected_ns = first_empty_ns(changes, capacity_j)
    bench = Bench(capacity_j)
    bench.run(changes, 200 * NS_PER_S)
    if expected_ns is not None and expected_ns <= bench.clock.now_ns:
        assert bench.emptied_ns == [expected_ns]
    else:
        assert bench.emptied_ns == []


@pytest.mark.parametrize(
    ("capacity_j", "changes", "empty_ns"),
    [
        # 50 mW empties 1 J in 20 s; a division of floats gives a hair more
        (1.0, [(0, 0, 50.0)], 20 * NS_PER_S),
        (0.3, [(0, 0, 60.0)], 5 * NS_PER_S),
        # 56.4 mW: 0.1 / 0.0564 s = 1.773 049 645 39 s, and the nanosecond after
        (0.1, [(0, 0, 56.4)], 1_773_049_646),
        # 10 mW for 2 s (20 mJ), 60 mW for 1 s (60 mJ), 5 mW for the last 20 mJ: 4 s
        (0.1, [(0, 0, 10.0), (2 * NS_PER_S, 0, 60.0), (NS_PER_S, 0, 5.0)], 7 * NS_PER_S),
        # falls to nothing just before the end and rises again: 1 s at 60, 9 s at 0, 1 s at 40
        (0.1, [(0, 0, 60.0), (NS_PER_S, 0, 0.0), (9 * NS_PER_S, 1, 40.0)], 11 * NS_PER_S),
        # empty at the very instant at which the draw stops
        (0.06, [(0, 0, 60.0), (NS_PER_S, 0, 0.0)], NS_PER_S),
    ],
)
def test_deaths_computed_by_hand(capacity_j, changes, empty_ns):
    bench = Bench(capacity_j)
    bench.run(changes, 100 * NS_PER_S)
    assert bench.emptied_ns == [empty_ns]


def test_asking_changes_nothing():
    bench = Bench(1.0)
    bench.meters[0].draw(10.0, "on")
    bench.clock.environment.run(until=NS_PER_S)
    assert [bench.battery.used_j, bench.battery.left_j] * 2 == [0.01, 0.99] * 2


def test_a_relabelled_stretch_is_booked_once():
    bench = Bench()
    bench.meters[0].draw(10.0, "receive")
    bench.clock.environment.run(until=NS_PER_S)
    bench.meters[0].relabel("overhear", "belief")
    bench.meters[0].draw(1.0, "listen")
    bench.clock.environment.run(until=2 * NS_PER_S)
    bench.meters[0].settle()
    booked = {key: (entry.energy_j, entry.time_ns) for key, entry in bench.account.entries.items()}
    assert booked == {("radio", "overhear", "belief"): (0.01, NS_PER_S), ("radio", "listen", ""): (0.001, NS_PER_S)}


def test_books_that_do_not_balance_are_refused():
    bench = Bench()
    bench.meters[0].draw(10.0, "on")
    bench.clock.environment.run(until=NS_PER_S)
    with pytest.raises(InvariantError, match="node 4 does not close"):
        bench.battery.check_closure(bench.account, 4)
