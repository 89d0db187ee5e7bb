"""Whole runs whose network layer does things by itself: they end, repeat themselves, and tell what could not be done."""

import json
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant

from netsim.errors import ScenarioError
from netsim.scenario.load import load
from netsim.trace.events import (
    BROADCAST,
    AlgorithmRecord,
    EnergyLedger,
    Frame,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    RouteChange,
)

BEACONS = "discovery: {type: beacons, period_s: 0.5}"
NETWORKS = {
    "collection": f"{{type: collection, {BEACONS}}}",
    "vector": f"{{type: shortest-path, update_s: 1, {BEACONS}}}",
    "geographic": f"{{type: geographic, {BEACONS}}}",
    "one-hop": f"{{type: one-hop, {BEACONS}}}",
}
SINK = "  - {name: sink, role: sink, battery: {type: mains}, placement: {type: listed, positions_m: [[57, 57]]}}"
COLLECT = "{type: collect-readings, start_s: 4, period_s: 1, rounds: 3, drain_s: 1, padding_byte: 150}"


def of(events, event_type):
    return [(time_ns, event) for time_ns, event in events if isinstance(event, event_type)]


def collecting(folder, network, **more):
    settings = {
        "network": NETWORKS[network],
        "algorithm": COLLECT,
        "more": SINK,
        "spacing_m": 22,
        "medium": "{type: log-distance, exponent: 3.5, shadowing_sd_db: 2}",
    }
    return small(folder, **settings | more)


@pytest.fixture(scope="module", params=NETWORKS)
def loaded(request, tmp_path_factory):
    return collecting(tmp_path_factory.mktemp("network"), request.param)


@pytest.fixture(scope="module")
def reference(loaded):
    return run(loaded)[0]


def test_control_traffic_is_real_frames_that_are_charged(loaded, reference):
    frames = Counter(frame.kind for _, frame in of(reference, Frame) if not frame.is_ack)
    kinds = {"beacon", "reading"} | ({"route"} if loaded.scenario.network.type == "shortest-path" else set())
    assert set(frames) == kinds
    assert {frame.message_id for _, frame in of(reference, Frame) if frame.kind != "reading"} == {0}
    ((_, ledger),) = of(reference, EnergyLedger)
    booked = {(state, kind) for state, kind in zip(ledger.state, ledger.kind, strict=True)}
    assert {("transmit", kind) for kind in kinds} | {("receive", kind) for kind in kinds} <= booked


def test_beacons_do_not_keep_a_run_alive(reference, loaded):
    """Every algorithm ends at 8 s; the horizon is 20 s."""
    ((end_ns, _),) = of(reference, EnergyLedger)
    assert 8_000_000_000 <= end_ns < 8_100_000_000
    assert {event.event for _, event in of(reference, NodeLife)} == {"started", "finished"}


def test_readings_arrive_whole_and_once(reference, loaded):
    sent = {event.message_id: event for _, event in of(reference, MessageSent)}
    delivered = [event for _, event in of(reference, MessageDelivered)]
    assert len(sent) == 27
    assert len({event.message_id for event in delivered}) == len(delivered)
    assert {event.node for event in delivered} == {9}
    if loaded.scenario.network.type != "one-hop":
        assert len(delivered) >= 0.9 * len(sent)
        assert max(event.hops for event in delivered) >= 2
    records = [
        json.loads(event.fields_json) for _, event in of(reference, AlgorithmRecord) if event.kind == "readings_taken"
    ]
    assert records == [{"count": len(delivered), "sources": len({event.source for event in delivered})}]


@pytest.mark.parametrize("seed", range(3))
def test_a_shuffle_of_simultaneous_events_changes_nothing(loaded, reference, seed):
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(reference)


def test_equal_seeds_give_equal_runs_and_others_other_ones(loaded, reference, tmp_path):
    assert repr(run(loaded)[0]) == repr(reference)
    if loaded.scenario.network.type == "collection":
        assert repr(run(collecting(tmp_path, "collection", seed=2))[0]) != repr(reference)


def test_without_noise_every_network_delivers_everything_over_many_hops(tmp_path):
    for network in ("collection", "vector", "geographic"):
        loaded = collecting(tmp_path, network, medium="{type: ideal, range_m: 20}", spacing_m=15)
        events, _ = run(loaded)
        assert len(of(events, MessageDelivered)) == len(of(events, MessageSent)) == 27, network


def test_an_algorithm_sees_whom_its_node_has_discovered(tmp_path):
    watch = {"algorithm": '{type: "sim_algorithms:Watch"}', "medium": "{type: ideal, range_m: 20}", "spacing_m": 15}
    seen = {}
    for network in ("{type: one-hop}", NETWORKS["one-hop"]):
        events, _ = run(small(tmp_path, network=network, **watch))
        seen[network] = [json.loads(event.fields_json) for _, event in of(events, AlgorithmRecord)]
    given, found = seen.values()
    assert found[:9] == [[]] * 9
    assert sorted(found[9:]) == sorted(given[:9]) == sorted(given[9:])
    assert {len(known) for known in found[9:]} == {2, 3, 4}


@pytest.mark.parametrize(
    ("network", "expected"),
    [
        ("{type: geographic, discovery: {type: beacons, positions: false}}", "positions: true"),
        ("{type: collection, discovery: {type: given}}", "beacons"),
        ("{type: one-hop, memory_s: 30}", "memory_s above reassembly_timeout_s"),
        ("{type: collection, hop_limit: 300}", "255"),
    ],
)
def test_settings_that_do_not_fit_are_findings(tmp_path, network, expected):
    with pytest.raises(ScenarioError, match=expected) as caught:
        small(tmp_path, network=network)
    assert all(finding.line for finding in caught.value.findings)


BRIDGE = """
kind: scenario
schema_version: 1
name: bridge
duration_s: {duration_s}
field: {{width_m: 60, height_m: 20}}
nodes:
  - name: bridge
    placement: {{type: listed, positions_m: [[30, 5]]}}
    battery: {{type: capacity, energy_j: {energy_j}}}
  - name: west
    placement: {{type: listed, positions_m: [[6, 5], [18, 5]]}}
    battery: {{type: mains}}
  - name: east
    placement: {{type: listed, positions_m: [[42, 5]]}}
    battery: {{type: mains}}
  - name: sink
    role: sink
    placement: {{type: listed, positions_m: [[54, 5]]}}
    battery: {{type: mains}}
medium: {{type: ideal, range_m: 13}}
mac: {{type: csma}}
network: {network}
algorithm: {{type: collect-readings, start_s: 8, period_s: 1, rounds: 24, drain_s: 2}}
"""


@pytest.mark.parametrize("network", ["vector", "collection", "geographic"])
def test_when_the_bridge_dies_the_algorithms_end_with_a_stated_result(tmp_path, network):
    """0.85 J at 56.4 mW are 15 s. The west learns of it and its readings are refused; the east goes on."""
    path = tmp_path / "bridge.yaml"
    path.write_text(BRIDGE.format(duration_s=100, energy_j=0.85, network=NETWORKS[network]), encoding="utf-8")
    events, _ = run(load(path))
    ((end_ns, _),) = of(events, EnergyLedger)
    assert 34_000_000_000 <= end_ns < 34_200_000_000
    ends = {event.node: event.event for _, event in of(events, NodeLife) if event.event != "started"}
    assert ends == {0: "died", 1: "finished", 2: "finished", 3: "finished", 4: "finished"}
    records = {event.node: json.loads(event.fields_json) for _, event in of(events, AlgorithmRecord)}
    death_ns = next(time_ns for time_ns, event in of(events, NodeLife) if event.event == "died")
    late = [
        event
        for time_ns, event in of(events, MessageSent)
        if event.source in (1, 2) and time_ns > death_ns + 10_000_000_000
    ]
    delivered = Counter(event.source for _, event in of(events, MessageDelivered))
    assert delivered[3] == 24
    assert 4 <= delivered[1] <= 8
    assert records[3] == {"count": 24, "refused": 0}
    # by position a packet is taken on by a neighbour, walks round the west and is dropped there: its sender cannot know
    assert (records[1]["refused"] > 0) is (network != "geographic")
    assert records[4]["count"] == sum(delivered.values())
    # ten seconds after the death, everybody knows: every late message from the west is refused on its way, none forgotten
    reasons = {event.message_id: event.reason for _, event in of(events, MessageDropped)}
    assert len(late) > 10
    assert {reasons[event.message_id] for event in late} == {"no_route"}
    if network != "geographic":
        gone = {
            event.node
            for time_ns, event in of(events, RouteChange)
            if event.next_hop == BROADCAST and time_ns > death_ns
        }
        assert {1, 2} <= gone


class TestFuzzed:
    """The routing of a whole run under rules for packets: nothing raises and nothing comes twice."""

    @given(st.lists(st.lists(st.sampled_from([0, 2, 400]), max_size=2), min_size=1, max_size=30), st.integers(0, 1039))
    @settings(max_examples=15, deadline=None)
    def test_lost_doubled_delayed_and_broken_packets(self, tmp_path_factory, verdicts, bit):
        from sim_rig import Log

        from netsim.scenario.build import build

        log = Log()
        for network in NETWORKS:
            loaded = collecting(
                tmp_path_factory.mktemp("fuzz"), network, duration_s=7, medium="{type: ideal, range_m: 20}"
            )
            simulation = build(loaded, [log]).simulation
            count = [0]

            def rules(data, neighbour, count=count):
                count[0] += 1
                broken = bytearray(data)
                if count[0] % 5 == 0:
                    broken[bit // 8 % len(data)] ^= 1 << bit % 8
                return [(delay * 1_000_000, bytes(broken)) for delay in verdicts[count[0] % len(verdicts)]]

            for node in simulation.nodes.values():
                node.parts.network.filter = rules
            simulation.run()
            simulation.conclude()
