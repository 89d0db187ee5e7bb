"""What a harvester offers over time: steps of constant power, so that a battery can be integrated exactly."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from annotated_types import Ge, Gt, Le, Lt

from netsim.parameters import NonNegative, Positive, parameters
from netsim.units import NS_PER_S

NS_PER_H = 3600 * NS_PER_S
NS_PER_DAY = 24 * NS_PER_H

Efficiency = Annotated[float, Gt(0), Le(1)]


@dataclass(frozen=True, slots=True)
class HarvestStep:
    """A stretch of constant power.

    Attributes:
        power_mw: What arrives at the battery, losses of conversion taken off.
        end_ns: When it ends, on the run's clock; None for never.
    """

    power_mw: float
    end_ns: int | None


class Harvest(Protocol):
    """Power offered over time."""

    def step_at(self, time_ns: int) -> HarvestStep:
        """The step in which an instant lies, its begin included."""
        ...


@parameters
class ConstantHarvest:
    """The same power at all times, such as from a warm pipe."""

    type: Literal["constant"] = "constant"
    power_mw: NonNegative
    """Power at the harvester's output."""
    efficiency: Efficiency = 1.0
    """Share of it that arrives in the battery."""

    def step_at(self, time_ns: int) -> HarvestStep:
        """See `Harvest.step_at`."""
        return HarvestStep(self.power_mw * self.efficiency, None)


@parameters
class DayHarvest:
    """A clear day, again and again: half a sine between sunrise and sunset, nothing at night.

    The sine is cut into steps of constant power, each with the energy of the sine over it: a whole day brings
    peak_mw * daylight * 2 / pi, whatever the step.
    """

    type: Literal["day"] = "day"
    peak_mw: Positive
    """Power at noon at the harvester's output."""
    sunrise_h: Annotated[float, Ge(0), Lt(24)] = 6.0
    """Time of day of sunrise."""
    sunset_h: Annotated[float, Gt(0), Le(24)] = 18.0
    """Time of day of sunset."""
    start_h: Annotated[float, Ge(0), Lt(24)] = 0.0
    """Time of day at which the run begins."""
    step_s: Annotated[float, Ge(1), Le(86400)] = 900.0
    """Longest step of constant power."""
    efficiency: Efficiency = 1.0
    """Share that arrives in the battery."""

    def __post_init__(self) -> None:
        """Refuse days without daylight."""
        if round(self.sunset_h * NS_PER_H) <= round(self.sunrise_h * NS_PER_H):
            message = "sunset_h after sunrise_h"
            raise ValueError(message)

    def step_at(self, time_ns: int) -> HarvestStep:
        """See `Harvest.step_at`."""
        start_ns = round(self.start_h * NS_PER_H)
        day, time_of_day_ns = divmod(time_ns + start_ns, NS_PER_DAY)
        midnight_ns = day * NS_PER_DAY - start_ns
        rise_ns, set_ns = round(self.sunrise_h * NS_PER_H), round(self.sunset_h * NS_PER_H)
        if time_of_day_ns < rise_ns:
            return HarvestStep(0.0, midnight_ns + rise_ns)
        if time_of_day_ns >= set_ns:
            return HarvestStep(0.0, midnight_ns + NS_PER_DAY + rise_ns)
        daylight_ns = set_ns - rise_ns
        steps = -(-daylight_ns // round(self.step_s * NS_PER_S))
        step = (time_of_day_ns - rise_ns) * steps // daylight_ns
        begin, end = math.pi * step / steps, math.pi * (step + 1) / steps
        mean = (math.cos(begin) - math.cos(end)) / (end - begin)
        end_ns = midnight_ns + rise_ns + -(-(step + 1) * daylight_ns // steps)
        return HarvestStep(self.peak_mw * self.efficiency * mean, end_ns)


HarvestParameters = ConstantHarvest | DayHarvest
