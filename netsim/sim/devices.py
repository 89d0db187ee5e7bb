"""The CPU and the sensor of a node: they take time and power, one job after the other."""

from netsim.api import Op
from netsim.models.devices import CpuDevice
from netsim.sim.clock import Clock
from netsim.sim.energy import Meter
from netsim.units import NS_PER_S


class Cpu:
    """A processor that sleeps unless it computes. Jobs of one node wait for each other.

    A job that was given to it is finished, whether or not somebody still waits for the result.
    """

    def __init__(self, clock: Clock, device: CpuDevice, meter: Meter) -> None:
        self._clock = clock
        self._device = device
        self._meter = meter
        self._free_ns = 0
        self._is_on = True
        meter.draw(device.sleep_mw, "sleep")

    def compute(self, operations: int) -> Op[None]:
        """Wait for the CPU, then occupy it for this many operations."""
        now_ns = self._clock.now_ns
        start_ns = max(now_ns, self._free_ns)
        self._free_ns = start_ns + -(-operations * NS_PER_S // int(self._device.operations_per_s))
        if self._free_ns > start_ns == now_ns:
            self._meter.draw(self._device.active_mw, "active")
        if self._free_ns > now_ns:
            self._clock.call_after(self._free_ns - now_ns, self._job_done)
            yield self._clock.timeout(self._free_ns - now_ns)

    def start(self) -> None:
        """The node comes up again after a crash: nothing is left to do."""
        self._is_on = True
        self._free_ns = self._clock.now_ns
        self._meter.draw(self._device.sleep_mw, "sleep")

    def stop(self, state: str) -> None:
        """The node died (`dead`) or crashed (`off`)."""
        self._is_on = False
        self._meter.draw(0.0, state)

    def _job_done(self, _: object) -> None:
        if self._clock.now_ns >= self._free_ns and self._is_on:  # else the next job begins at once
            self._meter.draw(self._device.sleep_mw, "sleep")


class SensorPort:
    """The sensor's power switch: on for the time of a sample, off otherwise."""

    def __init__(self, clock: Clock, power_mw: float, sample_ns: int, meter: Meter) -> None:
        self._clock = clock
        self._power_mw = power_mw
        self._sample_ns = sample_ns
        self._meter = meter
        self._users = 0
        self._is_on = True
        meter.draw(0.0, "off")

    def sample(self) -> Op[None]:
        """Take the time and energy of one sample."""
        self._users += 1
        self._meter.draw(self._power_mw, "sample")
        try:
            if self._sample_ns > 0:
                yield self._clock.timeout(self._sample_ns)
        finally:  # also when the reading is cancelled half-way
            self._users -= 1
            if self._users == 0 and self._is_on:
                self._meter.draw(0.0, "off")

    def start(self) -> None:
        """The node comes up again after a crash."""
        self._is_on = True

    def stop(self, state: str) -> None:
        """The node died (`dead`) or crashed (`off`)."""
        self._is_on = False
        self._meter.draw(0.0, state)
