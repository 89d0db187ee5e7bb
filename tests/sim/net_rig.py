"""Network layers over wires: every frame takes a millisecond, and rules say what arrives."""

import math

import networkx as nx

from netsim.api import Delivery, Neighbour
from netsim.rng import Streams
from netsim.sim.clock import Clock
from netsim.sim.net.beacons import Discovery
from netsim.sim.net.book import MessageBook
from netsim.sim.net.collection import CollectionParameters, CollectionTree
from netsim.sim.net.context import Given, NetContext
from netsim.sim.net.distance_vector import DistanceVector
from netsim.sim.net.geographic import GeographicRouter
from netsim.sim.net.network import Network
from netsim.sim.net.packet import Form
from netsim.sim.net.planar import as_sent
from netsim.sim.net.router import TableRouter
from netsim.sim.net.routes import ShortestPathParameters, ShortestPaths
from netsim.sim.net.settings import NetworkSettings
from netsim.trace.events import BROADCAST, EVENT_TYPES
from netsim.trace.recorder import Recorder

PACKET_BYTE = 116  # 127 bytes of PSDU less 11 of MAC header and checksum
MS = 1_000_000
S = 1_000_000_000


class Wire:
    """A MAC that carries a packet in 1 ms, unless a rule loses it or its acknowledgement; four attempts where it does."""

    def __init__(self, net, node):
        self.net, self.node, self.count, self.pending = net, node, 0, 0

    def submit(self, job):
        number, self.count = self.count, self.count + 1
        self.pending += 1
        self.net.frames.append((self.net.clock.now_ns, self.node, job))
        self.net.clock.call_after(MS, lambda _: self._done(job, number))

    def _done(self, job, number):
        self.pending -= 1
        if self.node in self.net.dead:
            return
        arrives, acknowledged = self.net.rule(self.node, number)
        near = [node for node in self.net.graph[self.node] if node not in self.net.dead]
        hops = near if job.destination == BROADCAST else [node for node in near if node == job.destination]
        for node in hops if arrives else ():
            self.net.networks[node].on_packet(job.packet, self.node)
        heard = job.destination == BROADCAST or (acknowledged and bool(hops))
        job.done(Delivery(heard, "" if heard else "no_ack", 1 if heard else 4))


class Net:
    """Network layers of the nodes of a graph.

    Args:
        graph: Who hears whom; a number is a line of so many nodes.
        rule: From (node, number of its frame) to (arrives, is acknowledged).
        kind: `given` or `vector` shortest paths, `geographic`, `collection`.
        positions_m: Where the nodes are.
        sinks: Sinks, for `collection`.
        settings: Of the network layer.
        beacons: Of discovery.
        planarisation: Of geographic routing.
        seed: Of the nodes' random numbers.
    """

    def __init__(
        self,
        graph,
        rule=lambda node, number: (True, True),
        kind="given",
        routes=None,
        positions_m=None,
        sinks=(),
        settings=None,
        beacons=None,
        planarisation="gabriel",
        seed=1,
        clock=None,
    ):
        self.graph = nx.path_graph(graph) if isinstance(graph, int) else graph
        self.clock, self.rule, self.kind, self.sinks = clock or Clock(), rule, kind, sinks
        self.positions_m = positions_m or {node: (float(node), 0.0) for node in self.graph}
        self.events, self.delivered, self.frames, self.dead = [], [], [], set()
        self.recorder = Recorder(lambda: self.clock.now_ns, [self])
        self.settings = settings or NetworkSettings()
        self.beacons, self.planarisation, self.streams = beacons, planarisation, Streams(seed)
        links = {node: [Neighbour(other, 1.0, 1.0) for other in self.graph[node]] for node in self.graph}
        self.routes = routes or ShortestPaths(links, ShortestPathParameters())
        self.book = MessageBook()
        self.discovery, self.vectors, self.trees = {}, {}, {}
        self.networks = {node: self._network(node) for node in self.graph}

    def _network(self, node):
        def draw(name):
            return float(self.streams.generator(f"node/{node}/network/{name}").random())

        def where():
            return self.positions_m[node]

        discovery = None
        if self.beacons is not None:
            discovery = self.discovery[node] = Discovery(self.clock, node, self.beacons, draw, where, PACKET_BYTE)
        near = (
            (lambda: {other: as_sent(self.positions_m[other]) for other in self.graph[node]})
            if discovery is None
            else lambda: discovery.positions(0.5)
        )
        by_position = GeographicRouter(node, where, near, self.positions_m.get, self.planarisation)
        router = {"geographic": lambda: by_position, "collection": lambda: self._tree(node, discovery)}.get(
            self.kind, lambda: TableRouter(node, self._routes(node, discovery, draw))
        )()
        context = NetContext(
            self.clock,
            node,
            self.book,
            self.recorder,
            PACKET_BYTE,
            self.settings,
            draw,
            where,
            discovery or Given(),
            lambda: node if node in self.sinks else min(self.sinks, default=None),
        )
        network = Network(context, router, lambda message: self.delivered.append((node, message)), by_position)
        network.attach(Wire(self, node))
        self._connect(node, network, discovery)
        return network

    def _routes(self, node, discovery, draw):
        if self.kind != "vector":
            return self.routes

        def links():
            return discovery.table.costs(0.5)

        vector = DistanceVector(self.clock, node, 2 * S, draw, links, PACKET_BYTE, self.recorder)
        self.vectors[node] = vector
        return vector

    def _tree(self, node, discovery):
        def links():
            return discovery.table.costs(0.0)

        parameters = CollectionParameters()
        tree = CollectionTree(self.clock, node, self.sinks, parameters, links, self.recorder)
        self.trees[node] = tree
        return tree

    def _connect(self, node, network, discovery):
        if discovery is None:
            return
        discovery.connect(network.port)
        discovery.advertiser = self.vectors.get(node) or self.trees.get(node)
        network.services = {Form.BEACON: discovery}
        if node in self.vectors:
            self.vectors[node].connect(network.port)
            network.services[Form.ROUTE] = self.vectors[node]
        if node in self.trees:
            self.trees[node].on_news = discovery.hurry
        network.start()

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def send(self, source, destination, payload, kind="k"):
        fate = []
        self.networks[source].send(destination, kind, payload, (), fate.append)
        return fate

    def kill(self, node):
        self.dead.add(node)
        self.networks[node].stop()

    def run(self, until_ns=None):
        self.clock.environment.run(until=until_ns)
        return self

    def of(self, event_type):
        return [event for _, event in self.events if isinstance(event, event_type)]


def unit_disk(positions_m, range_m):
    """Who hears whom: those within a range, by positions as they are sent."""
    graph = nx.Graph()
    graph.add_nodes_from(sorted(positions_m))
    sent = {node: as_sent(there) for node, there in positions_m.items()}
    for a in sent:
        graph.add_edges_from((a, b) for b in sent if a < b and math.dist(sent[a], sent[b]) <= range_m)
    return graph
