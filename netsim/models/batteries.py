"""What is left in a battery cell under a changing load, and when nothing will be.

A cell knows no clock: it is told how long a load lasted, and asked how long the next may last. Loads are whole femtowatts,
times whole nanoseconds and energies whole yoctojoules (1 fW for 1 ns), so that sums are exact. A load's current is its
power over the cell's nominal voltage.
"""

import math
from typing import Annotated, Final, Literal, Protocol

from annotated_types import Ge, Le

from netsim.models.diffusion import Diffusion
from netsim.parameters import Positive, PositiveInt, parameters

FW_PER_MW: Final = 10**12
YJ_PER_PJ: Final = 10**12
YJ_PER_J: Final = 10**24
NS_PER_MIN: Final = 60_000_000_000


@parameters
class PeukertParameters:
    """A battery that gives less the harder it is drained: it lasts rated time * (rated current / current)^k (Peukert 1897).

    Below the rated current it gives its rated charge and no more; the law itself would promise charge without end there.
    """

    type: Literal["peukert"] = "peukert"
    capacity_mah: Positive
    """Rated charge."""
    rated_current_ma: Positive
    """Current at which it gives that charge."""
    exponent: Annotated[float, Ge(1), Le(3)]
    """Peukert's k: 1 for no loss, 1.1 to 1.3 for common cells."""
    supply_v: Positive
    """Nominal voltage: a load's current is its power divided by this."""

    @property
    def energy_j(self) -> float:
        """Energy at the rated current."""
        return 3.6 * self.capacity_mah * self.supply_v

    def cell(self) -> "PeukertCell":
        """A full cell."""
        return PeukertCell(self)


@parameters
class RakhmatovVrudhulaParameters:
    """A cell in which charge must diffuse to the electrode: heavy loads lock some up, rest sets it free again.

    Rakhmatov and Vrudhula, "An analytical high-level battery model for use in energy management of portable electronic
    systems", ICCAD 2001. It is empty when sigma(t) = alpha, where

        sigma(t) = integral of i(s) (1 + 2 sum over m = 1..terms of exp(-beta^2 m^2 (t - s))) ds.
    """

    type: Literal["rakhmatov-vrudhula"] = "rakhmatov-vrudhula"
    alpha_ma_min: Positive
    """Charge when full, in milliampere-minutes."""
    beta_per_sqrt_min: Positive
    """How fast charge diffuses, per square root of a minute; large for a nearly ideal cell."""
    terms: PositiveInt = 10
    """Terms of the sum."""
    supply_v: Positive
    """Nominal voltage: a load's current is its power divided by this."""

    @property
    def energy_j(self) -> float:
        """Energy of all its charge at the nominal voltage: what ever gentler loads approach."""
        return self.alpha_ma_min * self.supply_v * 0.06

    def cell(self) -> "DiffusionCell":
        """A full cell."""
        return DiffusionCell(self)


NonlinearParameters = PeukertParameters | RakhmatovVrudhulaParameters


class Cell(Protocol):
    """The charge of one battery. A load below 0 charges it, where its chemistry allows that."""

    def pass_time(self, load_fw: int, time_ns: int) -> int:
        """The load was `load_fw` for `time_ns`.

        Returns:
            Energy that did not fit in because it was full, in yoctojoules.
        """
        ...

    @property
    def is_empty(self) -> bool:
        """Whether nothing is left."""
        ...

    def left_j(self, load_fw: int, time_ns: int) -> float:
        """What will be left after `time_ns` of a load. Asking changes nothing."""
        ...

    def lasts_at_least_ns(self, load_fw: int) -> int | None:
        """A time in which a constant load cannot empty it, found without effort; None if it never can."""
        ...

    def lasts_ns(self, load_fw: int) -> int | None:
        """The first whole nanosecond at which a constant load has emptied it; None if it never will."""
        ...


class LinearCell:
    """Every joule can be had, at any load; it can be charged up to what it held when full.

    Args:
        energy_j: Energy when full, to the nearest picojoule; infinity for mains power.
    """

    def __init__(self, energy_j: float) -> None:
        self._full_yj = None if energy_j == math.inf else round(energy_j * 1e12) * YJ_PER_PJ
        self._taken_yj = 0

    def pass_time(self, load_fw: int, time_ns: int) -> int:
        """See `Cell.pass_time`."""
        self._taken_yj += load_fw * time_ns
        if self._taken_yj >= 0 or self._full_yj is None:
            return 0
        spilled_yj, self._taken_yj = -self._taken_yj, 0
        return spilled_yj

    @property
    def is_empty(self) -> bool:
        """See `Cell.is_empty`."""
        return self._full_yj is not None and self._taken_yj >= self._full_yj

    def left_j(self, load_fw: int, time_ns: int) -> float:
        """See `Cell.left_j`."""
        if self._full_yj is None:
            return math.inf
        return (self._full_yj - max(0, self._taken_yj + load_fw * time_ns)) / YJ_PER_J

    def lasts_ns(self, load_fw: int) -> int | None:
        """See `Cell.lasts_ns`."""
        if self._full_yj is None or load_fw <= 0:
            return None
        return max(0, -((self._taken_yj - self._full_yj) // load_fw))

    lasts_at_least_ns = lasts_ns


class PeukertCell:
    """A linear cell that feels a heavier load than there is; see `PeukertParameters`."""

    def __init__(self, parameters: PeukertParameters) -> None:
        self._exponent = parameters.exponent
        self._rated_fw = parameters.rated_current_ma * parameters.supply_v * FW_PER_MW
        self._cell = LinearCell(parameters.energy_j)

    def felt_fw(self, load_fw: int) -> int:
        """What a load takes from the rated energy: rated power * (load / rated power)^k above it, the load below."""
        if load_fw <= self._rated_fw:
            return load_fw
        return round(self._rated_fw * math.pow(load_fw / self._rated_fw, self._exponent))

    def pass_time(self, load_fw: int, time_ns: int) -> int:
        """See `Cell.pass_time`."""
        return self._cell.pass_time(self.felt_fw(load_fw), time_ns)

    @property
    def is_empty(self) -> bool:
        """See `Cell.is_empty`."""
        return self._cell.is_empty

    def left_j(self, load_fw: int, time_ns: int) -> float:
        """See `Cell.left_j`: energy that loads up to the rated current would still get."""
        return self._cell.left_j(self.felt_fw(load_fw), time_ns)

    def lasts_ns(self, load_fw: int) -> int | None:
        """See `Cell.lasts_ns`."""
        return self._cell.lasts_ns(self.felt_fw(load_fw))

    lasts_at_least_ns = lasts_ns


class DiffusionCell:
    """A cell of Rakhmatov and Vrudhula; see `RakhmatovVrudhulaParameters`. It cannot be charged."""

    def __init__(self, parameters: RakhmatovVrudhulaParameters) -> None:
        self._alpha = parameters.alpha_ma_min
        self._j_per_ma_min = parameters.supply_v * 0.06
        self._ma_per_fw = 1.0 / (parameters.supply_v * FW_PER_MW)
        self._state = Diffusion.at_rest(parameters.beta_per_sqrt_min, parameters.terms)

    def pass_time(self, load_fw: int, time_ns: int) -> int:
        """See `Cell.pass_time`."""
        if time_ns:
            self._state = self._state.after(load_fw * self._ma_per_fw, time_ns / NS_PER_MIN)
        return 0

    @property
    def is_empty(self) -> bool:
        """See `Cell.is_empty`."""
        return self._state.sigma >= self._alpha

    def left_j(self, load_fw: int, time_ns: int) -> float:
        """See `Cell.left_j`: alpha - sigma at the nominal voltage; 0 at the end, and it grows again while the cell rests."""
        after = self._state.after(load_fw * self._ma_per_fw, time_ns / NS_PER_MIN)
        return max(0.0, self._alpha - after.sigma) * self._j_per_ma_min

    def lasts_at_least_ns(self, load_fw: int) -> int | None:
        """See `Cell.lasts_at_least_ns`: the time for which even the steepest rise of sigma does not reach alpha."""
        if load_fw <= 0:
            return None
        left = self._alpha - self._state.sigma
        if left <= 0.0:
            return 0
        time_min = left / self._state.steepest_rise(load_fw * self._ma_per_fw)
        return max(1, int(time_min * NS_PER_MIN * (1.0 - 1e-12)))

    def lasts_ns(self, load_fw: int) -> int | None:
        """See `Cell.lasts_ns`."""
        if load_fw <= 0:
            return None
        if self.is_empty:
            return 0
        return self._state.first_reach(self._alpha, load_fw * self._ma_per_fw, NS_PER_MIN)
