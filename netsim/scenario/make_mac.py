"""From a scenario's medium access to the MAC of each node."""

from functools import partial

from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.make_medium import AnyMedium
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.air import Uniforms
from netsim.sim.clock import Clock
from netsim.sim.mac.aloha import AlohaMac, AlohaParameters
from netsim.sim.mac.csma import CsmaMac
from netsim.sim.mac.ideal import IdealMac, IdealMacParameters
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
        if isinstance(parameters, IdealMacParameters):
            return IdealMac(radio, deliver)
        draws = Uniforms(self._streams.generator(f"node/{place.id}/backoff")).next
        if isinstance(parameters, AlohaParameters):
            return AlohaMac(self._clock, radio, draws, parameters, deliver)
        assess = partial(self._medium.is_busy, place.id)
        return CsmaMac(self._clock, radio, assess, draws, parameters, deliver)
