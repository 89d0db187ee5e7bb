"""A harvester: tells its battery the power it offers, at every step of its profile."""

from netsim.models.harvest import Harvest
from netsim.sim.clock import Clock
from netsim.sim.energy import Battery


class Harvester:
    """Charges one battery from the beginning of the run, whether or not the node still lives.

    Args:
        clock: Simulated time.
        battery: What it charges.
        harvest: What it offers.
    """

    def __init__(self, clock: Clock, battery: Battery, harvest: Harvest) -> None:
        self._clock = clock
        self._battery = battery
        self._harvest = harvest
        self._step(None)

    def _step(self, _: object) -> None:
        step = self._harvest.step_at(self._clock.now_ns)
        self._battery.harvest(step.power_mw)
        if step.end_ns is not None:
            self._clock.call_first(step.end_ns - self._clock.now_ns, self._step)
