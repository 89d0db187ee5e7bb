"""From a scenario's medium to the shared air of a run."""

import numpy as np
from numpy.typing import NDArray

from netsim.models.media import IdealMediumParameters
from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.schema import Scenario
from netsim.sim.air import FrameLog
from netsim.sim.clock import Clock
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.medium import FadingGains, SinrMedium
from netsim.trace.recorder import Recorder
from netsim.units import s_to_ns

Floats = NDArray[np.float64]
AnyMedium = SinrMedium | IdealMedium


def make_medium(scenario: Scenario, clock: Clock, recorder: Recorder, streams: Streams, air: Air) -> AnyMedium:
    """The shared air.

    Args:
        scenario: What is asked.
        clock: Simulated time.
        recorder: Where finished frames go.
        streams: Random streams of the run.
        air: Every path between nodes.
    """
    parameters = scenario.medium
    log = FrameLog(recorder, scenario.trace.detail != "summary")
    if isinstance(parameters, IdealMediumParameters):
        return IdealMedium(clock, air.paths, s_to_ns(parameters.delay_s), log)
    if parameters.reception != "sinr":
        return IdealMedium(clock, air.paths, 0, log, air.delivery)
    return SinrMedium(clock, air.paths, air.noise, log, _fading_gains(air, streams), air.delivery)


def _fading_gains(air: Air, streams: Streams) -> FadingGains | None:
    """Draws of each sender's own stream: one more frame of one node moves nobody else's."""
    fading = air.fading
    if fading is None:
        return None
    generators: dict[int, np.random.Generator] = {}

    def gains(source: int, size: int) -> Floats:
        if source not in generators:
            generators[source] = streams.generator(f"node/{source}/fading")
        return fading.gains(generators[source], size)

    return gains
