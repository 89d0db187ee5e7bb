"""What taking one reading costs a node. What the reading says is the problem's business (`netsim.problems`)."""

from dataclasses import dataclass

from netsim.parameters import NonNegative, parameters
from netsim.units import energy_j, s_to_ns


@parameters
class SensorParameters:
    """A sensor's power and time for one reading."""

    power_mw: NonNegative = 2.1
    """Draw while sampling; the default is the MICA2 sensor board, measured at 0.7 mA and 3 V (PowerTOSSIM)."""
    sample_time_s: NonNegative = 0.01
    """From request to reading, warm-up included; the default is chosen, not measured: look it up for your sensor."""


@dataclass(frozen=True, slots=True)
class SensorDevice:
    """A sensor as the simulator uses it.

    Attributes:
        power_mw: Draw while it samples.
        sample_time_ns: How long one sample takes.
    """

    power_mw: float
    sample_time_ns: int

    @property
    def energy_per_sample_j(self) -> float:
        """Energy of one reading."""
        return energy_j(self.power_mw, self.sample_time_ns)


def sensor_device(parameters: SensorParameters) -> SensorDevice:
    """The sensor in whole nanoseconds."""
    return SensorDevice(power_mw=parameters.power_mw, sample_time_ns=s_to_ns(parameters.sample_time_s))
