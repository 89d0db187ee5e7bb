"""Where the joules go: batteries that integrate piecewise-constant power, and the ledger of who drew it and what for.

Two independent sums of the same draw are kept. The battery integrates the node's total power; each device's meter books
its own share under device, state and message kind. At the end of a run both must agree (`Battery.check_closure`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from netsim.errors import InvariantError
from netsim.sim.clock import Clock
from netsim.units import energy_j

CLOSURE_RTOL = 1e-9


@dataclass(slots=True)
class Entry:
    """One line of a ledger: energy and time booked under one heading."""

    energy_j: float = 0.0
    time_ns: int = 0


@dataclass(slots=True)
class Account:
    """One node's ledger: entries by (device, state, message kind). Kind is empty where no message was served."""

    entries: dict[tuple[str, str, str], Entry] = field(default_factory=dict)

    def book(self, key: tuple[str, str, str], amount_j: float, time_ns: int) -> None:
        """Add energy and time to an entry."""
        entry = self.entries.get(key)
        if entry is None:
            entry = self.entries[key] = Entry()
        entry.energy_j += amount_j
        entry.time_ns += time_ns

    @property
    def total_j(self) -> float:
        """Everything booked."""
        return math.fsum(entry.energy_j for entry in self.entries.values())


class Battery:
    """Energy left in a node, emptied by the power its meters announce.

    The instant of depletion is computed, never polled: one guard event is armed for the predicted instant and, when it
    fires too early because the draw has fallen since, armed again.

    Args:
        clock: Simulated time.
        capacity_j: Usable energy at the start; infinity for mains power.
        on_empty: Called once, at the first nanosecond at which the energy drawn reaches the capacity.
    """

    def __init__(self, clock: Clock, capacity_j: float, on_empty: Callable[[], None]) -> None:
        self._clock = clock
        self.capacity_j = capacity_j
        self._on_empty = on_empty
        self._meters: list[Meter] = []
        self._power_mw = 0.0
        self._used_j = 0.0
        self._since_ns = clock.now_ns
        self._guard_ns: int | None = None
        self.is_empty = False

    @property
    def used_j(self) -> float:
        """Energy drawn until now. Asking changes nothing."""
        return self._used_j + energy_j(self._power_mw, self._clock.now_ns - self._since_ns)

    @property
    def left_j(self) -> float:
        """Energy left now."""
        return self.capacity_j - self.used_j

    def connect(self, meter: "Meter") -> None:
        """Let a device draw from this battery."""
        self._meters.append(meter)

    def power_changed(self) -> None:
        """A meter's power has changed just now: settle what was drawn so far and predict the end anew."""
        now_ns = self._clock.now_ns
        self._used_j += energy_j(self._power_mw, now_ns - self._since_ns)
        self._since_ns = now_ns
        self._power_mw = sum(meter.power_mw for meter in self._meters)
        if self.capacity_j != math.inf and self._power_mw > 0.0 and not self.is_empty:
            self._arm(now_ns)

    def check_closure(self, account: Account, node: int) -> None:
        """Compare the integrated draw with the ledger.

        Raises:
            InvariantError: If they differ by more than 1e-9 of the draw.
        """
        if not math.isclose(self.used_j, account.total_j, rel_tol=CLOSURE_RTOL, abs_tol=1e-15):
            message = (
                f"energy of node {node} does not close at {self._clock.now_ns} ns: "
                f"drawn {self.used_j!r} J, booked {account.total_j!r} J"
            )
            raise InvariantError(message)

    def _empty_at_ns(self, now_ns: int) -> int:
        left_j = self.capacity_j - self._used_j
        return now_ns + max(0, math.ceil(left_j / (self._power_mw * 1e-12)))

    def _arm(self, now_ns: int) -> None:
        at_ns = self._empty_at_ns(now_ns)
        if self._guard_ns is None or at_ns < self._guard_ns:
            self._guard_ns = at_ns
            self._clock.call_after(at_ns - now_ns, self._guard_fired)

    def _guard_fired(self, _: object) -> None:
        now_ns = self._clock.now_ns
        if self.is_empty or self._guard_ns != now_ns:
            return  # a later guard was replaced by an earlier one
        self._guard_ns = None
        if self._power_mw <= 0.0:
            return
        if self.used_j >= self.capacity_j or self._empty_at_ns(self._since_ns) <= now_ns:
            self.is_empty = True
            self._on_empty()
        else:
            self.power_changed()


class Meter:
    """One device's draw: tells the battery the power and books it, under what it turned out to be for."""

    def __init__(self, clock: Clock, battery: Battery, account: Account, device: str) -> None:
        self._clock = clock
        self._battery = battery
        self._account = account
        self._device = device
        self._since_ns = clock.now_ns
        self._key = (device, "off", "")
        self.power_mw = 0.0
        battery.connect(self)

    @property
    def since_ns(self) -> int:
        """When the present state began."""
        return self._since_ns

    def draw(self, power_mw: float, state: str, kind: str = "") -> None:
        """From now on this device draws `power_mw`, booked under `state` and message `kind`."""
        self.settle()
        self._key = (self._device, state, kind)
        if power_mw != self.power_mw:
            self.power_mw = power_mw
            self._battery.power_changed()

    def relabel(self, state: str, kind: str = "") -> None:
        """Book what was drawn since the present state began under another heading: it became known only now."""
        self._key = (self._device, state, kind)

    def settle(self) -> None:
        """Book everything drawn until now."""
        now_ns = self._clock.now_ns
        if now_ns > self._since_ns:
            time_ns = now_ns - self._since_ns
            self._account.book(self._key, energy_j(self.power_mw, time_ns), time_ns)
            self._since_ns = now_ns
