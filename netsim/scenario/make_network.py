"""From a scenario's network section to the network layer of each node."""

from collections.abc import Callable

from netsim.api import Message
from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.clock import Clock
from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.net.network import MessageBook, Network
from netsim.sim.net.routes import OneHop, Routes, ShortestPathParameters, ShortestPaths
from netsim.trace.recorder import Recorder


class NetworkMaker:
    """Makes the network layer of one node after the other.

    Args:
        scenario: What is asked.
        clock: Simulated time.
        recorder: Where message events go.
        streams: Random streams of the run.
        air: Every path between nodes: what is given to nodes that need not discover it.
    """

    def __init__(self, scenario: Scenario, clock: Clock, recorder: Recorder, streams: Streams, air: Air) -> None:
        self._scenario = scenario
        self._clock = clock
        self._recorder = recorder
        self._streams = streams
        self._air = air
        self._routes = self._make_routes()
        self._book = MessageBook()

    def __call__(self, place: Place, deliver: Callable[[Message], None]) -> Network:
        """The network layer of a node; `deliver` takes whole messages for it."""
        packet_byte = place.radio.max_psdu_byte - MAC_OVERHEAD_BYTE
        return Network(self._clock, place.id, self._routes, self._book, self._recorder, packet_byte, deliver)

    def _make_routes(self) -> Routes:
        parameters = self._scenario.network
        if isinstance(parameters, ShortestPathParameters):
            return ShortestPaths(self._air.neighbours, parameters)
        return OneHop()
