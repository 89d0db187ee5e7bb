"""The collection tree: cheapest ways to the sinks, hysteresis, repair, and what to do about loops."""

import networkx as nx
from hypothesis import given, settings
from hypothesis import strategies as st
from net_rig import Net, S

from netsim.sim.clock import Clock
from netsim.sim.net.collection import CollectionParameters, CollectionTree
from netsim.sim.net.packet import Form, Packet
from netsim.sim.net.settings import BeaconDiscovery, NetworkSettings
from netsim.trace.events import BROADCAST, MessageDropped, RouteChange
from netsim.trace.recorder import Recorder

BEACONS = BeaconDiscovery(period_s=1.0)
SETTINGS = NetworkSettings(retries=7, hop_limit=64)


def collecting(graph, sinks=(0,), **more):
    return Net(graph, kind="collection", sinks=sinks, beacons=BEACONS, settings=SETTINGS, **more)


def report(net, node, payload=b"reading"):
    fate = []
    net.networks[node].send_to_sink("reading", payload, (), fate.append)
    return fate


@given(st.integers(2, 12), st.integers(0, 1000), st.floats(0.2, 0.9))
@settings(max_examples=25, deadline=None)
def test_every_node_that_has_a_way_delivers_and_without_losses_by_at_most_one_hop_too_many(count, seed, density):
    """Hysteresis keeps a parent that is worse by less than 1.5 transmissions: here by one hop at each of the nodes."""
    graph = nx.gnp_random_graph(count, density, seed=seed)
    net = collecting(graph, seed=seed)
    net.run(40 * S)
    reach = nx.single_source_shortest_path_length(graph, 0)
    fates = {node: report(net, node) for node in graph if node}
    net.run(45 * S)
    delivered = {message.source: message for node, message in net.delivered}
    assert set(delivered) == set(reach) - {0}
    assert all(node == 0 for node, _ in net.delivered)
    assert all(fate[0].acknowledged == (node in reach) for node, fate in fates.items())
    assert {fate[0].reason for node, fate in fates.items() if node not in reach} <= {"no_route"}
    assert all(message.hops >= reach[source] for source, message in delivered.items())


def test_two_sinks_share_the_nodes_between_them():
    net = collecting(nx.path_graph(7), sinks=(0, 6))
    net.run(30 * S)
    for node in (1, 2, 4, 5):
        report(net, node)
    net.run(31 * S)
    assert sorted((message.source, node) for node, message in net.delivered) == [(1, 0), (2, 0), (4, 6), (5, 6)]


def test_the_tree_mends_when_a_parent_dies_and_says_so():
    graph = nx.Graph([(0, 1), (0, 2), (1, 3), (2, 3)])
    net = collecting(graph)
    net.run(20 * S)
    (first,) = {event.next_hop for event in net.of(RouteChange) if event.node == 3}
    net.kill(first)
    net.run(40 * S)
    report(net, 3)
    net.run(41 * S)
    assert [(node, message.source, message.hops) for node, message in net.delivered] == [(0, 3, 2)]
    assert [event.next_hop for event in net.of(RouteChange) if event.node == 3][-1] == 3 - first


def test_without_a_sink_in_reach_a_message_is_refused_after_its_tries():
    net = collecting(nx.empty_graph(2))
    fate = report(net, 1)
    net.run(5 * S)
    assert [(delivery.reason, delivery.attempts) for delivery in fate] == [("no_route", 0)]
    assert [(event.node, event.reason) for event in net.of(MessageDropped)] == [(1, "no_route")]


def test_neighbours_can_be_written_to_others_only_through_the_tree():
    net = collecting(nx.path_graph(4))
    net.run(20 * S)
    net.send(2, 3, b"down")
    net.send(2, 0, b"up")
    net.send(1, 3, b"two down")
    net.run(25 * S)
    assert sorted((node, message.payload) for node, message in net.delivered) == [(0, b"up"), (3, b"down")]
    assert [event.reason for event in net.of(MessageDropped)] == ["no_route"]


def test_packets_carry_the_cost_of_their_last_sender():
    net = collecting(nx.path_graph(4))
    net.run(20 * S)
    report(net, 3)
    net.run(21 * S)
    packets = [Packet.decode(job.packet) for *_, job in net.frames if job.kind == "reading"]
    assert [int.from_bytes(packet.fields) for packet in packets] == [300, 200, 100]
    assert [packet.form for packet in packets] == [Form.COLLECT] * 3
    assert len(packets[0].encode()) == 12 + 2 + len(b"reading")


# --- one node alone -------------------------------------------------------------------------------------------------


class Alone:
    """Node 9 with links to others; it hears what a test lets it hear."""

    def __init__(self, **links):
        self.links = {int(name[1:]): etx for name, etx in links.items()}
        self.clock, self.changes, self.news = Clock(), [], []
        recorder = Recorder(lambda: self.clock.now_ns, [self])
        self.tree = CollectionTree(self.clock, 9, (50,), CollectionParameters(), lambda: self.links, recorder)
        self.tree.on_news = lambda: self.news.append(self.clock.now_ns)

    def handlers(self):
        return {RouteChange: lambda event, _: self.changes.append((event.next_hop, event.cost))}

    def hear(self, neighbour, cost, parent=50, root=50):
        self.tree.on_advert(neighbour, parent.to_bytes(2) + cost.to_bytes(2) + root.to_bytes(2))
        self.tree.on_neighbours()
        self.clock.environment.run()

    def look(self):
        self.tree.on_neighbours()
        self.clock.environment.run()


def test_a_parent_is_left_only_for_one_that_is_better_by_one_and_a_half():
    node = Alone(n1=1.0, n2=1.0)
    node.hear(1, 300)
    node.hear(2, 151)
    assert node.changes == [(1, 4.0)]
    node.hear(2, 150)
    assert node.changes == [(1, 4.0), (2, 2.5)]


def test_links_above_five_transmissions_are_not_used():
    node = Alone(n1=5.1, n2=5.0)
    node.hear(1, 0)
    assert node.changes == []
    node.hear(2, 300)
    assert node.changes == [(2, 8.0)]
    node.links[2] = 5.01
    node.look()
    assert node.changes[-1] == (BROADCAST, 655.35)


def test_ones_own_child_is_no_parent_and_without_a_parent_neighbours_are_told():
    node = Alone(n1=1.0, n2=1.0)
    node.hear(1, 100)
    node.hear(2, 50, parent=9)
    assert node.changes == [(1, 2.0)]
    del node.links[1]
    node.look()
    assert [hop for hop, _ in node.changes] == [1, BROADCAST]
    assert len(node.news) == 2
    assert node.tree.root is None
    assert int.from_bytes(node.tree.advert()[2:4]) == 65_535


def test_a_packet_from_who_is_not_further_away_brings_news_and_goes_on():
    node = Alone(n1=1.0)
    node.hear(1, 100)
    node.news.clear()

    def arrives(cost):
        packet = Packet(3, 50, 1, 0, 1, 0, 1, b"", Form.COLLECT, cost.to_bytes(2))
        return node.tree.route(packet, 3)

    assert arrives(201).hop == 1
    assert node.news == []
    assert arrives(200).hop == 1
    assert len(node.news) == 1
