"""Tables of batteries: how much they hold, and what heavy loads do to them."""

from typing import Literal

from netsim.models.batteries import NonlinearParameters, PeukertParameters, RakhmatovVrudhulaParameters
from netsim.models.devices import BatteryDevice
from netsim.models.sourced import PositiveCount, PositiveNumber
from netsim.parameters import Name, parameters


@parameters
class LinearTable:
    """Every joule can be had, at any load."""

    type: Literal["linear"] = "linear"
    energy_j: PositiveNumber
    """Usable energy when full."""


@parameters
class PeukertTable:
    """A battery that gives less the harder it is drained; see `netsim.models.batteries.PeukertParameters`."""

    type: Literal["peukert"] = "peukert"
    capacity_mah: PositiveNumber
    """Rated charge."""
    rated_current_ma: PositiveNumber
    """Current at which it gives that charge."""
    exponent: PositiveNumber
    """Peukert's k, at least 1."""
    supply_v: PositiveNumber
    """Nominal voltage."""

    def parameters(self) -> PeukertParameters:
        """The values alone."""
        return PeukertParameters(
            capacity_mah=self.capacity_mah.value,
            rated_current_ma=self.rated_current_ma.value,
            exponent=self.exponent.value,
            supply_v=self.supply_v.value,
        )


@parameters
class RakhmatovVrudhulaTable:
    """A cell in which charge diffuses; see `netsim.models.batteries.RakhmatovVrudhulaParameters`."""

    type: Literal["rakhmatov-vrudhula"] = "rakhmatov-vrudhula"
    alpha_ma_min: PositiveNumber
    """Charge when full, in milliampere-minutes."""
    beta_per_sqrt_min: PositiveNumber
    """How fast charge diffuses, per square root of a minute."""
    terms: PositiveCount
    """Terms of the sum."""
    supply_v: PositiveNumber
    """Nominal voltage."""

    def parameters(self) -> RakhmatovVrudhulaParameters:
        """The values alone."""
        return RakhmatovVrudhulaParameters(
            alpha_ma_min=self.alpha_ma_min.value,
            beta_per_sqrt_min=self.beta_per_sqrt_min.value,
            terms=self.terms.value,
            supply_v=self.supply_v.value,
        )


@parameters
class BatteryTable:
    """A battery's table."""

    kind: Literal["battery"] = "battery"
    """What this file is."""
    name: Name
    """The battery."""
    energy_j: PositiveNumber | None = None
    """Usable energy when full: short for the chemistry `linear`."""
    chemistry: LinearTable | PeukertTable | RakhmatovVrudhulaTable | None = None
    """What heavy loads do to it."""
    continuous_ma: PositiveNumber | None = None
    """Largest current its maker vouches for over longer times, if that is known; heavier radios are warned of."""

    def __post_init__(self) -> None:
        """Refuse a battery that holds nothing, or two different things."""
        if (self.energy_j is None) == (self.chemistry is None):
            message = "either energy_j or chemistry"
            raise ValueError(message)
        if isinstance(self.chemistry, PeukertTable) and not 1.0 <= self.chemistry.exponent.value <= 3.0:
            message = "a Peukert exponent from 1 to 3"
            raise ValueError(message)

    def device(self) -> BatteryDevice:
        """The battery as the simulator uses it."""
        most_ma = None if self.continuous_ma is None else self.continuous_ma.value
        if isinstance(self.chemistry, PeukertTable | RakhmatovVrudhulaTable):
            parameters: NonlinearParameters = self.chemistry.parameters()
            return BatteryDevice(self.name, parameters.energy_j, parameters, most_ma)
        number = self.chemistry.energy_j if self.chemistry is not None else self.energy_j
        return BatteryDevice(self.name, number.value if number is not None else 0.0, None, most_ma)
