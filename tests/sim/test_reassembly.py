"""Once or not at all, and byte-equal, whatever becomes of packets; time-outs at their time; bounds; numbers coming round."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import MS, PACKET_BYTE, Net, S

from netsim.api import Delivery
from netsim.sim.clock import Clock
from netsim.sim.net.packet import HEADER_BYTE, Packet
from netsim.sim.net.reassembly import Reassembly, Recent, SequenceNumbers
from netsim.sim.net.settings import BeaconDiscovery, NetworkSettings
from netsim.trace.events import MessageDelivered, MessageDropped, MessageSent

CHUNK_BYTE = PACKET_BYTE - HEADER_BYTE

# What becomes of a received packet: the delays of its copies in ms; none of them after the memory has faded.
VERDICTS = st.lists(st.sampled_from([0, 1, 3, 7, 50, 900, 20_000, 29_999, 31_000]), max_size=3)


@given(
    sizes=st.lists(st.integers(0, 1200), min_size=1, max_size=6),
    verdicts=st.lists(VERDICTS, min_size=1, max_size=40),
    nodes=st.integers(2, 4),
    retries=st.integers(0, 2),
)
@settings(max_examples=400, deadline=None)
def test_under_any_loss_reordering_and_duplication_a_message_comes_once_or_not_at_all(sizes, verdicts, nodes, retries):
    net = Net(nodes, settings=NetworkSettings(retries=retries))
    count = [0]

    def rules(data, neighbour):
        verdict = verdicts[count[0] % len(verdicts)]
        count[0] += 1
        return [(delay * MS, data) for delay in verdict]

    for network in net.networks.values():
        network.filter = rules
    payloads = [bytes((index * 31 + number) % 251 for index in range(size)) for number, size in enumerate(sizes)]
    for number, payload in enumerate(payloads):
        source, destination = (0, nodes - 1) if number % 2 else (nodes - 1, 0)
        net.send(source, destination, payload, kind=f"k{number}")
    net.run()
    got = [(message.kind, message.payload) for _, message in net.delivered]
    assert len({kind for kind, _ in got}) == len(got)
    assert all(payload == payloads[int(kind[1:])] for kind, payload in got)
    assert len(net.of(MessageDelivered)) == len(got)
    assert all(network.pending == 0 for network in net.networks.values())


@given(
    kind=st.sampled_from(["vector", "collection", "geographic"]),
    sizes=st.lists(st.integers(0, 500), min_size=1, max_size=4),
    seed=st.integers(0, 1000),
    lost=st.floats(0.0, 0.3),
    unacknowledged=st.floats(0.0, 0.5),
    spread=st.integers(0, 40),
)
@settings(max_examples=60, deadline=None)
def test_second_tries_by_other_ways_bring_nothing_twice(kind, sizes, seed, lost, unacknowledged, spread):
    """Packets and acknowledgements are lost, what was not acknowledged is routed anew, and copies overtake each other."""
    random = np.random.default_rng(seed)
    fate = random.random((6, 4000, 2))
    graph = nx.Graph([(0, 1), (0, 2), (1, 3), (2, 3), (1, 4), (3, 5), (4, 5)])
    positions_m = {0: (0.0, 0.0), 1: (1.0, 1.0), 2: (1.0, -1.0), 3: (2.0, 0.0), 4: (2.0, 2.0), 5: (3.0, 1.0)}

    def rule(node, number):
        arrives, acknowledged = fate[node, number] > (lost, unacknowledged)
        return bool(arrives), bool(arrives and acknowledged)

    net = Net(
        graph,
        rule,
        kind=kind,
        positions_m=positions_m,
        sinks=(0,),
        settings=NetworkSettings(retries=5, hop_limit=64),
        beacons=BeaconDiscovery(period_s=1.0),
        seed=seed,
    )
    net.run(15 * S)
    for network in net.networks.values():
        network.filter = lambda data, _: [(int(random.random() * spread) * MS, data)]
    payloads = [bytes((index * 31 + number) % 251 for index in range(size)) for number, size in enumerate(sizes)]
    for number, payload in enumerate(payloads):
        net.send(5, 0, payload, kind=f"k{number}")
    net.run(60 * S)
    got = [(message.kind, message.payload) for _, message in net.delivered]
    assert len({kind for kind, _ in got}) == len(got)
    assert all(payload == payloads[int(kind[1:])] for kind, payload in got)
    dropped = {event.message_id for event in net.of(MessageDropped)}
    for event in net.of(MessageSent):  # what did not arrive was given up somewhere, with a reason
        assert event.message_id in dropped or event.kind in {kind for kind, _ in got}


def test_what_passes_unharmed_is_delivered_and_copies_are_not():
    net = Net(2)
    net.networks[1].filter = lambda data, _: [(0, data), (0, data), (5 * S, data), (29 * S, data)]
    net.send(0, 1, bytes(range(250)))
    net.send(0, 1, b"short")
    net.run()
    assert sorted(message.payload for _, message in net.delivered) == [bytes(range(250)), b"short"]
    assert net.of(MessageDropped) == []


def test_fragments_in_reverse_order_are_put_together():
    net = Net(2)
    net.networks[1].filter = lambda data, _: [((10 - Packet.decode(data).index) * 10 * MS, data)]
    payload = bytes(index % 253 for index in range(1000))
    net.send(0, 1, payload)
    net.run()
    assert [message.payload for _, message in net.delivered] == [payload]


def fragment(sequence, index, count, chunk=b"x", origin=1, kind_code=0):
    return Packet(origin, 0, sequence, kind_code, 1, index, count, chunk)


class Bench:
    """A reassembly of its own, with what it gave up."""

    def __init__(self, timeout_ns=1000, most=2, lifetime_ns=5000):
        self.clock, self.given_up = Clock(), []
        self.parts = Reassembly(
            self.clock,
            timeout_ns,
            most,
            lifetime_ns,
            lambda packet, reason: self.given_up.append((self.clock.now_ns, packet.sequence, reason)),
        )

    def at(self, time_ns, packet):
        results = []
        self.clock.call_after(time_ns - self.clock.now_ns, lambda _: results.append(self.parts.add(packet)))
        return results


def test_the_time_out_falls_exactly_so_long_after_the_first_fragment():
    bench = Bench()
    bench.at(100, fragment(1, 0, 3))
    bench.at(900, fragment(1, 1, 3))
    bench.clock.environment.run()
    assert bench.given_up == [(1100, 1, "reassembly_timeout")]
    assert bench.parts.incomplete == 0


@pytest.mark.parametrize("early", [True, False])
def test_a_fragment_at_the_very_instant_of_the_time_out_still_counts(early):
    """Whichever of the two was asked for first."""
    bench = Bench()
    last = [bench.at(1000, fragment(1, 1, 2, b"b"))] if early else []
    bench.parts.add(fragment(1, 0, 2, b"a"))
    if not early:
        last.append(bench.at(1000, fragment(1, 1, 2, b"b")))
    bench.clock.environment.run()
    assert last == [[b"ab"]]
    assert bench.given_up == []


def test_there_is_room_for_so_many_incomplete_messages():
    bench = Bench(most=2)
    assert [bench.parts.add(fragment(number, 0, 2)) for number in (1, 2, 3)] == [None, None, None]
    assert bench.given_up == [(0, 3, "reassembly_full")]
    assert bench.parts.add(fragment(4, 0, 1, b"whole")) == b"whole"  # what is whole needs no room
    assert bench.parts.add(fragment(1, 1, 2)) == b"xx"
    assert bench.parts.add(fragment(3, 0, 2)) is None
    assert bench.parts.incomplete == 2


def test_fragments_that_contradict_each_other_are_dropped():
    bench = Bench()
    bench.parts.add(fragment(1, 0, 2, b"a"))
    bench.parts.add(fragment(1, 1, 3, b"?"))
    bench.parts.add(fragment(1, 1, 2, b"?", kind_code=7))
    assert bench.parts.add(fragment(1, 0, 2, b"other")) is None
    assert bench.parts.add(fragment(1, 1, 2, b"b")) == b"ab"
    assert [reason for *_, reason in bench.given_up] == ["malformed", "malformed"]


def test_keys_are_forgotten_after_their_time_or_when_there_are_too_many():
    recent = Recent(lifetime_ns=100, most=3)
    assert recent.add("a", 0)
    assert not recent.add("a", 99)
    assert recent.add("a", 100)
    assert [recent.add(key, 101) for key in "bcd"] == [True] * 3
    assert not recent.has("a", 101)
    assert recent.has("b", 101)


def test_numbers_come_round_and_none_is_used_again_too_soon():
    numbers = SequenceNumbers(lifetime_ns=60 * S)
    slowly = [numbers.next(number * MS) for number in range(70_000)]
    assert slowly == [(number + 1) % 0x10000 for number in range(70_000)]
    numbers = SequenceNumbers(lifetime_ns=60 * S)
    fast = [numbers.next(number) for number in range(70_000)]
    assert fast[:65_535] == list(range(1, 65_536))
    assert set(fast[65_535:]) == {None}
    assert numbers.next(60 * S + 65_536) == 0


@pytest.mark.parametrize("total", [900, pytest.param(66_000, marks=pytest.mark.slow)])
def test_after_65536_messages_the_numbers_have_come_round_and_every_message_still_arrives(total):
    net = Net(2)
    sent = [0]
    if total < 1000:  # begin shortly before they come round
        net.networks[0]._sequence._last = 65_000

    def send_next(_):
        net.networks[0].send(1, "k", sent[0].to_bytes(4), (), lambda delivery: None)
        sent[0] += 1
        if sent[0] < total:
            net.clock.call_after(MS, send_next)

    send_next(None)
    net.run()
    assert [int.from_bytes(message.payload) for _, message in net.delivered] == list(range(total))
    assert len({message.id for _, message in net.delivered}) == total
    assert {event.latency_ns for event in net.of(MessageDelivered)} == {MS}
    assert len(net.book.origins) == min(total, 65_536)
    assert (1, 65_535) not in net.book.origins
    assert (0, 65_535) in net.book.origins


def test_a_node_that_sends_too_fast_for_its_numbers_is_told_so():
    net = Net(2)
    net.networks[0]._sequence.next = lambda now_ns: None
    assert net.send(0, 1, b"") == [Delivery(False, "no_sequence", 0)]
    assert [event.reason for event in net.of(MessageDropped)] == ["no_sequence"]
    assert len(net.of(MessageSent)) == 1


def test_the_trace_may_lose_its_thread_but_no_node_does():
    """A header that was altered on the way names a message nobody sent: it is delivered as what it says it is."""
    net = Net(2)
    altered = []

    def rules(data, _):
        packet = Packet.decode(data)
        altered.append(Packet(9, 1, packet.sequence, packet.kind_code, 1, 0, 1, packet.chunk).encode())
        return [(0, altered[-1])]

    net.networks[1].filter = rules
    net.send(0, 1, b"hello")
    net.run()
    ((_, message),) = net.delivered
    assert (message.source, message.payload, message.id) == (9, b"hello", 0)


def test_after_a_stop_nothing_is_remembered_but_the_number():
    net = Net(2, rule=lambda node, number: (number != 1, True))
    net.networks[1].filter = lambda data, _: [(0, data), (10 * S, data)]
    net.send(0, 1, bytes(300))
    net.run(S)
    net.networks[1].stop()
    assert net.networks[1].pending == 0
    net.run()
    assert net.delivered == []
    assert [event.reason for event in net.of(MessageDropped)] == []
    net.networks[1].filter = None
    net.networks[1].stop()
    net.send(0, 1, b"again")
    net.run()
    assert [message.payload for _, message in net.delivered] == [b"again"]


# --- a node that goes down ---------------------------------------------------------------------------------------------


def drops(net, reason):
    return [
        (event.node, event.kind)
        for _, event in net.events
        if isinstance(event, MessageDropped) and event.reason == reason
    ]


def test_a_message_that_has_come_in_parts_is_lost_with_its_receiver():
    """Of three fragments the last is lost on the way; then the receiver goes down."""
    net = Net(2, rule=lambda node, number: (number < 2, number < 2))
    net.send(0, 1, bytes(300))
    net.clock.environment.run(until=3 * MS + MS // 2)
    net.networks[1].give_up("crashed")
    net.networks[1].stop()
    assert drops(net, "crashed") == [(1, "k")]
    net.clock.environment.run(until=120_000 * MS)
    assert drops(net, "reassembly_timeout") == []
    assert net.delivered == []


def test_what_waits_for_another_try_is_lost_with_its_sender_and_told():
    """No acknowledgement comes, a retry waits; the node goes down before it: its ticket learns why."""
    net = Net(2, rule=lambda node, number: (False, False), settings=NetworkSettings(retries=3, retry_delay_s=10.0))
    fate = net.send(0, 1, b"x")
    net.clock.environment.run(until=2 * MS)
    assert net.networks[0].pending == 1
    net.networks[0].give_up("crashed")
    net.networks[0].stop()
    assert [(delivery.acknowledged, delivery.reason) for delivery in fate] == [(False, "crashed")]
    assert drops(net, "crashed") == [(0, "k")]
    net.clock.environment.run(until=60_000 * MS)
    assert len(fate) == 1


def test_a_flood_that_waits_to_be_passed_on_is_lost_with_its_node():
    net = Net(3, settings=NetworkSettings(forward_delay_s=10.0))
    net.networks[0].flood(5, "k", b"x", (), lambda delivery: None)
    net.clock.environment.run(until=2 * MS)
    assert net.networks[1].pending == 1
    net.networks[1].give_up("died")
    net.networks[1].stop()
    net.clock.environment.run(until=60_000 * MS)
    assert drops(net, "died") == [(1, "k")]
    assert [node for node, _ in net.delivered] == [1]
