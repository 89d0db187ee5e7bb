"""GPSR: planar graphs by local tests, and delivery on every connected unit-disk graph."""

import itertools
import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import Net, unit_disk

from netsim.api import Delivery
from netsim.sim.net.packet import Form, Packet
from netsim.sim.net.planar import as_sent, crossing, next_counterclockwise, planar_neighbours
from netsim.trace.events import MessageDropped

RULES = ("gabriel", "rng")


@st.composite
def fields_of_nodes(draw):
    """Positions of up to 40 nodes and a range at which many of the graphs are connected and have voids."""
    count = draw(st.integers(2, 40))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    side_m = draw(st.sampled_from([1.0, 100.0, 1000.0]))
    points = random.uniform(0, side_m, (count, 2))
    if draw(st.booleans()):  # a void in the middle, to be walked round
        radius = 0.35 * side_m
        offset = points - side_m / 2
        distance = np.hypot(*offset.T)[:, None] + 1e-9
        points = np.where(distance < radius, side_m / 2 + offset / distance * (radius + distance * 0.3), points)
    reach = side_m * draw(st.floats(1.0, 2.2)) / math.sqrt(count)
    return {node: (float(x), float(y)) for node, (x, y) in enumerate(points)}, reach


@st.composite
def lattices(draw):
    """Nodes on some points of a square lattice: ties, right angles, nodes on the line to the destination."""
    size = draw(st.integers(2, 6))
    points = draw(st.lists(st.tuples(st.integers(0, size), st.integers(0, size)), min_size=2, max_size=36, unique=True))
    return {node: (10.0 * x, 10.0 * y) for node, (x, y) in enumerate(points)}, draw(st.sampled_from([10.0, 14.2, 22.4]))


def planar_graph(positions_m, graph, rule):
    sent = {node: as_sent(there) for node, there in positions_m.items()}
    edges = nx.DiGraph()
    edges.add_nodes_from(graph)
    for node in graph:
        near = {other: sent[other] for other in graph[node]}
        edges.add_edges_from((node, other) for other in planar_neighbours(sent[node], near, rule))
    return sent, edges


@pytest.mark.parametrize("rule", RULES)
@given(st.one_of(fields_of_nodes(), lattices()))
@settings(max_examples=100, deadline=None)
def test_planar_subgraphs_are_planar_agreed_and_as_connected_as_the_graph(rule, field):
    positions_m, reach_m = field
    graph = unit_disk(positions_m, reach_m)
    sent, edges = planar_graph(positions_m, graph, rule)
    assert all(edges.has_edge(b, a) for a, b in edges.edges)
    assert [set(part) for part in nx.connected_components(edges.to_undirected())] == [
        set(part) for part in nx.connected_components(graph)
    ]
    for (a, b), (c, d) in itertools.combinations(edges.to_undirected().edges, 2):
        if len({a, b, c, d}) == 4:
            assert crossing(sent[a], sent[b], sent[c], sent[d]) is None


@given(fields_of_nodes())
@settings(max_examples=50, deadline=None)
def test_the_relative_neighbourhood_graph_is_part_of_the_gabriel_graph(field):
    positions_m, reach_m = field
    graph = unit_disk(positions_m, reach_m)
    gabriel, rng = (planar_graph(positions_m, graph, rule)[1] for rule in RULES)
    assert set(rng.edges) <= set(gabriel.edges)


@pytest.mark.parametrize("rule", RULES)
@given(st.one_of(fields_of_nodes(), lattices()), st.data())
@settings(max_examples=200, deadline=None)
def test_gpsr_delivers_wherever_there_is_a_way_and_says_so_where_there_is_none(rule, field, data):
    positions_m, reach_m = field
    graph = unit_disk(positions_m, reach_m)
    source, destination = data.draw(
        st.lists(st.sampled_from(sorted(graph)), min_size=2, max_size=2, unique=True), label="pair"
    )
    net = Net(graph, kind="geographic", positions_m=positions_m, planarisation=rule)
    net.send(source, destination, b"there")
    net.run()
    if nx.has_path(graph, source, destination):
        assert [(node, message.payload) for node, message in net.delivered] == [(destination, b"there")]
    else:
        assert net.delivered == []
        assert [event.reason for event in net.of(MessageDropped)] == ["no_route"]


def test_greedy_takes_the_neighbour_nearest_to_the_destination():
    positions_m = {0: (0.0, 0.0), 1: (4.0, 3.0), 2: (5.0, 0.0), 3: (10.0, 0.0), 4: (-5.0, 0.0)}
    net = Net(unit_disk(positions_m, 6.0), kind="geographic", positions_m=positions_m)
    fate = net.send(0, 3, b"x")
    net.run()
    assert [(node, job.destination) for _, node, job in net.frames] == [(0, 2), (2, 3)]
    assert fate == [Delivery(True, "", 1)]
    packets = [Packet.decode(job.packet) for _, _, job in net.frames]
    assert [packet.form for packet in packets] == [Form.GEOGRAPHIC] * 2
    assert [len(packet.fields) for packet in packets] == [9, 9]


def test_a_void_is_walked_round_by_the_right_hand_rule():
    """0 is a dead end towards 5. Perimeter: first edge counterclockwise from the line to the destination is that to 1."""
    positions_m = {0: (0.0, 0.0), 1: (-1.0, 4.0), 2: (4.0, 6.0), 3: (9.0, 4.0), 5: (12.0, 0.0), 6: (-1.0, -4.0)}
    graph = nx.Graph([(0, 1), (1, 2), (2, 3), (3, 5), (0, 6)])
    net = Net(graph, kind="geographic", positions_m=positions_m)
    net.send(0, 5, b"x")
    net.run()
    assert [job.destination for _, _, job in net.frames] == [1, 2, 3, 5]
    sizes = [len(Packet.decode(job.packet).fields) for _, _, job in net.frames]
    assert sizes == [29, 29, 9, 9]  # at 2, sqrt(8^2 + 6^2) = 10 from the destination, it is nearer than at 0
    assert [message.hops for _, message in net.delivered] == [4]


def test_the_right_hand_rule_goes_back_only_from_a_dead_end():
    near = {1: (1.0, 0.0), 2: (0.0, 1.0), 3: (-1.0, 0.0)}
    assert next_counterclockwise((0.0, 0.0), 0.0, near, 1) == 2
    assert next_counterclockwise((0.0, 0.0), math.pi / 2, near, 2) == 3
    assert next_counterclockwise((0.0, 0.0), math.pi, near, 3) == 1
    assert next_counterclockwise((0.0, 0.0), 0.0, {1: (1.0, 0.0)}, 1) == 1
    assert next_counterclockwise((0.0, 0.0), 0.0, {}, None) is None


def test_long_messages_go_by_position_too():
    positions_m = {node: (10.0 * node, 0.0) for node in range(4)}
    net = Net(4, kind="geographic", positions_m=positions_m)
    payload = bytes(range(256)) * 3
    net.send(0, 3, payload)
    net.run()
    assert [message.payload for _, message in net.delivered] == [payload]
    assert max(len(job.packet) for _, _, job in net.frames) <= 116
