"""Floods, geocasts and multicasts: whom they reach, what they cost, and that everybody speaks once."""

import math
from collections import Counter

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import MS, PACKET_BYTE, Net, unit_disk

from netsim.api import Circle, Delivery, Polygon, Rectangle
from netsim.errors import AlgorithmError
from netsim.sim.net.packet import HEADER_BYTE, Form, Packet
from netsim.sim.net.regions import contains, encode_region
from netsim.sim.net.settings import NetworkSettings
from netsim.testing import run_algorithm
from netsim.trace.events import BROADCAST, MessageDropped, MessageSent


def graphs(most=12):
    """Connected or not, up to so many nodes."""
    return st.tuples(st.integers(2, most), st.integers(0, 1000), st.floats(0.1, 0.8)).map(
        lambda values: nx.gnp_random_graph(values[0], values[2], seed=values[1])
    )


@given(graphs(), st.integers(1, 6), st.integers(0, 300), st.sampled_from(["given", "geographic"]))
@settings(max_examples=150, deadline=None)
def test_a_flood_reaches_everybody_within_its_limit_once_and_everybody_forwards_once(graph, limit, size_byte, kind):
    net = Net(graph, kind=kind)
    fate = []
    net.networks[0].flood(limit, "news", bytes(size_byte), (), fate.append)
    net.run()
    hops = nx.single_source_shortest_path_length(graph, 0)
    reached = {node for node, count in hops.items() if 0 < count <= limit}
    # whoever hears it first by a longer way passes on fewer hops: with random delays some at the rim may be missed
    got = Counter(node for node, _ in net.delivered)
    assert set(got) <= reached
    assert {node for node in reached if hops[node] == 1} <= set(got)
    assert set(got.values()) <= {1}
    frames = Counter((node, Packet.decode(job.packet).index) for _, node, job in net.frames)
    assert set(frames.values()) == {1}
    assert all(message.payload == bytes(size_byte) and message.source == 0 for _, message in net.delivered)
    assert len(fate) == 1


@given(graphs())
@settings(max_examples=50, deadline=None)
def test_a_flood_with_hops_to_spare_reaches_all_that_are_connected(graph):
    net = Net(graph)
    net.networks[0].flood(16, "news", b"all", (), lambda delivery: None)
    net.run()
    assert {node for node, _ in net.delivered} == nx.node_connected_component(graph, 0) - {0}
    assert len(net.frames) == len(nx.node_connected_component(graph, 0))


def test_floods_are_passed_on_after_a_random_time():
    net = Net(nx.star_graph(6), settings=NetworkSettings(forward_delay_s=0.02))
    net.networks[0].flood(2, "news", b"", (), lambda delivery: None)
    net.run()
    starts = [time_ns for time_ns, node, _ in net.frames if node]
    assert len(set(starts)) == 6
    assert all(MS <= time_ns < 21 * MS for time_ns in starts)


def test_a_full_waiting_room_is_counted():
    net = Net(3, settings=NetworkSettings(waiting_packets=2))
    for _ in range(4):
        net.networks[0].flood(3, "news", b"", (), lambda delivery: None)
    net.run()
    assert len([node for node, _ in net.delivered if node == 1]) == 4
    assert [event.reason for event in net.of(MessageDropped)] == ["queue_full"] * 2
    assert len([node for node, _ in net.delivered if node == 2]) == 2


REGIONS = st.one_of(
    st.builds(Circle, st.tuples(st.floats(10, 90), st.floats(10, 90)), st.floats(5, 60)),
    st.builds(
        lambda x, y, w, h: Rectangle((x, y), (x + w, y + h)),
        st.floats(0, 60),
        st.floats(0, 60),
        st.floats(5, 40),
        st.floats(5, 40),
    ),
    st.builds(
        lambda x, y, r: Polygon(((x - r, y - r), (x + r, y - r), (x, y + r))),
        st.floats(20, 80),
        st.floats(20, 80),
        st.floats(5, 40),
    ),
)


@given(st.integers(0, 2**32 - 1), REGIONS, st.sampled_from(["given", "geographic"]))
@settings(max_examples=150, deadline=None)
def test_a_geocast_reaches_only_the_region_each_node_once(seed, region, kind):
    points = np.random.default_rng(seed).uniform(0, 100, (40, 2))
    positions_m = {node: (float(x), float(y)) for node, (x, y) in enumerate(points)}
    graph = unit_disk(positions_m, 25.0)
    net = Net(graph, kind=kind, positions_m=positions_m)
    net.networks[0].geocast(region, "alarm", bytes(120), (), lambda delivery: None)
    net.run()
    inside = {node for node, there in positions_m.items() if contains(region, there)}
    got = Counter(node for node, _ in net.delivered)
    assert set(got) <= inside - {0}
    assert set(got.values()) <= {1}
    if got or 0 in inside:  # it came in somewhere: all that hang together inside have it
        entry = 0 if 0 in inside else next(iter(got))
        assert set(got) == nx.node_connected_component(graph.subgraph(inside), entry) - {0}
    flooders = {node for _, node, job in net.frames if Packet.decode(job.packet).form == Form.GEOCAST}
    assert flooders <= inside


@pytest.mark.parametrize("kind", ["given", "geographic"])
def test_in_its_region_a_geocast_has_the_whole_frame_but_for_its_header(kind):
    """A message in two frames is lost where one of them is: routing by position, which is over, takes no room."""
    net = Net(nx.path_graph(3), kind=kind)
    region = Circle((0.0, 0.0), 1000.0)
    room_byte = PACKET_BYTE - HEADER_BYTE - len(encode_region(region))
    for size_byte in (room_byte, room_byte + 1):
        net.networks[0].geocast(region, "alarm", bytes(size_byte), (), lambda delivery: None)
    assert [event.fragments for event in net.of(MessageSent)] == [1, 2]


def test_a_geocast_to_where_nobody_is_ends():
    positions_m = {node: (10.0 * node, 0.0) for node in range(4)}
    net = Net(4, positions_m=positions_m)
    net.networks[0].geocast(Circle((500.0, 500.0), 5.0), "alarm", b"", (), lambda delivery: None)
    net.run()
    assert net.delivered == []
    assert [event.reason for event in net.of(MessageDropped)] == ["no_route"]


def test_one_transmission_serves_several_neighbours_and_says_whom():
    net = Net(nx.star_graph(5))
    net.networks[0].multicast([1, 3, 4], "word", b"abc", (), lambda delivery: None)
    net.run()
    ((_, node, job),) = net.frames
    assert (node, job.destination, len(job.packet)) == (0, BROADCAST, 12 + 1 + 3 * 2 + 3)
    assert [(node, message.destination) for node, message in net.delivered] == [(1, 1), (3, 3), (4, 4)]


# --- through the handle ---------------------------------------------------------------------------------------------


class Speaker:
    """Node 0 does something; the others listen."""

    def __init__(self, speak):
        self._speak = speak

    def run(self, node):
        if node.id == 0:
            yield from self._speak(node)
        while (yield from node.receive(timeout_ns=10 * MS)) is not None:
            pass


def of(speak, **settings):
    return run_algorithm(Speaker, parameters=speak, **settings)


def test_multicast_of_a_handle_shares_where_it_can():
    def speak(node):
        tickets = node.multicast([3, 1, 2, 4], "word", b"x")
        assert list(tickets) == [1, 2, 3, 4]
        assert tickets[1] is tickets[2]
        assert len({ticket.message_id for ticket in tickets.values()}) == 3
        assert node.multicast([], "word", b"x") == {}
        assert list(node.multicast([2], "word", b"y")) == [2]
        delivery = yield from tickets[4].wait()
        assert delivery.acknowledged

    near = nx.Graph([(0, 1), (0, 2), (2, 3), (3, 4)])
    run = of(speak, nodes=5, neighbours=near.adj).require_success()
    assert {node: [m.payload for m in got] for node, got in run.delivered.items() if got} == {
        1: [b"x"],
        2: [b"x", b"y"],
        3: [b"x"],
        4: [b"x"],
    }
    assert [event.destination for _, event in run.of(MessageSent)] == [BROADCAST, 3, 4, 2]
    assert {m.destination for got in run.delivered.values() for m in got} == {1, 2, 3, 4}


def test_flood_geocast_and_sink_of_a_handle():
    def speak(node):
        node.flood("news", b"f", hop_limit=2)
        node.geocast(Circle((3.0, 0.0), 1.0), "alarm", b"g")
        yield from node.pause(MS)

    run = of(speak, nodes=6, neighbours=nx.path_graph(6).adj).require_success()
    assert [(node, m.kind, m.hops) for node, got in run.delivered.items() for m in got] == [
        (1, "news", 1),
        (2, "news", 2),
        (2, "alarm", 2),
        (3, "alarm", 3),
        (4, "alarm", 4),
    ]


def nothing(node, act):
    act(node)
    yield from node.pause(1)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda node: node.flood("news", b"", hop_limit=0), "1 to 255 hops"),
        (lambda node: node.geocast((1, 2), "news", b""), "a region is a Circle"),
        (lambda node: node.geocast(Polygon(((0.0, 0.0), (1.0, 1.0))), "news", b""), "3 to 8"),
        (lambda node: node.geocast(Circle((0.0, math.nan), 1.0), "news", b""), "finite"),
        (lambda node: node.geocast(Circle((0.0, 0.0), math.inf), "news", b""), "finite"),
        (lambda node: node.geocast(Circle((0.0, 0.0), -1.0), "news", b""), "radius -1 m"),
        (lambda node: node.broadcast("", b""), "without a kind"),
        (lambda node: node.multicast([1, 7], "news", b""), "does not exist"),
        (lambda node: node.multicast([0], "news", b""), "to itself"),
        (lambda node: node.flood("news", "text"), "not bytes"),
        (lambda node: node.send_to_sink("news", b""), "it is there already"),
    ],
)
def test_misuse_is_told(act, message):
    with pytest.raises(AlgorithmError, match=message):
        of(lambda node: nothing(node, act)).require_success()


def test_delivery_of_what_finds_no_way_is_stated():
    net = Net(nx.empty_graph(2))
    assert net.send(0, 1, b"") == [Delivery(False, "no_route", 0)]
