"""The network layer over links given by rules, and over real ones: fragments, hops, and what cannot be delivered."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import MS, PACKET_BYTE, Net
from scenarios_for_tests import run, small

from netsim.api import Delivery, Neighbour
from netsim.errors import AlgorithmError
from netsim.sim.net.packet import HEADER_BYTE, KindTable
from netsim.sim.net.routes import OneHop, ShortestPathParameters, ShortestPaths
from netsim.trace.events import BROADCAST, Frame, MessageDelivered, MessageDropped, MessageSent

CHUNK_BYTE = PACKET_BYTE - HEADER_BYTE


@settings(max_examples=200, deadline=None)
@given(
    st.integers(0, 3000),
    st.integers(2, 4),
    st.lists(st.sampled_from([(True, True), (False, False), (True, False)]), max_size=60),
    st.floats(0.0, 1.0),
)
def test_a_message_arrives_whole_or_not_at_all_and_at_most_once(size_byte, nodes, fates, lossy):
    """Each frame arrives or not, and so does its acknowledgement; one that was not acknowledged may have arrived."""

    def rule(node, number):
        index = node * 7 + number
        return fates[index % len(fates)] if fates and index < lossy * 60 else (True, True)

    payload = bytes(index * 31 % 251 for index in range(size_byte))
    net = Net(nodes, rule)
    fate = net.send(0, nodes - 1, payload)
    net.run()
    assert len(fate) == 1
    assert len(net.delivered) <= 1
    for node, message in net.delivered:
        assert (node, message.payload, message.hops, message.source) == (nodes - 1, payload, nodes - 1, 0)
    assert net.delivered or net.of(MessageDropped)
    assert len(net.of(MessageDelivered)) == len(net.delivered)


@given(st.integers(0, 3000))
@settings(max_examples=50, deadline=None)
def test_without_losses_everything_arrives_in_as_few_fragments_as_hold_it(size_byte):
    net = Net(3)
    payload = bytes(index * 17 % 253 for index in range(size_byte))
    fate = net.send(0, 2, payload)
    net.run()
    assert [(node, message.payload) for node, message in net.delivered] == [(2, payload)]
    (sent,) = net.of(MessageSent)
    assert sent.fragments == max(1, -(-size_byte // CHUNK_BYTE))
    assert fate == [Delivery(True, "", sent.fragments)]
    assert net.of(MessageDropped) == []


def test_after_a_lost_fragment_the_rest_is_not_sent():
    net = Net(2, lambda node, number: (number != 1, number != 1))
    fate = net.send(0, 1, bytes(1000))
    net.run()
    assert fate == [Delivery(False, "no_ack", 5)]
    assert [event.reason for event in net.of(MessageDropped)] == ["no_ack", "reassembly_timeout"]
    assert net.delivered == []


def test_a_line_of_nodes_forwards_and_counts_hops_and_time():
    net = Net(6)
    net.send(0, 5, b"far")
    net.send(4, 1, b"back")
    net.run()
    assert sorted((event.node, event.hops, event.latency_ns) for event in net.of(MessageDelivered)) == [
        (1, 3, 3 * MS),
        (5, 5, 5 * MS),
    ]


def test_a_broadcast_goes_one_hop():
    net = Net(5)
    net.send(2, BROADCAST, b"hear")
    net.run()
    assert sorted(node for node, _ in net.delivered) == [1, 3]


def test_without_a_way_a_message_is_dropped_at_once():
    links = {0: [Neighbour(1, 1.0, 1.0)], 1: [Neighbour(0, 1.0, 1.0)], 2: [], 3: []}
    net = Net(4, routes=ShortestPaths(links, ShortestPathParameters()))
    fate = net.send(0, 3, b"lost")
    assert fate == [Delivery(False, "no_route", 0)]
    assert [(event.node, event.reason) for event in net.of(MessageDropped)] == [(0, "no_route")]


def test_a_message_that_stays_incomplete_is_given_up():
    net = Net(2, lambda node, number: (number != 1, number != 1))
    net.send(0, 1, bytes(1000))
    net.run()
    assert [
        (time_ns, event.node, event.reason) for time_ns, event in net.events if isinstance(event, MessageDropped)
    ] == [
        (2 * MS, 0, "no_ack"),
        (MS + 30_000 * MS, 1, "reassembly_timeout"),
    ]
    assert net.delivered == []


def test_interleaved_messages_do_not_mix():
    net = Net(3)
    payloads = [bytes([number]) * 500 for number in range(4)]
    for number, payload in enumerate(payloads):
        net.send(number % 2, 2, payload, kind=f"k{number}")
    net.run()
    assert sorted((message.kind, message.payload) for _, message in net.delivered) == [
        (f"k{number}", payload) for number, payload in enumerate(payloads)
    ]


def test_a_run_tells_256_kinds_apart():
    kinds = KindTable()
    assert [kinds.code(f"k{number}") for number in range(256)] == list(range(256))
    assert kinds.name(kinds.code("k17")) == "k17"
    with pytest.raises(AlgorithmError, match="257th"):
        kinds.code("one more")


# --- routes ---------------------------------------------------------------------------------------------------------


def links(*rows):
    """From (a, b, prr there, prr back) to neighbours."""
    found = {}
    for a, b, there, back in rows:
        found.setdefault(a, []).append(Neighbour(b, 1.0, there))
        found.setdefault(b, []).append(Neighbour(a, 1.0, back))
    return found


def test_two_good_hops_beat_one_bad_by_etx_but_not_by_hops():
    # direct: 1 / (0.6 x 0.7) = 2.38; by way of 1: 2 / (0.95 x 0.95) = 2.22
    square = links((0, 2, 0.6, 0.7), (0, 1, 0.95, 0.95), (1, 2, 0.95, 0.95))
    assert ShortestPaths(square, ShortestPathParameters(metric="etx")).next_hop(0, 2) == 1
    assert ShortestPaths(square, ShortestPathParameters(metric="hop")).next_hop(0, 2) == 2


def test_links_that_are_bad_in_one_direction_are_not_used_and_ties_go_to_the_lowest_id():
    assert ShortestPaths(links((0, 1, 0.9, 0.4)), ShortestPathParameters()).next_hop(0, 1) is None
    ring = links((0, 1, 1.0, 1.0), (0, 2, 1.0, 1.0), (1, 3, 1.0, 1.0), (2, 3, 1.0, 1.0))
    assert ShortestPaths(ring, ShortestPathParameters()).next_hop(0, 3) == 1
    assert ShortestPaths(ring, ShortestPathParameters()).next_hop(3, 0) == 1


def test_one_hop_goes_straight():
    assert OneHop().next_hop(0, 7) == 7


# --- over a real air ------------------------------------------------------------------------------------------------


def test_messages_cross_a_grid_whole_and_once(tmp_path):
    """Nodes 22 m apart reach their neighbours only: what goes further is forwarded."""
    loaded = small(
        tmp_path,
        spacing_m=22,
        medium="{type: log-distance, exponent: 3.5, shadowing_sd_db: 0}",
        algorithm='{type: "sim_algorithms:Across"}',
        detail="frames",
    )
    events, _ = run(loaded)
    sent = {event.message_id: event for _, event in events if isinstance(event, MessageSent)}
    delivered = [event for _, event in events if isinstance(event, MessageDelivered)]
    assert len(delivered) > 0.8 * len(sent)
    assert max(Counter((event.message_id, event.node) for event in delivered).values()) == 1
    assert all(sent[event.message_id].size_byte == event.size_byte for event in delivered)
    assert max(event.hops for event in delivered) >= 2
    assert {frame.source for _, frame in events if isinstance(frame, Frame)} == set(range(9))
