"""From a scenario's medium access to the MAC of each node."""

from collections.abc import Sequence
from functools import partial

from netsim.errors import ScenarioError
from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.load import LoadedScenario
from netsim.scenario.mac_checks import mac_findings
from netsim.scenario.make_medium import AnyMedium
from netsim.scenario.places import Place
from netsim.sim.air import Uniforms
from netsim.sim.clock import Clock
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.mac.aloha import AlohaMac, AlohaParameters
from netsim.sim.mac.csma import CsmaMac
from netsim.sim.mac.ideal import IdealMac, IdealMacParameters
from netsim.sim.mac.link import Deliver, Mac
from netsim.sim.mac.lpl import LplMac
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.slots import SlotPlan, slot_plans
from netsim.sim.mac.tdma import TdmaMac, TdmaParameters
from netsim.sim.mac.timer import LocalTime
from netsim.sim.radio import Radio


class MacMaker:
    """Makes the MAC of one node after the other.

    Args:
        loaded: What is asked.
        clock: Simulated time.
        streams: Random streams of the run.
        medium: The shared air.
        air: Every path between nodes, for MACs that are planned ahead.
        places: Every node before it is built.

    Raises:
        ScenarioError: If the MAC cannot work with the medium or the radios.
    """

    def __init__(
        self,
        loaded: LoadedScenario,
        clock: Clock,
        streams: Streams,
        medium: AnyMedium,
        air: Air,
        places: Sequence[Place],
    ) -> None:
        self._parameters = loaded.scenario.mac
        self._clock = clock
        self._streams = streams
        self._medium = medium
        findings = list(mac_findings(loaded, [place.radio for place in places]))
        if findings:
            raise ScenarioError(findings)
        self._slots = _slots(loaded, air) if isinstance(self._parameters, TdmaParameters) else {}

    def __call__(self, place: Place, radio: Radio, deliver: Deliver, local: LocalTime | None = None) -> Mac:
        """The MAC of a node.

        Args:
            place: The node.
            radio: Its radio.
            deliver: Takes received packets.
            local: Its own clock; one that is right by default.
        """
        parameters = self._parameters
        if isinstance(parameters, IdealMacParameters):
            return IdealMac(radio, deliver)
        assess = partial(self._medium.is_busy, place.id)
        draws = Uniforms(self._streams.generator(f"node/{place.id}/backoff")).next
        if isinstance(parameters, AlohaParameters):
            return AlohaMac(self._clock, radio, draws, parameters, deliver)
        if isinstance(parameters, TdmaParameters):
            first = int(draws() * 256)
            plan, busy = self._slots[place.id], None if isinstance(self._medium, IdealMedium) else assess
            return TdmaMac(self._clock, radio, first, parameters, plan, deliver, busy, local)
        if isinstance(parameters, LplParameters):
            return LplMac(self._clock, radio, assess, draws, parameters, deliver)
        return CsmaMac(self._clock, radio, assess, draws, parameters, deliver)


def _slots(loaded: LoadedScenario, air: Air) -> dict[int, SlotPlan]:
    """Every node's slots, from the links of the scenario."""
    parameters = loaded.scenario.mac
    if not isinstance(parameters, TdmaParameters):
        return {}
    heard = {
        node: [path.destination for path in paths if path.prr >= parameters.min_prr]
        for node, paths in air.paths.items()
    }
    try:
        return slot_plans(heard, parameters.frame_slots)
    except ScenarioError as error:
        finding = loaded.document.finding(("mac", "frame_slots"), str(error), "")
        raise ScenarioError([finding]) from error
