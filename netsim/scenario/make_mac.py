"""From a scenario's medium access to the MAC of each node."""

from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.make_medium import AnyMedium
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.air import Uniforms
from netsim.sim.clock import Clock
from netsim.sim.mac.csma import CsmaMac, CsmaParameters
from netsim.sim.mac.ideal import IdealMac
from netsim.sim.mac.link import Deliver, Mac
from netsim.sim.radio import Radio


class MacMaker:
    """Makes the MAC of one node after the other.

    Args:
        scenario: What is asked.
        clock: Simulated time.
        streams: Random streams of the run.
        medium: The shared air.
        air: Every path between nodes, for MACs that are planned ahead.
    """

    def __init__(self, scenario: Scenario, clock: Clock, streams: Streams, medium: AnyMedium, air: Air) -> None:
        self._scenario = scenario
        self._clock = clock
        self._streams = streams
        self._medium = medium
        self._air = air

    def __call__(self, place: Place, radio: Radio, deliver: Deliver) -> Mac:
        """The MAC of a node; `deliver` takes received packets."""
        parameters = self._scenario.mac
        if isinstance(parameters, CsmaParameters):
            uniforms = Uniforms(self._streams.generator(f"node/{place.id}/backoff"))
            medium = self._medium
            busy = lambda: medium.is_busy(place.id)  # noqa: E731
            return CsmaMac(self._clock, radio, busy, uniforms.next, parameters, deliver)
        return IdealMac(radio, deliver)
