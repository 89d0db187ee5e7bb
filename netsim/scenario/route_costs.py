"""What messages between nodes will cost, as far as the links of the start tell: for choosing who hosts a variable."""

import math
from collections.abc import Sequence

from netsim.scenario.links import Air
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.net.routes import OneHop, OneHopParameters, Routes, ShortestPathParameters, ShortestPaths
from netsim.units import NS_PER_S

_BYTES = 64
"""A byte's airtime is the slope between an empty frame and one of this size: no radio's frames are shorter."""


class PlannedRoutes:
    """Hops and joules of the routes between nodes (see `netsim.kernels.placement.RouteCosts`).

    The routes are those of the scenario's network where they follow from the links of the start (`one-hop`,
    `shortest-path`); for networks that find their ways at run time they are the shortest ones by ETX, which is what those
    come to when nothing is lost. A route is walked when first asked for.

    A byte's joules are the power of the transmitting and of the receiving radio over the byte's airtime, times the
    expected number of transmissions of the hop, ETX = 1 / (PRR there x PRR back) (De Couto, Aguayo, Bicket, Morris,
    MobiCom 2003), summed over the hops (as in Heinzelman, Chandrakasan, Balakrishnan, HICSS 2000: each hop costs its
    sender and its receiver).

    Args:
        scenario: What is asked.
        places: All nodes.
        air: Their links.
    """

    def __init__(self, scenario: Scenario, places: Sequence[Place], air: Air) -> None:
        self._routes = _routes(scenario, air)
        self._prr = {(node, link.id): link.prr for node, links in air.neighbours.items() for link in links}
        self._place = {place.id: place for place in places}
        self._most_hops = len(places)
        self._known: dict[tuple[int, int], tuple[float, float]] = {}

    def hops(self, source: int, destination: int) -> float:
        """See `RouteCosts.hops`."""
        return self._cost(source, destination)[0]

    def joule_per_byte(self, source: int, destination: int) -> float:
        """See `RouteCosts.joule_per_byte`."""
        return self._cost(source, destination)[1]

    def _cost(self, source: int, destination: int) -> tuple[float, float]:
        key = (source, destination)
        if key not in self._known:
            self._known[key] = self._walk(source, destination)
        return self._known[key]

    def _walk(self, source: int, destination: int) -> tuple[float, float]:
        """Follow a route to its end."""
        node, hops, joules = source, 0, 0.0
        while node != destination:
            following = self._routes.next_hop(node, destination)
            if following is None or hops >= self._most_hops:
                return math.inf, math.inf
            joules += self._hop_j(node, following)
            if joules == math.inf:
                return math.inf, math.inf
            node, hops = following, hops + 1
        return float(hops), joules

    def _hop_j(self, sender: int, listener: int) -> float:
        """Joules for a byte over one hop; infinite where there is no link both ways."""
        both = self._prr.get((sender, listener), 0.0) * self._prr.get((listener, sender), 0.0)
        if both <= 0.0:
            return math.inf
        place = self._place[sender]
        power_mw = place.radio.transmit_power_mw(place.group.tx_power_dbm) + self._place[listener].radio.receive_mw
        return power_mw * 1e-3 * _byte_s(place) / both


def _routes(scenario: Scenario, air: Air) -> Routes:
    network = scenario.network
    if isinstance(network, OneHopParameters):
        return OneHop()
    settings = network if isinstance(network, ShortestPathParameters) else ShortestPathParameters()
    return ShortestPaths(air.neighbours, settings)


def _byte_s(place: Place) -> float:
    """Airtime of a byte."""
    radio = place.radio
    size = min(_BYTES, radio.max_psdu_byte)
    return (radio.airtime_ns(size) - radio.airtime_ns(0)) / size / NS_PER_S
