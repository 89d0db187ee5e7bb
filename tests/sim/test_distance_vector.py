"""Routes that nodes find by telling each other: shortest in the end, without loops at any time, repaired after a death."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import Net, S

from netsim.sim.net.distance_vector import Word, is_feasible, is_newer
from netsim.sim.net.settings import BeaconDiscovery
from netsim.trace.events import BROADCAST, MessageDropped, RouteChange

BEACONS = BeaconDiscovery(period_s=1.0)


def connected(most=9):
    return st.tuples(st.integers(2, most), st.integers(0, 1000), st.floats(0.25, 0.9)).map(
        lambda values: nx.gnp_random_graph(values[0], values[2], seed=values[1])
    )


def hops_of(net):
    """(node, destination) -> next hop, for every route there is."""
    return {
        (node, destination): hop
        for node, destination in itertools.permutations(net.graph, 2)
        if node not in net.dead and (hop := net.vectors[node].next_hop(node, destination)) is not None
    }


def has_loop(hops, destination):
    follow = nx.DiGraph((node, hop) for (node, to), hop in hops.items() if to == destination)
    return not nx.is_directed_acyclic_graph(follow)


@given(connected(), st.integers(0, 100))
@settings(max_examples=25, deadline=None)
def test_without_losses_every_node_finds_shortest_paths(graph, seed):
    net = Net(graph, kind="vector", beacons=BEACONS, seed=seed)
    net.run(40 * S)
    distance = dict(nx.all_pairs_shortest_path_length(graph))
    hops = hops_of(net)
    assert set(hops) == {(a, b) for a in graph for b in distance[a] if a != b}
    for (node, destination), hop in hops.items():
        assert distance[hop][destination] == distance[node][destination] - 1


@given(connected(), st.integers(0, 100), st.floats(0.0, 0.5), st.data())
@settings(max_examples=25, deadline=None)
def test_there_is_never_a_loop_whatever_is_lost_and_whoever_dies(graph, seed, lost, data):
    luck = np.random.default_rng(seed).random((len(graph), 4000))
    net = Net(
        graph, rule=lambda node, number: (luck[node, number] >= lost, True), kind="vector", beacons=BEACONS, seed=seed
    )
    deaths = data.draw(st.dictionaries(st.integers(8, 25), st.sampled_from(sorted(graph)), max_size=2))
    for tick in range(1, 160):
        net.run(tick * S // 4)
        if tick % 4 == 0 and tick // 4 in deaths:
            net.kill(deaths[tick // 4])
        hops = hops_of(net)
        assert not any(has_loop(hops, destination) for destination in graph)


def test_a_route_is_repaired_when_a_node_on_it_dies():
    ring = nx.cycle_graph(6)
    net = Net(ring, kind="vector", beacons=BEACONS)
    net.run(30 * S)
    assert net.vectors[0].next_hop(0, 2) == 1
    net.kill(1)
    net.run(60 * S)
    assert net.vectors[0].next_hop(0, 2) == 5
    assert net.vectors[0].next_hop(0, 1) is None
    net.send(0, 2, b"the other way")
    net.run(61 * S)
    assert [(node, message.hops) for node, message in net.delivered] == [(2, 4)]
    changes = [
        (event.next_hop, event.cost) for event in net.of(RouteChange) if (event.node, event.destination) == (0, 2)
    ]
    assert changes[-1] == (5, 4.0)


def test_when_the_bridge_dies_messages_across_it_are_refused_with_a_reason():
    net = Net(5, kind="vector", beacons=BEACONS)
    net.run(40 * S)
    net.kill(2)
    early = net.send(0, 4, b"in time to be lost")
    net.run(80 * S)
    late = net.send(0, 4, b"too late")
    net.run(81 * S)
    assert early[0].acknowledged  # by the next hop, which could not know yet
    assert [(delivery.acknowledged, delivery.reason, delivery.attempts) for delivery in late] == [
        (False, "no_route", 0)
    ]
    assert [(event.node, event.reason) for event in net.of(MessageDropped)] == [(1, "no_ack"), (0, "no_route")]
    assert net.delivered == []
    lost = [event for event in net.of(RouteChange) if event.next_hop == BROADCAST]
    assert {(event.node, event.destination) for event in lost} >= {(0, 4), (0, 3), (1, 4), (3, 0), (4, 0)}


def test_a_node_that_comes_back_is_found_again():
    net = Net(4, kind="vector", beacons=BEACONS)
    net.run(30 * S)
    net.kill(2)
    net.run(60 * S)
    assert net.vectors[0].next_hop(0, 3) is None
    net.dead.clear()
    net.networks[2].start()
    net.run(90 * S)
    assert net.vectors[0].next_hop(0, 3) == 1
    assert net.vectors[3].next_hop(3, 0) == 2


def test_updates_are_frames_of_their_kind():
    net = Net(30, kind="vector", beacons=BEACONS)
    net.run(60 * S)
    updates = [job for *_, job in net.frames if job.kind == "route"]
    assert max(len(job.packet) for job in updates) <= 116
    assert {len(job.packet) % 6 for job in updates} == {1}
    assert net.vectors[0].next_hop(0, 29) == 1


@pytest.mark.parametrize(
    ("a", "b", "newer"), [(1, 0, True), (0, 1, False), (5, 5, False), (0, 65_535, True), (2, 60_000, True)]
)
def test_newer_numbers(a, b, newer):
    assert is_newer(a, b) is newer


@pytest.mark.parametrize(
    ("sequence", "distance", "feasible"),
    [(7, 299, True), (7, 300, False), (7, 500, False), (8, 9000, True), (6, 10, False)],
)
def test_the_feasibility_condition(sequence, distance, feasible):
    assert is_feasible(Word(sequence, distance, 0), (7, 300)) is feasible
    assert is_feasible(Word(sequence, distance, 0), None)
