"""Neighbours found by beacons, and the quality of links learned from beacons and data."""

import itertools
import math

import networkx as nx
import numpy as np
import pytest
from net_rig import MS, Net, S

from netsim.api import Delivery
from netsim.sim.net.neighbours import NeighbourTable
from netsim.sim.net.settings import BeaconDiscovery
from netsim.trace.events import MessageDropped

BEACONS = BeaconDiscovery(period_s=1.0)
PLAIN = BeaconDiscovery(period_s=1.0, jitter=0.0)


def known(net, node):
    return [(neighbour.id, neighbour.prr) for neighbour in net.networks[node].discovered]


def test_at_the_start_nobody_is_known_and_later_everybody_in_reach():
    net = Net(nx.cycle_graph(5), kind="vector", beacons=BEACONS)
    assert [known(net, node) for node in range(5)] == [[]] * 5
    net.run(S)
    assert [known(net, node) for node in range(5)] == [[]] * 5
    net.run(12 * S)
    for node in range(5):
        assert known(net, node) == [(other, 1.0) for other in sorted([(node - 1) % 5, (node + 1) % 5])]


def test_given_neighbours_are_not_discovered():
    assert Net(3).networks[0].discovered is None


def test_distances_come_from_the_positions_in_beacons():
    positions_m = {0: (0.0, 0.0), 1: (3.0, 4.0)}
    net = Net(2, kind="vector", beacons=PLAIN, positions_m=positions_m)
    net.run(8 * S)
    assert [neighbour.distance_m for neighbour in net.networks[0].discovered] == [5.0]
    silent = Net(2, kind="vector", beacons=BeaconDiscovery(period_s=1.0, positions=False), positions_m=positions_m)
    silent.run(10 * S)
    assert [neighbour.distance_m for neighbour in silent.networks[0].discovered] == [math.inf]


def test_beacons_are_frames_of_their_kind_begin_at_random_moments_and_keep_their_period():
    net = Net(nx.empty_graph(20), kind="vector", beacons=BEACONS)
    net.run(60 * S)
    beacons = {node: [t for t, n, job in net.frames if n == node and job.kind == "beacon"] for node in range(20)}
    first = [times[0] for times in beacons.values()]
    assert len(set(first)) == 20
    assert all(0 <= time_ns < S for time_ns in first)
    assert 0.25 < sum(first) / len(first) / S < 0.75
    gaps = [b - a for times in beacons.values() for a, b in itertools.pairwise(times)]
    assert all(0.5 * S <= gap < 1.5 * S for gap in gaps)
    # 20 x 60 gaps, uniform over one second: standard error 0.289 / sqrt(1200) = 0.0083 s
    assert abs(sum(gaps) / len(gaps) / S - 1.0) < 4 * 0.0083
    assert {job.message_id for *_, job in net.frames} == {0}


def test_who_is_not_heard_any_more_is_forgotten_after_four_and_a_half_periods():
    net = Net(2, kind="vector", beacons=PLAIN)
    net.run(10 * S)
    last_heard_ns = net.discovery[0].table.known[1].heard_ns
    net.kill(1)
    net.run(last_heard_ns + 4 * S)
    assert known(net, 0) == [(1, 1.0)]
    net.run(last_heard_ns + 6 * S)  # looked at with its own beacons, once a period
    assert known(net, 0) == []


def test_a_link_that_only_one_end_hears_is_no_link():
    one_way = nx.DiGraph([(0, 1)])
    net = Net(one_way, kind="vector", beacons=PLAIN)
    net.run(20 * S)
    assert 0 in net.discovery[1].table.known
    assert known(net, 0) == known(net, 1) == []


@pytest.mark.parametrize("lost", [0.0, 0.25, 0.5])
def test_the_share_of_beacons_is_estimated_without_bias(lost):
    """Node 1 misses beacons of node 0 at random; node 0 hears of it from node 1."""
    patient = BeaconDiscovery(period_s=1.0, jitter=0.0, validity_periods=50, largest_gap=50)
    luck = np.random.default_rng(5).random(4000)
    net = Net(2, rule=lambda node, number: (node == 1 or luck[number] >= lost, True), kind="given", beacons=patient)
    shares = []
    for second in range(100, 2000, 10):
        net.run(second * S)
        shares += [prr for other, prr in known(net, 0) if other == 1]
    assert len(shares) == 190
    # the mean of some 1900 beacons heard or not, and the rounding of reports to 1/255
    tolerance = 4 * math.sqrt(lost * (1 - lost) / 1900) + 1 / 255
    assert sum(shares) / len(shares) == pytest.approx(1 - lost, abs=tolerance)


# --- the table alone ------------------------------------------------------------------------------------------------


def table(**settings):
    return NeighbourTable(BeaconDiscovery(**settings), 45 * S)


def heard(entries, node, *numbers):
    for number in numbers:
        entries.on_beacon(node, number, None, number * S)


def test_three_beacons_after_the_first_make_an_estimate_and_gaps_are_counted():
    links = table()
    heard(links, 1, 10, 11, 12)
    assert links.known[1].prr_in is None
    heard(links, 1, 13)
    assert links.known[1].prr_in == 1.0
    heard(links, 1, 17)  # 14 and 15 and 16 were missed: a window without any
    assert links.known[1].prr_in == pytest.approx(0.9)
    heard(links, 1, 18, 19)
    assert links.known[1].prr_in == pytest.approx(0.9 * 0.9 + 0.1)


def test_numbers_of_beacons_come_round():
    links = table()
    heard(links, 1, 65_534, 65_535, 0, 1)
    assert links.known[1].prr_in == 1.0


def test_after_a_long_gap_a_neighbour_is_estimated_from_scratch():
    links = table()
    heard(links, 1, 0, 1, 2, 3)
    heard(links, 1, 14)  # ten missed: still the same
    assert links.known[1].prr_in == pytest.approx(0.9**3)
    heard(links, 1, 26)  # eleven missed
    assert links.known[1].prr_in is None


def test_expected_transmissions_need_both_directions():
    links = table()
    heard(links, 1, 0, 1, 2, 3)
    assert links.costs(0.0) == {}
    links.on_report(1, 0.5)
    assert links.costs(0.0) == {1: 2.0}
    assert links.costs(0.6) == {}
    links.on_report(1, None)
    assert links.costs(0.0) == {}


def test_data_that_needs_many_attempts_makes_a_link_dear():
    links = table()
    heard(links, 1, 0, 1, 2, 3)
    links.on_report(1, 1.0)
    for _ in range(5):
        links.on_data(1, Delivery(True, "", 1))
    assert links.costs(0.0)[1] == pytest.approx(1.0)
    links.on_data(1, Delivery(True, "", 3))
    links.on_data(1, Delivery(True, "", 3))
    assert links.costs(0.0)[1] == pytest.approx(0.9 * 1.0 + 0.1 * 3.0)
    links.on_data(1, Delivery(False, "no_ack", 4))
    links.on_data(1, Delivery(False, "no_ack", 4))
    assert links.costs(0.0)[1] == pytest.approx(0.9 * 1.2 + 0.1 * 8.0)
    links.on_data(1, Delivery(False, "channel_busy", 0))
    links.on_data(7, Delivery(True, "", 1))


def test_the_table_is_bounded_and_a_bad_neighbour_gives_way():
    links = table(most_neighbours=2)
    heard(links, 1, 0, 1, 2, 3)
    heard(links, 2, 0, 1, 2, 3)
    assert not links.on_beacon(3, 1, None, 4 * S)
    for node in (1, 2):
        links.on_report(node, 1.0)
    links.known[2].etx = 6.6  # as if learned
    assert links.on_beacon(3, 2, None, 5 * S)
    assert sorted(links.known) == [1, 3]


def test_more_neighbours_than_a_beacon_holds_are_reported_in_turn():
    star = nx.star_graph(45)
    net = Net(star, kind="given", beacons=BeaconDiscovery(period_s=1.0, most_neighbours=60))
    net.run(25 * S)
    assert max(len(job.packet) for *_, job in net.frames) <= 116
    assert len(net.networks[0].discovered) == 45
    assert all(known(net, leaf) == [(0, 1.0)] for leaf in range(1, 46))


def test_a_beacon_that_the_mac_gives_up_is_counted():
    net = Net(2, kind="vector", beacons=PLAIN)
    for network in net.networks.values():
        network.port._mac.submit = lambda job: job.done(Delivery(False, "channel_busy", 0))
    net.run(3 * S)
    dropped = {(event.kind, event.reason, event.message_id) for event in net.of(MessageDropped)}
    assert dropped == {("beacon", "channel_busy", 0), ("route", "channel_busy", 0)}


def test_after_a_reboot_neighbours_are_found_again():
    net = Net(3, kind="vector", beacons=PLAIN)
    net.run(10 * S)
    net.networks[1].stop()
    assert known(net, 1) == []
    frames = len(net.frames)
    net.networks[1].start()
    net.run(10 * S + 500 * MS)
    assert known(net, 1) == []
    net.run(20 * S)
    assert known(net, 1) == [(0, 1.0), (2, 1.0)]
    mine = [t for t, node, job in net.frames[frames:] if node == 1 and job.kind == "beacon"]
    assert len(mine) in (9, 10, 11)  # the old life's timer is not running beside the new one
