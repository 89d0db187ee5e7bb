"""From a scenario's medium to the shared air of a run."""

from netsim.models.path_loss import IdealMediumParameters
from netsim.scenario.links import Air
from netsim.scenario.schema import Scenario
from netsim.sim.air import FrameLog
from netsim.sim.clock import Clock
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.medium import SinrMedium
from netsim.trace.recorder import Recorder
from netsim.units import s_to_ns

AnyMedium = SinrMedium | IdealMedium


def make_medium(scenario: Scenario, clock: Clock, recorder: Recorder, air: Air) -> AnyMedium:
    """The shared air.

    Args:
        scenario: What is asked.
        clock: Simulated time.
        recorder: Where finished frames go.
        air: Every path between nodes.
    """
    parameters = scenario.medium
    log = FrameLog(recorder, scenario.trace.detail != "summary")
    if isinstance(parameters, IdealMediumParameters):
        return IdealMedium(clock, air.paths, s_to_ns(parameters.delay_s), parameters.loss_probability, log)
    return SinrMedium(clock, air.paths, float(air.noise.typical_mw[0]), log)
