"""Crash and reboot: everything of a life ends with it, nothing of it acts in the next, and the books still close."""

import math
from collections import Counter, defaultdict
from unittest.mock import ANY

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios_for_tests import Shuffled
from sim_rig import Log as EventLog
from test_order import by_instant

from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.sim.clock import Clock
from netsim.trace.events import (
    OUTCOMES,
    RADIO_STATES,
    AlgorithmRecord,
    EnergyLedger,
    Fault,
    Frame,
    Log,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    RadioState,
)
from netsim.units import NS_PER_S

MS = 1_000_000
MEDIA = {
    "csma": "medium: {type: log-distance, shadowing_sd_db: 0}\nmac: {type: csma}",
    "ideal": "medium: {type: ideal, delay_s: 0.0001, loss_probability: 0.1}\nmac: {type: ideal}",
    "ideal-csma": "medium: {type: ideal, delay_s: 0.0001, loss_probability: 0.1}\nmac: {type: csma}",
}
FOUR = """
kind: scenario
schema_version: 1
name: four
duration_s: 2
nodes:
  - name: sensors
    placement: {{type: grid, rows: 2, columns: 2, spacing_m: 10}}
    battery: {battery}
    cpu: cortex_m4
algorithm: {{type: "busy_algorithm:Busy"}}
trace: {{detail: full}}
{media}
"""


def four(folder, media, battery="{type: mains}"):
    """Four busy nodes that hear each other."""
    path = folder / "four.yaml"
    path.write_text(FOUR.format(media=MEDIA[media], battery=battery))
    return load(path)


@pytest.fixture(scope="module", params=MEDIA)
def loaded(request, tmp_path_factory):
    return four(tmp_path_factory.mktemp("four"), request.param)


def run(loaded, crashes, environment=None):
    """Run with crashes (time, node, reboot after or None, all in ns); returns (events, simulation)."""
    log = EventLog()
    clock = Clock(environment)
    simulation = build(loaded, [log], clock).simulation
    for at_ns, node, back_ns in crashes:
        clock.call_first(at_ns, lambda _, node=node, back_ns=back_ns: simulation.crash(node, "a test", back_ns))
    simulation.run()
    simulation.conclude()  # raises unless the energies close
    return log.events, simulation


def of(events, event_type):
    return [(time_ns, event) for time_ns, event in events if isinstance(event, event_type)]


def downs(events, end_ns):
    """For each node its half-open intervals (from, to) of being down."""
    found = defaultdict(list)
    for time_ns, event in of(events, NodeLife):
        if event.event in ("crashed", "died"):
            found[event.node].append((time_ns, end_ns + 1))
        elif event.event == "rebooted":
            found[event.node][-1] = (found[event.node][-1][0], time_ns)
    return found


INSTANTS = {}


def instants(loaded):
    """When something happens in the undisturbed run: where an order of events could matter."""
    name = id(loaded)
    if name not in INSTANTS:
        events, _ = run(loaded, ())
        times = {time_ns for time_ns, event in events if time_ns > 0}
        times |= {event.t_start_ns for _, event in of(events, Frame)}
        INSTANTS[name] = sorted(times)
    return INSTANTS[name]


@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_whatever_the_instants_of_crashes_nothing_of_an_old_life_is_left(loaded, data):
    times = st.one_of(st.sampled_from(instants(loaded)), st.integers(1, 900 * MS))
    back = st.one_of(st.none(), st.integers(1, 3), st.integers(1, 300 * MS), st.just(5 * NS_PER_S))
    crashes = data.draw(st.lists(st.tuples(times, st.integers(0, 3), back), min_size=1, max_size=6))
    check(*run(loaded, crashes))


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_of_many_instants_too(loaded, data):
    test_whatever_the_instants_of_crashes_nothing_of_an_old_life_is_left.hypothesis.inner_test(loaded, data)


def check(events, simulation, once=True):
    end_ns = simulation.now_ns
    down = downs(events, end_ns)

    def is_down(node, time_ns):
        return any(begin < time_ns < end for begin, end in down[node])

    assert [event for _, event in of(events, NodeLife) if event.event == "failed"] == []
    assert end_ns <= simulation.horizon_ns
    for time_ns, event in events:
        if isinstance(event, NodeLife | MessageDelivered | MessageDropped | AlgorithmRecord | RadioState):
            assert not is_down(event.node, time_ns), event
        elif isinstance(event, MessageSent):
            assert not is_down(event.source, time_ns), event
        elif isinstance(event, Frame):  # on the ideal medium it is recorded after its end
            assert not is_down(event.source, event.t_end_ns), event
    computed = {event.kind for _, event in of(events, AlgorithmRecord) if event.kind.startswith("computed")}
    assert computed <= {
        "computed for 2000000"
    }  # 20,000 operations at 10 million a second; nobody waits for a job of a former life
    check_frames(events, down, once)
    check_books(events, simulation, end_ns, down)


def check_frames(events, down, once):
    """A node that was down within a frame did not decode it; a frame cut short belongs to a node that went down.

    The ideal medium looks only at the instant of reception.
    """
    begins = {(node, begin) for node, intervals in down.items() for begin, _ in intervals}
    lives = Counter()
    for time_ns, frame in of(events, Frame):
        if frame.t_end_ns - frame.t_start_ns < (6 + frame.size_byte) * 32_000:
            assert (frame.source, frame.t_end_ns) in begins
            assert {OUTCOMES[code] for code in frame.rx_outcome} == {"dead"}
        is_ideal = math.inf in frame.rx_sinr_db
        from_ns, to_ns = (time_ns, time_ns) if is_ideal else (frame.t_start_ns, frame.t_end_ns)
        for node, code in zip(frame.rx_node, frame.rx_outcome, strict=True):
            if any(begin < to_ns and from_ns < end for begin, end in down[node]):
                assert OUTCOMES[code] not in ("received", "overheard"), frame
    for time_ns, event in of(events, MessageDelivered):
        life = sum(begin < time_ns for begin, _ in down[event.node])
        lives[event.message_id, event.node, life] += 1
    assert not once or max(lives.values(), default=1) == 1


def check_books(events, simulation, end_ns, down):
    """Every device is accounted for at every nanosecond, and off exactly while its node was down."""
    assert len(of(events, EnergyLedger)) == 1
    for node, member in simulation.nodes.items():
        booked_ns, off_ns = Counter(), Counter()
        for (device, state, _), entry in member.parts.account.entries.items():
            booked_ns[device] += entry.time_ns
            off_ns[device] += entry.time_ns * (state == "off")
        assert set(booked_ns.values()) == {end_ns}
        lasted_ns = sum(min(end, end_ns) - begin for begin, end in down[node])
        assert off_ns["radio"] == off_ns["cpu"] == lasted_ns


def test_shuffled_ties_change_nothing_where_nodes_crash(tmp_path):
    """Over the medium with interference: the ideal one draws losses in the order in which frames end."""
    loaded = four(tmp_path, "csma")
    times = instants(loaded)
    crashes = [(times[len(times) // 3], 1, 40 * MS), (times[len(times) // 2], 2, None), (times[len(times) // 4], 1, 1)]
    reference = by_instant(run(loaded, crashes)[0])
    for seed in range(6):
        assert by_instant(run(loaded, crashes, Shuffled(seed))[0]) == reference


FAULTS = """faults:
  - {type: crash, rate_per_h: 9000, reboot_after_s: 0.02, reboot: exponential}
  - {type: outage, nodes: [2], mean_up_s: 0.2, mean_down_s: 0.05}
  - {type: partition, groups: [[0, 1]], from_s: 0.3, to_s: 0.4}
  - {type: gilbert-elliott, mean_good_s: 0.05, mean_bad_s: 0.02, loss_good: 0.1}
  - {type: corruption, share: 0.1}
  - {type: delay, share: 0.3, mean_s: 0.01}
  - {type: duplication, share: 0.3, mean_delay_s: 0.01}
  - {type: sensor-noise, nodes: [1], sd: 1}
"""
JAMMER = "  - {type: jammer, position_m: [20, 20], power_dbm: -10, on_s: 0.01, off_s: 0.1}\n"


@pytest.fixture(scope="module")
def troubled(tmp_path_factory):
    """Four nodes under all rules at once."""
    loaded = four(tmp_path_factory.mktemp("faults"), "csma")
    loaded.path.write_text(loaded.path.read_text() + FAULTS + JAMMER)
    return load(loaded.path)


def test_all_rules_at_once_strike_and_leave_the_laws_in_force(troubled):
    events, simulation = run(troubled, ())
    struck = Counter(event.kind for _, event in of(events, Fault) if event.event == "strikes")
    assert min(struck[rule.type] for rule in troubled.scenario.faults if rule.type != "jammer") > 1
    check(events, simulation, once=False)


def test_ties_are_ties_and_equal_seeds_are_equal_under_all_rules(troubled):
    """Up to the horizon: what processes that it cuts off still say while Python clears them up has no fixed place."""

    def story(environment=None):
        events, simulation = run(troubled, (), environment)
        return by_instant([entry for entry in events if entry[0] < simulation.horizon_ns])

    reference = story()
    assert story() == reference
    for seed in range(3):
        assert story(Shuffled(seed)) == reference


def named(events):
    return [(time_ns, event.node, event.event) for time_ns, event in of(events, NodeLife) if event.event != "started"]


def test_a_run_ends_although_a_crashed_node_never_comes_back(tmp_path):
    loaded = four(tmp_path, "csma")
    events, simulation = run(loaded, [(100 * MS, node, None) for node in range(4)])
    assert simulation.now_ns == 100 * MS
    assert named(events) == [(100 * MS, node, "crashed") for node in range(4)]


def test_a_run_waits_for_a_reboot_within_its_horizon_and_for_no_other(tmp_path):
    loaded = four(tmp_path, "csma")
    crashes = [(100 * MS, node, None) for node in range(3)]
    events, simulation = run(loaded, [*crashes, (100 * MS, 3, 1000 * MS)])
    assert named(events)[4:] == [(1100 * MS, 3, "rebooted"), (ANY, 3, "finished")]
    events, simulation = run(loaded, [*crashes, (100 * MS, 3, 1900 * MS)])
    assert simulation.now_ns == 100 * MS


def test_a_node_that_had_finished_runs_anew_after_a_crash(tmp_path):
    loaded = four(tmp_path, "csma")
    ends = {node: time_ns for time_ns, node, event in named(run(loaded, ())[0]) if event == "finished"}
    first, last = min(ends, key=ends.get), max(ends.values())
    events, simulation = run(loaded, [(last - 2, first, 1)])
    assert [event for _, node, event in named(events) if node == first] == [
        "finished",
        "crashed",
        "rebooted",
        "finished",
    ]
    assert simulation.now_ns > last


def test_a_node_that_is_down_cannot_crash_and_a_death_is_final(tmp_path):
    loaded = four(tmp_path, "csma", "{type: capacity, energy_j: 0.006}")  # for about 100 ms
    events, simulation = run(loaded, [(20 * MS, 0, 30 * MS), (30 * MS, 0, 1), (150 * MS, 1, 1)])
    story = [(node, event) for _, node, event in named(events)]
    assert story[:2] == [(0, "crashed"), (0, "rebooted")]
    assert sorted(story[2:]) == [(node, "died") for node in range(4)]
    died_ns = {node: time_ns for time_ns, node, event in named(events) if event == "died"}
    assert min(died_ns.values()) + 25 * MS < died_ns[0] < min(died_ns.values()) + 35 * MS  # 30 ms off cost nothing
    assert all(member.parts.radio.state == "dead" for member in simulation.nodes.values())


@pytest.mark.parametrize("reason", ["crashed", "died"])
def test_what_waits_at_a_node_that_goes_down_is_said_to_be_lost(tmp_path, reason):
    """Every unicast is delivered or dropped: none vanishes without a word. A sender may not know that it arrived."""
    battery = "{type: capacity, energy_j: 0.006}" if reason == "died" else "{type: mains}"
    crashes = [(100 * MS, node, None) for node in range(4)] if reason == "crashed" else []
    events, _ = run(four(tmp_path, "csma", battery), crashes)
    fates = {event.message_id for _, event in of(events, MessageDelivered)}
    dropped = {event.message_id: event.reason for _, event in of(events, MessageDropped)}
    sent = {event.message_id for _, event in of(events, MessageSent) if event.kind == "one"}
    assert sent <= fates | set(dropped)
    assert Counter(dropped.values())[reason] >= 4
    downs = {event.node: time_ns for time_ns, event in of(events, NodeLife) if event.event == reason}
    assert all(time_ns == downs[event.node] for time_ns, event in of(events, MessageDropped) if event.reason == reason)


def test_clearing_up_happens_before_the_crash_and_is_lost_with_it(tmp_path):
    events, _ = run(four(tmp_path, "csma"), [(100 * MS, 0, 50 * MS)])
    now = [event for time_ns, event in events if time_ns == 100 * MS and getattr(event, "node", 0) == 0]
    kinds = [type(event).__name__ for event in now if not isinstance(event, MessageDropped)]
    assert kinds[:4] == ["Log", "MessageSent", "NodeLife", "RadioState"]
    assert [event.reason for event in now if isinstance(event, MessageDropped)][-1] == "crashed"
    states = [RADIO_STATES[event.state] for time_ns, event in of(events, RadioState) if event.node == 0]
    assert states[states.index("off") + 1] == "listen"
    assert [event.message for _, event in of(events, Log) if event.name == "node 0"] == [
        "end of life 1",
        "end of life 2",
    ]
