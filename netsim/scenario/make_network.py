"""From a scenario's network section to the network layer of each node."""

import math
from collections.abc import Callable, Mapping, Sequence

from netsim.api import Message
from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.clock import Clock
from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.net.beacons import Discovery
from netsim.sim.net.book import MessageBook
from netsim.sim.net.collection import CollectionParameters, CollectionTree
from netsim.sim.net.context import Given, NetContext
from netsim.sim.net.distance_vector import DistanceVector
from netsim.sim.net.geographic import GeographicParameters, GeographicRouter
from netsim.sim.net.link_port import Draw
from netsim.sim.net.network import Network, Service
from netsim.sim.net.packet import Form
from netsim.sim.net.planar import Point, as_sent
from netsim.sim.net.router import Router, TableRouter
from netsim.sim.net.routes import OneHop, Routes, ShortestPathParameters, ShortestPaths
from netsim.sim.net.settings import BeaconDiscovery
from netsim.trace.recorder import Recorder
from netsim.units import s_to_ns

USUAL_PRR = 0.5
"""Links that geocasts use where the network's settings name no threshold."""


class NetworkMaker:
    """Makes the network layer of one node after the other.

    Args:
        scenario: What is asked.
        clock: Simulated time.
        recorder: Where message events go.
        streams: Random streams of the run.
        air: Every path between nodes: what is given to nodes that need not discover it.
        everybody: All nodes. The directory of destinations is where they are now, as `air` has it.
    """

    def __init__(
        self,
        scenario: Scenario,
        clock: Clock,
        recorder: Recorder,
        streams: Streams,
        air: Air,
        everybody: Sequence[Place],
    ) -> None:
        self._parameters = scenario.network
        self._clock = clock
        self._recorder = recorder
        self._streams = streams
        self._air = air
        self._positions_m = {place.id: (place.x_m, place.y_m) for place in everybody}
        self._sinks = [place.id for place in everybody if place.group.role == "sink"]
        self._minimum_prr: float = getattr(self._parameters, "minimum_prr", USUAL_PRR)
        self._given = self._given_routes()
        self._book = MessageBook()

    def __call__(self, place: Place, deliver: Callable[[Message], None]) -> Network:
        """The network layer of a node; `deliver` takes whole messages for it."""
        draw = self._draw(place)
        packet_byte = place.radio.max_psdu_byte - MAC_OVERHEAD_BYTE
        discovery = self._discovery(place, draw, packet_byte)
        by_position = self._geographic(place, discovery)
        tree = self._tree(place, discovery)
        vector = self._vector(place, discovery, draw, packet_byte)
        nearest = self._nearest_sink(place)
        context = NetContext(
            self._clock,
            place.id,
            self._book,
            self._recorder,
            packet_byte,
            self._parameters,
            draw,
            self._position_of(place),
            discovery or Given(),
            lambda: nearest if tree is None or tree.root is None else tree.root,
        )
        network = Network(context, self._router(place, by_position, tree, vector), deliver, by_position)
        _connect(network, discovery, tree, vector)
        return network

    def _given_routes(self) -> Routes:
        parameters = self._parameters
        if isinstance(parameters, ShortestPathParameters) and not isinstance(parameters.discovery, BeaconDiscovery):
            return ShortestPaths(self._air.neighbours, parameters, lambda: self._air.version)
        return OneHop()

    def _draw(self, place: Place) -> Draw:
        return lambda name: float(self._streams.generator(f"node/{place.id}/network/{name}").random())

    def _discovery(self, place: Place, draw: Draw, packet_byte: int) -> Discovery | None:
        settings = self._parameters.discovery
        if not isinstance(settings, BeaconDiscovery):
            return None
        return Discovery(self._clock, place.id, settings, draw, self._position_of(place), packet_byte)

    def _geographic(self, place: Place, discovery: Discovery | None) -> GeographicRouter:
        """Routing by position: for geographic networks, and everywhere for the way to a region."""
        minimum_prr = self._minimum_prr
        near = (
            _GivenNear(self._air, place.id, minimum_prr)
            if discovery is None
            else lambda: discovery.positions(minimum_prr)
        )
        rule = self._parameters.planarisation if isinstance(self._parameters, GeographicParameters) else "gabriel"
        return GeographicRouter(place.id, self._position_of(place), near, self._air.positions_m.get, rule)

    def _tree(self, place: Place, discovery: Discovery | None) -> CollectionTree | None:
        parameters = self._parameters
        if not isinstance(parameters, CollectionParameters) or discovery is None:
            return None
        links = lambda: discovery.table.costs(0.0)  # noqa: E731
        return CollectionTree(self._clock, place.id, self._sinks, parameters, links, self._recorder)

    def _vector(self, place: Place, discovery: Discovery | None, draw: Draw, packet_byte: int) -> DistanceVector | None:
        parameters = self._parameters
        if not isinstance(parameters, ShortestPathParameters) or discovery is None:
            return None

        def links() -> Mapping[int, float]:
            costs = discovery.table.costs(parameters.minimum_prr)
            return dict.fromkeys(costs, 1.0) if parameters.metric == "hop" else costs

        period_ns = s_to_ns(parameters.update_s)
        return DistanceVector(self._clock, place.id, period_ns, draw, links, packet_byte, self._recorder)

    def _router(
        self, place: Place, by_position: GeographicRouter, tree: CollectionTree | None, vector: DistanceVector | None
    ) -> Router:
        if isinstance(self._parameters, GeographicParameters):
            return by_position
        if tree is not None:
            return tree
        return TableRouter(place.id, self._given if vector is None else vector)

    def _position_of(self, place: Place) -> Callable[[], Point]:
        """Where a node is, also when it moves."""
        return lambda: self._air.positions_m[place.id]

    def _nearest_sink(self, place: Place) -> int | None:
        """The sink that is nearest as the crow flies; itself for a sink, None without sinks."""
        here = (place.x_m, place.y_m)
        return min(self._sinks, key=lambda sink: (math.dist(self._positions_m[sink], here), sink), default=None)


class _GivenNear:
    """Positions of a node's given neighbours whose links are good enough both ways; follows nodes that move."""

    def __init__(self, air: Air, node: int, minimum_prr: float) -> None:
        self._air = air
        self._node = node
        self._minimum_prr = minimum_prr
        self._of_version = -1
        self._near: dict[int, Point] = {}

    def __call__(self) -> dict[int, Point]:
        if self._of_version != self._air.version:
            self._of_version = self._air.version
            self._near = {
                link.id: as_sent(self._air.positions_m[link.id])
                for link in self._air.neighbours[self._node]
                if min(link.prr, self._back(link.id)) >= self._minimum_prr
            }
        return self._near

    def _back(self, neighbour: int) -> float:
        return next((link.prr for link in self._air.neighbours[neighbour] if link.id == self._node), 0.0)


def _connect(
    network: Network, discovery: Discovery | None, tree: CollectionTree | None, vector: DistanceVector | None
) -> None:
    """Tie what the network layer does for itself to the way down and to each other."""
    if discovery is None:
        return
    discovery.connect(network.port)
    discovery.advertiser = vector or tree
    services: dict[int, Service] = {Form.BEACON: discovery}
    if vector is not None:
        vector.connect(network.port)
        services[Form.ROUTE] = vector
    if tree is not None:
        tree.on_news = discovery.hurry
    network.services = services
