"""The bytes of packets, beacons and regions: they survive their encoding, and no other bytes make anything raise."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import PACKET_BYTE, Net

from netsim.api import Circle, Polygon, Rectangle
from netsim.sim.net.beacons import decode_beacon, encode_beacon
from netsim.sim.net.geographic import Course
from netsim.sim.net.packet import HEADER_BYTE, Form, Packet, decode_ids, encode_ids
from netsim.sim.net.regions import contains, decode_region, encode_region, region_byte
from netsim.sim.net.settings import BeaconDiscovery
from netsim.trace.events import BROADCAST, MessageDropped

METRE = st.floats(-1000, 1000, width=32)
POINT = st.tuples(METRE, METRE)
NODE = st.integers(0, 65534)
REGIONS = st.one_of(
    st.builds(Circle, POINT, st.floats(0, 1000, width=32)),
    st.builds(Rectangle, POINT, POINT),
    st.builds(Polygon, st.lists(POINT, min_size=3, max_size=8).map(tuple)),
)
COURSES = st.one_of(st.builds(Course, POINT), st.builds(Course, POINT, POINT, POINT, st.tuples(NODE, NODE)))
FIELDS = st.one_of(
    st.just((Form.DATA, b"")),
    st.integers(1, 255).map(lambda limit: (Form.FLOOD, bytes([limit]))),
    COURSES.map(lambda course: (Form.GEOGRAPHIC, course.encode())),
    st.binary(min_size=2, max_size=2).map(lambda cost: (Form.COLLECT, cost)),
    st.tuples(REGIONS, COURSES).map(lambda pair: (Form.GEOCAST_WAY, encode_region(pair[0]) + pair[1].encode())),
    REGIONS.map(lambda region: (Form.GEOCAST, encode_region(region))),
    st.lists(NODE, max_size=24).map(lambda nodes: (Form.MULTICAST, encode_ids(nodes))),
)


@st.composite
def packets(draw):
    form, fields = draw(FIELDS)
    count = draw(st.integers(1, 16383))
    return Packet(
        origin=draw(NODE),
        destination=draw(st.one_of(NODE, st.just(BROADCAST))),
        sequence=draw(st.integers(0, 65535)),
        kind_code=draw(st.integers(0, 255)),
        hops=draw(st.integers(0, 255)),
        index=draw(st.integers(0, count - 1)),
        count=count,
        chunk=draw(st.binary(max_size=104)),
        form=form,
        fields=fields,
    )


@given(packets())
def test_packets_survive_their_encoding(packet):
    data = packet.encode()
    assert Packet.decode(data) == packet
    assert len(data) == HEADER_BYTE + len(packet.fields) + len(packet.chunk)
    assert data[0] >> 4 == packet.form


def test_plain_data_costs_twelve_bytes_and_geographic_data_nine_more_or_twenty_nine():
    assert HEADER_BYTE == 12
    assert len(Course((1.0, 2.0)).encode()) == 9
    assert len(Course((1.0, 2.0), (0.0, 0.0), (0.0, 0.0), (1, 2)).encode()) == 29


@given(st.lists(NODE, max_size=24))
def test_lists_of_nodes_survive_their_encoding(nodes):
    assert decode_ids(encode_ids(nodes)) == tuple(nodes)


@given(REGIONS, st.binary(max_size=20))
def test_regions_survive_their_encoding_and_know_their_size(region, rest):
    data = encode_region(region)
    assert region_byte(data + rest) == len(data)
    assert decode_region(data + rest) == region


@pytest.mark.parametrize(
    ("region", "inside", "outside"),
    [
        (Circle((1.0, 2.0), 5.0), [(1, 2), (4, 6), (6, 2)], [(5, 6), (6.1, 2)]),
        (Rectangle((0.0, 0.0), (3.0, 2.0)), [(0, 0), (3, 2), (1, 1)], [(3.1, 1), (-0.1, 0)]),
        # an L: the notch at the upper right is outside
        (
            Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0))),
            [(1, 1), (3, 1), (1, 3)],
            [(3, 3)],
        ),
    ],
)
def test_what_lies_in_a_region(region, inside, outside):
    assert all(contains(region, point) for point in inside)
    assert not any(contains(region, point) for point in outside)


BEACONS = st.tuples(
    st.integers(0, 65535),
    st.one_of(st.none(), POINT),
    st.binary(max_size=32),
    st.dictionaries(NODE, st.integers(0, 255).map(lambda share: share / 255), max_size=20),
    st.booleans(),
)


@given(BEACONS)
def test_beacons_survive_their_encoding(beacon):
    number, position_m, advert, shares, complete = beacon
    assert decode_beacon(encode_beacon(number, position_m, advert, list(shares.items()), complete)) == beacon


def everything():
    """Network layers of every kind, each with neighbours and a message under way."""
    beacons = BeaconDiscovery(period_s=0.2)
    nets = [Net(3), Net(3, kind="geographic")]
    nets += [Net(3, kind=kind, beacons=beacons, sinks=(0,)) for kind in ("vector", "collection", "geographic")]
    for net in nets:
        net.send(0, 1, bytes(500))
        net.run(2_000_000_000)
    return nets


@given(data=st.binary(max_size=130), form=st.integers(0, 15))
@settings(max_examples=300, deadline=None)
def test_whatever_bytes_arrive_nothing_raises(everything_once, data, form):
    for altered in (data, bytes([form << 4 | (data[0] & 15 if data else 0)]) + data[1:]):
        for net in everything_once:
            net.networks[1].on_packet(altered, 0)
            net.run(net.clock.now_ns + 50_000_000)


@given(packets(), st.integers(0, 1039), st.integers(0, 1039))
@settings(max_examples=300, deadline=None)
def test_packets_with_flipped_bits_never_raise(everything_once, packet, first, second):
    data = bytearray(packet.encode()[:PACKET_BYTE])
    for bit in (first, second):
        data[bit // 8 % len(data)] ^= 1 << bit % 8
    for net in everything_once:
        net.networks[1].on_packet(bytes(data), 0)
        net.run(net.clock.now_ns + 50_000_000)


@pytest.fixture(scope="module")
def everything_once():
    return everything()


def test_what_makes_no_sense_is_dropped_and_counted():
    net = Net(2)
    for data in (b"", b"abc", bytes([0xF0]) + bytes(20), bytes([Form.BEACON << 4]) + bytes(3), bytes(12)):
        net.networks[1].on_packet(data, 0)
    dropped = net.of(MessageDropped)
    assert [(event.reason, event.message_id, event.source, event.node) for event in dropped] == [
        ("malformed", 0, 0, 1)
    ] * 5
