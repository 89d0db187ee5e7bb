"""A duty cycle listens when it should, by the node's own clock, and costs what the data sheet says."""

from itertools import pairwise

import pytest
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant

from netsim.errors import ScenarioError
from netsim.sim.clock import Clock
from netsim.sim.duty_cycle import DutyCycle, DutyCycleParameters
from netsim.sim.local_clock import LocalClock
from netsim.sim.radio_switch import RadioSwitch
from netsim.trace.events import MessageDelivered, RadioState

S = 10**9
MS = 10**6
LISTEN, SLEEP, SWITCH = 2, 1, 5


class Idle:
    def run(self, node):
        yield from node.pause_until(10 * S)


class Patient:
    def run(self, node):
        yield from node.pause_until(200 * S)


class Wakeful:
    """Node 0 wakes its radio in the middle of a sleep."""

    def run(self, node):
        if node.id == 0:
            yield from node.pause_until(2500 * MS)
            node.radio_wake()
        yield from node.pause_until(5 * S)


class Aligned:
    """Node 0 speaks while the others listen, and while they sleep."""

    def run(self, node):
        if node.id == 0:
            yield from node.pause_until(3 * S + 50 * MS)
            node.broadcast("awake", b"")
            yield from node.pause_until(3 * S + 500 * MS)
            node.broadcast("asleep", b"")
        yield from node.pause_until(5 * S)


CYCLE = "    duty_cycle: {period_s: 1, on_s: 0.1, phase: aligned}"


def cycled(folder, algorithm, more=CYCLE, **settings):
    return small(folder, more=more, algorithm=f'{{type: "test_duty_cycle:{algorithm}"}}', **settings)


def states(events, node=0):
    return [(time_ns, event.state) for time_ns, event in events if isinstance(event, RadioState) and event.node == node]


def test_an_idle_node_costs_what_the_data_sheet_says(tmp_path):
    """Ten periods of 100 ms on; from the second on, start-up is part of it."""
    _, simulation = run(cycled(tmp_path, "Idle"))
    parts = simulation.nodes[0].parts
    device = parts.radio.device
    wake_ns = device.wake_ns
    entries = {state: entry for (name, state, _), entry in parts.account.entries.items() if name == "radio"}
    assert {state: entry.time_ns for state, entry in entries.items()} == {
        "listen": 10 * 100 * MS - 9 * wake_ns,
        "sleep": 10 * 900 * MS,
        "wake": 9 * wake_ns,
    }
    assert entries["listen"].energy_j == pytest.approx(0.0564 * (1.0 - 9 * wake_ns / S), rel=1e-12)


def test_an_algorithm_may_wake_it_until_the_next_change(tmp_path):
    events, simulation = run(cycled(tmp_path, "Wakeful"))
    wake_ns = simulation.nodes[0].parts.radio.device.wake_ns
    after = [(time_ns, state) for time_ns, state in states(events) if 2 * S < time_ns < 4 * S]
    assert after == [
        (2 * S + wake_ns, LISTEN),
        (2100 * MS, SLEEP),
        (2500 * MS, SWITCH),
        (2500 * MS + wake_ns, LISTEN),
        (3100 * MS, SLEEP),
    ]


def test_who_sleeps_hears_nothing(tmp_path):
    events, _ = run(cycled(tmp_path, "Aligned"))
    heard = [event.kind for _, event in events if isinstance(event, MessageDelivered)]
    assert heard
    assert set(heard) == {"awake"}


def test_it_keeps_time_by_the_nodes_own_clock(tmp_path):
    more = f"{CYCLE}\n    clock: {{drift_sd_ppm: 2000, offset_sd_s: 0.3}}"
    events, simulation = run(cycled(tmp_path, "Idle", more=more))
    for node_id, node in simulation.nodes.items():
        local = node.parts.clock
        asleep = [time_ns for time_ns, state in states(events, node_id) if state == SLEEP and time_ns > 0]
        assert len(asleep) >= 8
        first = local.at(asleep[0]) // S
        assert asleep == [local.true_ns((first + turn) * S + 100 * MS) for turn in range(len(asleep))]


def test_random_phases_differ_and_do_not_rest_on_order(tmp_path):
    more = "    duty_cycle: {period_s: 1, on_s: 0.1}"
    idle, _ = run(cycled(tmp_path, "Idle", more=more))
    asleep = {node: {t % S for t, state in states(idle, node) if state == SLEEP and t > 0} for node in range(9)}
    assert [len(times) for times in asleep.values()] == [1] * 9
    assert len(set().union(*asleep.values())) == 9
    loaded = small(tmp_path, more=more)
    events, _ = run(loaded)
    assert by_instant(run(loaded, Shuffled(3))[0]) == by_instant(events)


def test_it_must_sleep_at_all(tmp_path):
    with pytest.raises(ScenarioError, match="on_s below period_s"):
        cycled(tmp_path, "Idle", more="    duty_cycle: {period_s: 1, on_s: 1}")


def test_a_held_switch_wakes_for_nobody_until_it_is_released():
    calls = []

    class Mac:
        pending = 0

        def sleep(self):
            calls.append("sleep")

        def wake(self):
            calls.append("wake")

        def stop(self):
            """Nothing."""

    switch = RadioSwitch(Mac())
    switch.hold()
    switch.wake()
    switch.sleep()
    switch.wake()
    assert calls == ["sleep", "sleep"]
    switch.release()
    assert calls == ["sleep", "sleep", "wake"]
    switch.hold()
    switch.sleep()
    switch.release()
    assert calls == ["sleep", "sleep", "wake", "sleep", "sleep"]


class AtTheEdges:
    """Speaks at the start and whenever its radio is about to wake or to sleep."""

    def run(self, node):
        for turn in range(4):
            node.broadcast("edge", bytes(20))
            yield from node.pause_until(turn * S + 100 * MS)
            node.broadcast("edge", bytes(20))
            yield from node.pause_until((turn + 1) * S)


@pytest.mark.parametrize("phase", ["random", "aligned"])
@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_sent_at_an_edge_does_not_rest_on_order(tmp_path, phase, seed):
    more = f"    duty_cycle: {{period_s: 1, on_s: 0.1, phase: {phase}}}"
    loaded = cycled(tmp_path, "AtTheEdges", more=more, duration_s=5)
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(run(loaded)[0])


@pytest.mark.parametrize(
    ("crash_s", "reboot_s", "expected"), [(2.1, 2.5, [(2.5, "sleep"), (3.0, "wake")]), (2.35, 3.1, [(3.3, "sleep")])]
)
def test_after_a_crash_the_cycle_is_where_it_would_have_been(crash_s, reboot_s, expected):
    clock, calls = Clock(), []

    class Mac:
        def sleep(self):
            calls.append((clock.now_ns / S, "sleep"))

        def wake(self):
            calls.append((clock.now_ns / S, "wake"))

    switch = RadioSwitch(Mac())
    DutyCycle(clock, LocalClock(clock), switch, DutyCycleParameters(period_s=1, on_s=0.3), 0.0)
    clock.call_after(round(crash_s * S), lambda _: switch.stop())
    clock.call_after(round(reboot_s * S), lambda _: switch.restart())
    clock.environment.run(until=round(3.5 * S))
    late = [call for call in calls if call[0] > crash_s]
    assert late[: len(expected)] == expected


def test_low_power_listening_goes_on_whenever_in_a_check_it_was_put_to_sleep(tmp_path):
    """The cycle's end falls into every part of a check: nobody is left idle and deaf."""
    more = "    duty_cycle: {period_s: 0.97, on_s: 0.5}"
    events, _ = run(cycled(tmp_path, "Patient", more=more, mac="{type: lpl}", duration_s=200))
    for node in range(9):
        entries = states(events, node)
        assert max(end - begin for (begin, state), (end, _) in pairwise(entries) if state != SLEEP) < S
        assert entries[-1][0] > 190 * S
