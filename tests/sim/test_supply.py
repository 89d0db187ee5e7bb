"""Batteries of every chemistry and harvesters in simulated time: books close, deaths are exact, a full battery spills."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios_for_tests import Shuffled, small
from sim_rig import Log

from netsim.models.batteries import FW_PER_MW, LinearCell, PeukertParameters, RakhmatovVrudhulaParameters
from netsim.models.harvest import ConstantHarvest, DayHarvest
from netsim.scenario.build import build
from netsim.sim.clock import Clock
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.harvester import Harvester
from netsim.trace.events import EnergyHarvest, NodeEnergy, NodeLife
from netsim.units import NS_PER_S

PEUKERT = PeukertParameters(capacity_mah=0.05, rated_current_ma=1.0, exponent=1.2, supply_v=3.0)
DIFFUSION = RakhmatovVrudhulaParameters(alpha_ma_min=3.0, beta_per_sqrt_min=1.3, supply_v=3.0)
CELLS = {
    "linear": lambda: LinearCell(0.54),
    "peukert": PEUKERT.cell,
    "diffusion": DIFFUSION.cell,
    "mains": lambda: LinearCell(float("inf")),
}
POWERS_MW = st.sampled_from([0.0, 0.06, 1.278, 5.4, 52.2, 56.4])
CHANGES = st.lists(st.tuples(st.integers(0, 5 * NS_PER_S), st.integers(0, 2), POWERS_MW), max_size=30)


class Node:
    """Three meters on one battery, silent once it is empty."""

    def __init__(self, cell, clock=None):
        self.clock = clock or Clock()
        self.account = Account()
        self.emptied_ns = []
        self.battery = Battery(self.clock, 1.0, self._emptied, cell)
        self.meters = [Meter(self.clock, self.battery, self.account, name) for name in ("radio", "cpu", "sensor")]

    def _emptied(self):
        self.emptied_ns.append(self.clock.now_ns)
        for meter in self.meters:
            meter.draw(0.0, "dead")

    def draw(self, meter, power_mw, state="on"):
        if not self.emptied_ns:
            self.meters[meter].draw(power_mw, state)

    def run(self, changes, until_ns):
        at_ns = 0
        for number, (wait_ns, meter, power_mw) in enumerate(changes):
            at_ns += wait_ns
            self.clock.call_after(at_ns, lambda _, m=meter, p=power_mw, n=number: self.draw(m, p, f"state {n % 3}"))
        self.clock.environment.run(until=until_ns)
        for meter in self.meters:
            meter.settle()


@pytest.mark.parametrize("chemistry", CELLS)
@given(CHANGES)
@settings(max_examples=60, deadline=None)
def test_the_ledger_closes_whatever_the_chemistry(chemistry, changes):
    node = Node(CELLS[chemistry]())
    node.run(changes, 200 * NS_PER_S)
    node.battery.check_closure(node.account, 0)
    for device in ("radio", "cpu", "sensor"):
        booked_ns = sum(entry.time_ns for key, entry in node.account.entries.items() if key[0] == device)
        assert booked_ns == 200 * NS_PER_S
    if node.emptied_ns:
        assert node.account.total_j == node.battery.used_j
        assert max(entry.energy_yj for key, entry in node.account.entries.items() if key[1] == "dead") == 0


def stretches(changes, until_ns):
    """(begin, end, power) of constant total power."""
    power, at_ns = [0.0, 0.0, 0.0], 0
    for wait_ns, meter, power_mw in changes:
        if wait_ns:
            yield at_ns, at_ns + wait_ns, sum(round(each * FW_PER_MW) for each in power)
        at_ns += wait_ns
        power[meter] = power_mw
    yield at_ns, until_ns, sum(round(each * FW_PER_MW) for each in power)


@pytest.mark.parametrize("chemistry", ["linear", "peukert", "diffusion"])
@given(CHANGES)
@settings(max_examples=80, deadline=None)
def test_death_is_when_the_cell_alone_says_so(chemistry, changes):
    """One cell walked through the loads by hand, asked at every change; the guard event must come to the same end."""
    cell, expected_ns, until_ns = CELLS[chemistry](), [], 200 * NS_PER_S
    for begin_ns, end_ns, load_fw in stretches(changes, until_ns):
        lasts_ns = cell.lasts_ns(load_fw)
        if lasts_ns is not None and begin_ns + lasts_ns < min(end_ns + 1, until_ns):
            expected_ns = [begin_ns + lasts_ns]
            break
        cell.pass_time(load_fw, end_ns - begin_ns)
    node = Node(CELLS[chemistry]())
    node.run(changes, until_ns)
    assert len(node.emptied_ns) == len(expected_ns)
    off_by_ns = 1 if chemistry == "diffusion" else 0  # the guard settles in between, in floating point
    assert all(abs(got - want) <= off_by_ns for got, want in zip(node.emptied_ns, expected_ns, strict=True))


def test_recovery_saves_a_node_whose_load_falls():
    """The guard that was set under the heavy load finds the cell alive, and the end is that of the light load."""
    node = Node(DIFFUSION.cell())
    heavy_ns = DIFFUSION.cell().lasts_ns(56 * FW_PER_MW)
    node.draw(0, 56.0)
    node.clock.environment.run(until=heavy_ns - 1000)
    node.draw(0, 1.0)
    left_j = node.battery.left_j
    node.clock.environment.run(until=heavy_ns + 20 * NS_PER_S)
    assert node.emptied_ns == []
    assert node.battery.left_j > 10 * left_j


def test_few_guards_are_needed():
    """A radio that changes state every millisecond for a minute does not make the battery solve for its end each time."""
    node = Node(RakhmatovVrudhulaParameters(alpha_ma_min=3000.0, beta_per_sqrt_min=1.3, supply_v=3.0).cell())
    solved = []
    lasts_ns = node.battery._cell.lasts_ns
    node.battery._cell.lasts_ns = lambda load_fw: solved.append(load_fw) or lasts_ns(load_fw)
    changes = [(1_000_000, 0, 56.4 if number % 2 else 52.2) for number in range(20_000)]
    node.run(changes, 21 * NS_PER_S)
    assert len(solved) <= 2


# harvesters


def test_a_harvester_keeps_a_node_alive_by_hand():
    """1 J; 50 mW drawn, 30 mW harvested: 20 mW net, empty after 50 s. With 60 mW harvested the battery stays full."""
    for power_mw, emptied_ns in ((30.0, [50 * NS_PER_S]), (60.0, [])):
        node = Node(LinearCell(1.0))
        Harvester(node.clock, node.battery, ConstantHarvest(power_mw=power_mw))
        node.draw(0, 50.0)
        node.clock.environment.run(until=100 * NS_PER_S)
        assert node.emptied_ns == emptied_ns
    node.battery.settle()
    assert (node.battery.used_j, node.battery.harvested_j, node.battery.spilled_j) == (5.0, 6.0, 1.0)
    assert node.battery.left_j == 1.0


@given(CHANGES, st.sampled_from([0.0, 0.06, 20.0, 56.4, 80.0]), st.sampled_from([0.3, 0.9]))
@settings(max_examples=80, deadline=None)
def test_what_was_there_and_came_is_what_went_and_is_left(changes, peak_mw, efficiency):
    node = Node(LinearCell(0.54))
    if peak_mw:
        day = DayHarvest(peak_mw=peak_mw, sunrise_h=0.001, sunset_h=0.02, step_s=7, efficiency=efficiency)
        Harvester(node.clock, node.battery, day)
    node.run(changes, 200 * NS_PER_S)
    battery = node.battery
    battery.settle()
    battery.check_closure(node.account, 0)
    left = Fraction(54, 100) * 10**24 - battery._used_yj + battery._harvested_yj - battery._spilled_yj
    assert battery.left_j == float(left / 10**24)
    assert 0 <= battery._spilled_yj <= battery._harvested_yj


def test_order_within_an_instant_does_not_matter():
    """The harvest stops, the load rises and the battery fills up, all at the same instant, in any order."""
    ends = set()
    for seed in range(8):
        node = Node(LinearCell(0.1), Clock(Shuffled(seed)))
        for at_s, power_mw in ((0, 30.0), (2, 0.0)):
            node.clock.call_after(at_s * NS_PER_S, lambda _, n=node, p=power_mw: n.battery.harvest(p))
        for at_s, power_mw in ((0, 10.0), (2, 60.0)):
            node.clock.call_after(at_s * NS_PER_S, lambda _, n=node, p=power_mw: n.draw(0, p))
        node.clock.environment.run(until=10 * NS_PER_S)
        ends.add(tuple(node.emptied_ns))
    assert ends == {(round((2 + 0.1 / 0.06) * NS_PER_S + 0.5),)}


# whole runs


def run(loaded):
    log = Log()
    simulation = build(loaded, [log]).simulation
    simulation.run()
    simulation.conclude()
    return log, simulation


def test_a_node_that_listens_for_a_day_costs_what_the_data_sheet_says(tmp_path):
    """18.8 mA at 3 V for 86,400 s: 4872.96 J; the first message goes out after that."""
    loaded = small(
        tmp_path,
        duration_s=86_400,
        algorithm="{type: neighbour-traffic, period_s: 1000000, payload_byte: 1, rounds: 2}",
        medium="{type: ideal, range_m: 1}",
    )
    _, simulation = run(loaded)
    account = simulation.nodes[4].parts.account
    entry = account.entries["radio", "listen", ""]
    assert entry.time_ns == 86_400 * NS_PER_S
    assert entry.energy_j == 4872.96


@pytest.mark.parametrize(
    "battery",
    [
        "{type: peukert, capacity_mah: 0.005, rated_current_ma: 5, exponent: 1.2, supply_v: 3}",
        "{type: rakhmatov-vrudhula, alpha_ma_min: 4, beta_per_sqrt_min: 0.9, supply_v: 3}",
    ],
)
def test_runs_on_nonlinear_cells_end_in_closed_books(tmp_path, battery):
    log, simulation = run(small(tmp_path, battery=battery))
    deaths = [time_ns for time_ns, event in log.of(NodeLife) if event.event == "died"]
    assert len(deaths) == 9
    # heavier than rated: much of the charge was never to be had
    assert all(node.parts.battery.used_j < 0.9 * node.parts.battery.capacity_j for node in simulation.nodes.values())


def test_what_was_harvested_is_in_the_trace(tmp_path):
    battery = "{type: capacity, energy_j: 2}\n    harvester: {type: constant, power_mw: 100, efficiency: 0.5}"
    log, simulation = run(small(tmp_path, battery=battery))
    ((time_ns, event),) = log.of(EnergyHarvest)
    assert list(event.node) == list(range(9))
    assert event.offered_j == [50e-3 * time_ns / NS_PER_S] * 9
    left_j = log.of(NodeEnergy)[-1][1].left_j
    for number, offered_j, spilled_j in zip(event.node, event.offered_j, event.spilled_j, strict=True):
        used_j = simulation.nodes[number].parts.battery.used_j
        assert left_j[number] == pytest.approx(2.0 - used_j + offered_j - spilled_j, rel=1e-12)
