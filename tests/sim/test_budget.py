"""Energy allowances: exact instants, and what the policies do."""

import json
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios_for_tests import Shuffled, run, small
from test_energy import CHANGES, Bench, exact, first_empty_ns, segments
from test_order import by_instant

from netsim.api import NoEnergyError
from netsim.errors import AlgorithmError, ScenarioError
from netsim.metrics.collect import metrics_of
from netsim.sim.allowance import Allowance
from netsim.sim.budget import BudgetParameters, NodeBudget
from netsim.sim.clock import Clock
from netsim.sim.local_clock import LocalClock
from netsim.sim.mac.link import LinkJob
from netsim.sim.radio_switch import RadioSwitch
from netsim.testing import run_algorithm
from netsim.trace.events import (
    AlgorithmRecord,
    EnergyBudget,
    Frame,
    MessageDropped,
    MessageSent,
    NodeLife,
    RadioState,
)
from netsim.trace.recorder import Recorder

S = 10**9
MS = 10**6
ALLOWANCES_J = st.sampled_from([1e-12, 3e-7, 1e-3, 0.05, 0.123456789, 1.0])
SLEEP = 1


@settings(max_examples=150, deadline=None)
@given(CHANGES, ALLOWANCES_J)
def test_an_allowance_is_used_up_at_the_exact_nanosecond(changes, allowance_j):
    bench = Bench()
    short_ns = []
    allowance = Allowance(bench.clock, bench.battery, allowance_j, lambda: short_ns.append(bench.clock.now_ns))
    expected_ns = first_empty_ns(changes, allowance_j)
    bench.run(changes, 0 if expected_ns is None else expected_ns)
    assert short_ns == ([] if expected_ns is None else [expected_ns])
    assert allowance.is_short == (expected_ns is not None)
    assert allowance.spent_yj == bench.battery.used_yj


class NoMac:
    """Takes nothing and does nothing."""

    pending = 0

    def submit(self, job):
        raise NotImplementedError

    def sleep(self):
        """Nothing."""

    def wake(self):
        """Nothing."""

    def stop(self):
        """Nothing."""


class Notes:
    def __init__(self):
        self.events = []

    def handlers(self):
        return {EnergyBudget: lambda event, time_ns: self.events.append((time_ns, event.event))}


def used_yj(changes, at_ns):
    """What the changes draw until an instant, by hand."""
    total, now_ns = Fraction(0), 0
    for time_ns, power in segments(changes, 10**18):
        total += exact(float(power)) * min(time_ns, max(0, at_ns - now_ns))
        now_ns += time_ns
    return total * 10**12


def expected_notes(changes, allowance_j, period_ns, end_ns):
    """Short and replenished events by bisection over an exact integral, period by period."""
    allowance_yj, notes, begin_ns = exact(allowance_j) * 10**24, [], 0
    while begin_ns <= end_ns:
        base, until_ns = used_yj(changes, begin_ns), begin_ns + period_ns
        low, high = begin_ns, until_ns
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if used_yj(changes, middle) - base >= allowance_yj else (middle + 1, high)
        if used_yj(changes, low) - base >= allowance_yj and low < until_ns:
            notes.append((low, "short"))
        if used_yj(changes, until_ns) - base >= allowance_yj:
            notes.append((until_ns, "replenished"))
        begin_ns = until_ns
    return [note for note in notes if note[0] < end_ns]  # whether the run stops before what happens at its end is a tie


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(1, 2 * S), st.integers(0, 2), st.sampled_from([0.0, 0.06, 5.4, 56.4])),
        min_size=1,
        max_size=8,
    ),
    st.sampled_from([1e-6, 1e-3, 0.0282, 0.0564]),
    st.sampled_from([S // 2, S, 3 * S]),
    st.integers(0, 3),
)
def test_periods_are_counted_apart(changes, allowance_j, period_ns, seed):
    """A draw that reaches the allowance exactly at the end of a period: replenished, and never short."""
    bench = Bench(clock=Clock(Shuffled(seed)))
    notes = Notes()
    recorder = Recorder(lambda: bench.clock.now_ns, [notes])
    parameters = BudgetParameters(allowance_j=allowance_j, per=period_ns / S, policy="warn")
    local = LocalClock(bench.clock)
    NodeBudget(bench.clock, local, 1, bench.battery, parameters, RadioSwitch(NoMac()), NoMac(), recorder)
    bench.run(changes, 5 * S)
    end_ns = bench.clock.now_ns
    noted = [note for note in notes.events if note[0] < end_ns]
    assert noted == expected_notes(changes, allowance_j, period_ns, end_ns)


# --- policies in a run ------------------------------------------------------------------------------------------------


class Reporter:
    """Every 100 ms: computes, senses and tells a neighbour; notes what it could do and what its budget showed."""

    def run(self, node):
        for turn in range(40):
            yield from node.pause_until(turn * 100 * MS)
            done = []
            try:
                yield from node.compute(2000)
                yield from node.sense()
            except NoEnergyError as error:
                done.append(str(error).split()[0])
            begun_ns = node.now_ns
            delivery = yield from node.send(node.neighbours[0].id, "news", bytes(20)).wait()
            budget = node.budget
            done += [delivery.reason, delivery.attempts, node.now_ns - begun_ns]
            shown = [budget.allowance_j, budget.spent_j, budget.left_j, budget.is_short, budget.replenishes_ns]
            node.record(AlgorithmRecord(node.id, "turn", json.dumps([turn, done, shown])))
        yield from node.pause_until(4 * S)


REPORTER = '{type: "test_budget:Reporter"}'


def with_budget(folder, budget, **settings):
    return small(folder, more=f"    budget: {budget}", algorithm=REPORTER, **settings)


def of(events, kind):
    return [(time_ns, event) for time_ns, event in events if isinstance(event, kind)]


def turns(events, node=0):
    return [json.loads(event.fields_json) for _, event in of(events, AlgorithmRecord) if event.node == node]


def budget_events(events, node=0):
    return [(time_ns, event) for time_ns, event in of(events, EnergyBudget) if event.node == node]


def test_a_node_without_an_allowance_is_only_counted(tmp_path):
    events, simulation = run(small(tmp_path, algorithm=REPORTER))
    assert of(events, EnergyBudget) == []
    last = turns(events)[-1][2]
    assert last[0] == last[2] == float("inf")
    assert last[3:] == [False, None]
    assert 0 < last[1] < simulation.nodes[0].parts.battery.used_j


def test_warn_changes_nothing_but_the_trace(tmp_path):
    free, _ = run(small(tmp_path, algorithm=REPORTER))
    warned, _ = run(with_budget(tmp_path, "{allowance_j: 0.05, policy: warn}"))
    frames = [event for _, event in of(free, Frame)]
    assert [repr(event) for _, event in of(warned, Frame)] == [repr(frame) for frame in frames]
    ((at_ns, short),) = budget_events(warned)
    assert (short.event, short.action, short.task) == ("short", "warn", "")
    assert short.spent_j == pytest.approx(0.05, rel=1e-6)
    assert 0.8 * S < at_ns < 1.0 * S  # 56.4 mW of listening
    assert all(shown[3] == (turn * 100 * MS > at_ns) for turn, _, shown in turns(warned) if turn != at_ns // (100 * MS))


def test_refuse_ends_messages_and_raises(tmp_path):
    events, simulation = run(with_budget(tmp_path, "{allowance_j: 0.1, policy: refuse}"))
    short_ns = next(time_ns for time_ns, event in budget_events(events) if event.event == "short")
    late = [done for turn, done, _ in turns(events) if turn * 100 * MS > short_ns]
    assert late
    assert all(done == ["compute", "no_energy", 0, 0] for done in late)
    assert {event.event for _, event in budget_events(events)} == {"short", "refused"}
    refused = [event.action for _, event in budget_events(events) if event.event == "refused"]
    assert refused == ["compute", "send"] * len(late)
    shorts = {event.node: time_ns for time_ns, event in of(events, EnergyBudget) if event.event == "short"}
    assert not [f for _, f in of(events, Frame) if not f.is_ack and f.t_start_ns > shorts[f.source] + 30 * MS]
    assert metrics_of(events)["drops_by_reason"]["no_energy"] >= 9 * len(late) - 9
    assert len(of(events, MessageSent)) == 9 * 40
    assert all(node.failure is None for node in simulation.nodes.values())


def test_sleep_waits_for_the_next_period(tmp_path):
    """28.2 mJ a second are half a second of listening: then the radio sleeps and messages wait."""
    events, _ = run(with_budget(tmp_path, "{allowance_j: 0.0282, per: 1, policy: sleep}"))
    notes = [(time_ns, event.event) for time_ns, event in budget_events(events)]
    assert [event for _, event in notes] == ["short", "replenished"] * (len(notes) // 2) + ["short"] * (len(notes) % 2)
    assert [time_ns for time_ns, event in notes if event == "replenished"] == [S, 2 * S, 3 * S, 4 * S][
        : len(notes) // 2
    ]
    radio = [(time_ns, event.state) for time_ns, event in of(events, RadioState) if event.node == 0]
    shorts = [time_ns for time_ns, event in notes if event == "short"]
    asleep = [time_ns for time_ns, state in radio if state == SLEEP]
    assert len(asleep) >= len(shorts)
    assert all(any(short <= at_ns < short + 50 * MS for at_ns in asleep) for short in shorts)
    replenished = [time_ns for time_ns, event in notes if event == "replenished"]
    acted = [time_ns for time_ns, event in of(events, AlgorithmRecord) if event.node == 0]
    for short_ns, until_ns in zip(shorts, replenished, strict=False):
        assert not [time_ns for time_ns in acted if short_ns + 60 * MS < time_ns < until_ns]
    assert not [event for _, event in of(events, MessageDropped) if event.reason == "no_energy"]


class Burst:
    """Node 0 tells its neighbour seventy things while it is short, and when each was sent."""

    def run(self, node):
        if node.id != 0:
            return
        while not node.budget.is_short:
            yield from node.pause(10 * MS)
        tickets = [node.send(node.neighbours[0].id, "burst", bytes([number])) for number in range(70)]
        for ticket in tickets:
            delivery = yield from ticket.wait()
            node.record(AlgorithmRecord(node.id, "fate", json.dumps([delivery.reason, node.now_ns])))


def test_while_it_sleeps_sixty_four_packets_wait_in_order_and_others_are_dropped(tmp_path):
    budget = "{allowance_j: 0.0282, per: 1, policy: sleep}"
    events, _ = run(
        small(tmp_path, more=f"    budget: {budget}", algorithm='{type: "test_budget:Burst"}', mac="{type: ideal}")
    )
    fates = [json.loads(event.fields_json) for _, event in of(events, AlgorithmRecord)]
    assert [reason for reason, _ in fates] == [""] * 64 + ["queue_full"] * 6
    assert fates[0][1] > S
    starts = [event.t_start_ns for _, event in of(events, Frame) if event.kind == "burst"]
    assert len(starts) == 64
    assert min(starts) > S
    assert [event.message_id for _, event in of(events, Frame) if event.kind == "burst"] == sorted(
        event.message_id for _, event in of(events, Frame) if event.kind == "burst"
    )


def test_a_run_whose_nodes_sleep_for_good_ends_at_its_horizon(tmp_path):
    events, simulation = run(with_budget(tmp_path, "{allowance_j: 0.05, policy: sleep}", duration_s=6))
    assert simulation.now_ns == 6 * S
    assert not [event for _, event in of(events, NodeLife) if event.event in ("failed", "finished")]


@pytest.mark.parametrize("policy", ["refuse", "sleep"])
@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_rests_on_the_order_within_an_instant(tmp_path, policy, seed):
    clock = "    clock: {drift_sd_ppm: 30}\n"
    loaded = small(
        tmp_path, more=f"{clock}    budget: {{allowance_j: 0.0282, per: 1, policy: {policy}}}", algorithm=REPORTER
    )
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(run(loaded)[0])


def test_a_period_is_measured_by_the_nodes_own_counter(tmp_path):
    more = "    clock: {drift_sd_ppm: 3000, offset_sd_s: 5}\n    budget: {allowance_j: 0.001, per: 1, policy: warn}"
    events, simulation = run(small(tmp_path, more=more, algorithm=REPORTER))
    for node_id, node in simulation.nodes.items():
        clock = node.parts.clock
        times = [t for t, event in budget_events(events, node_id) if event.event == "replenished"]
        begin_ns = clock.counter_at(0)
        assert times == [clock.counter_true_ns(begin_ns + (k + 1) * S) for k in range(len(times))]
        assert len(times) >= 3


@pytest.mark.parametrize("per", ["hour", "run", "0.5", "3600"])
def test_periods_that_a_scenario_can_name(tmp_path, per):
    group = with_budget(tmp_path, f"{{allowance_j: 1, per: {per}}}").scenario.nodes[0]
    assert group.budget.period_ns == {"hour": 3600 * S, "run": None, "0.5": S // 2, "3600": 3600 * S}[per]


@pytest.mark.parametrize("budget", ["{allowance_j: 0}", "{allowance_j: 1, per: day}", "{allowance_j: 1, per: 0}"])
def test_others_are_findings(tmp_path, budget):
    with pytest.raises(ScenarioError, match=r"nodes\[0\]\.budget"):
        with_budget(tmp_path, budget)


# --- tasks ------------------------------------------------------------------------------------------------------------


class Tasks:
    """On the bench an operation takes 1 us and 1 nJ, a reading 1 ms and 1 uJ."""

    def run(self, node):
        with node.task("outer") as outer:
            yield from node.compute(1000)
            with node.task("inner", allowance_j=0.5e-6) as inner:
                node.log(f"{inner.spent_j:.9f} {inner.left_j:.9f} {inner.is_short}")
                yield from node.compute(600)
                node.log(f"{inner.spent_j:.9f} {inner.left_j:.9f} {inner.is_short}")
            yield from node.sense()
        yield from node.compute(5000)
        node.log(f"{outer.spent_j:.9f} {inner.spent_j:.9f} {outer.allowance_j}")


def test_tasks_count_what_the_node_draws_meanwhile():
    result = run_algorithm(Tasks(), 1, observe=lambda node: [1.0]).require_success()
    lines = [event.message for _, event in result.events if type(event).__name__ == "Log"]
    assert lines == [
        "0.000000000 0.000000500 False",
        "0.000000600 0.000000000 True",
        "0.000002600 0.000000600 inf",
    ]
    notes = [(time_ns, event.event, event.task) for time_ns, event in result.of(EnergyBudget)]
    assert notes == [(1_500_000, "short", "inner"), (1_600_000, "ended", "inner"), (2_600_000, "ended", "outer")]
    figures = metrics_of(result.events)
    assert figures["energy_by_task_j"] == {"inner": pytest.approx(0.6e-6), "outer": pytest.approx(2.6e-6)}
    assert figures["energy_allowance_short"] == 1


class Refused:
    def run(self, node):
        with node.task("round", allowance_j=1e-6, policy="refuse"):
            yield from node.compute(2000)  # what has begun is finished
            delivery = yield from node.send(1, "k", b"").wait()
            node.log(f"{delivery.reason} {node.now_ns}")
            try:
                yield from node.compute(1)
            except NoEnergyError as error:
                node.log(str(error))
        delivery = yield from node.send(1, "k", b"").wait()
        node.log(str(delivery.acknowledged))


def test_a_task_can_refuse():
    class Only0(Refused):
        def run(self, node):
            if node.id == 0:
                yield from super().run(node)

    result = run_algorithm(Only0(), 2).require_success()
    lines = [event.message for _, event in result.events if type(event).__name__ == "Log"]
    assert lines[0] == "no_energy 2000000"
    assert lines[1].startswith("compute refused: task 'round' has spent 2e-06 J of its allowance of 1e-06 J")
    assert lines[2] == "True"


def test_a_task_ends_with_its_node():
    class Endless:
        def run(self, node):
            with node.task("listening"):
                yield from node.compute(10**9)

    result = run_algorithm(Endless(), 1, battery_j=1e-6)
    assert [(t, e.event) for t, e in result.of(EnergyBudget)] == [(1_000_000, "ended")]


@pytest.mark.parametrize("arguments", [{"policy": "sleep"}, {"allowance_j": 0}, {"allowance_j": float("nan")}])
def test_what_a_task_cannot_be(arguments):
    class Wrong:
        def run(self, node):
            with node.task("x", **arguments):
                yield from node.pause(1)

    with pytest.raises(AlgorithmError, match="task"):
        run_algorithm(Wrong(), 1).require_success()


class Calls(NoMac):
    """Notes what the switch tells it."""

    def __init__(self):
        self.calls = []

    def sleep(self):
        self.calls.append("sleep")

    def wake(self):
        self.calls.append("wake")


def test_a_crash_ends_what_waits_and_a_reboot_finds_the_allowance_as_it_was():
    """100 mW use 0.1 J up in a second; down from 1.2 to 4.5 s, in the middle of the third period of two seconds."""
    bench, notes, mac = Bench(), Notes(), Calls()
    recorder = Recorder(lambda: bench.clock.now_ns, [notes])
    parameters = BudgetParameters(allowance_j=0.1, per=2.0, policy="sleep")
    budget = NodeBudget(
        bench.clock, LocalClock(bench.clock), 1, bench.battery, parameters, RadioSwitch(mac), mac, recorder
    )
    fates = []
    bench.meters[0].draw(100.0, "on")
    at = lambda time_s, action: bench.clock.call_after(round(time_s * S), lambda _: action())  # noqa: E731
    at(1.1, lambda: budget.submit(LinkJob(2, b"", "k", 1, fates.append)))
    at(1.2, lambda: (budget.give_up("crashed"), bench.meters[0].draw(0.0, "off")))
    at(4.5, lambda: (bench.meters[0].draw(100.0, "on"), budget.restart()))
    bench.clock.environment.run(until=7 * S)
    assert [(fate.reason, fate.attempts) for fate in fates] == [("crashed", 0)]
    assert notes.events == [(S, "short"), (5_500_000_000, "short"), (6 * S, "replenished"), (7 * S, "short")][:3]
    assert mac.calls == ["sleep", "sleep", "wake"]
