"""Where the joules go: batteries that integrate piecewise-constant power, and the ledger of who drew it and what for.

Powers are whole femtowatts and energies whole yoctojoules (1 fW for 1 ns), so every sum is exact: the decimal figures of
data sheets, which binary fractions cannot hold, lead to the nanosecond that a calculation by hand gives.

Two independent sums of the same draw are kept. The battery integrates the node's total power; each device's meter books
its own share under device, state and message kind. At the end of a run both must agree (`Battery.check_closure`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from netsim.errors import InvariantError
from netsim.models.batteries import FW_PER_MW, YJ_PER_J, Cell, LinearCell
from netsim.sim.clock import Clock


@dataclass(slots=True)
class Entry:
    """One line of a ledger: energy and time booked under one heading."""

    energy_yj: int = 0
    time_ns: int = 0

    @property
    def energy_j(self) -> float:
        """The energy in joules."""
        return self.energy_yj / YJ_PER_J


@dataclass(slots=True)
class Account:
    """One node's ledger: entries by (device, state, message kind). Kind is empty where no message was served."""

    entries: dict[tuple[str, str, str], Entry] = field(default_factory=dict)

    def book(self, key: tuple[str, str, str], amount_yj: int, time_ns: int) -> None:
        """Add energy and time to an entry."""
        entry = self.entries.get(key)
        if entry is None:
            entry = self.entries[key] = Entry()
        entry.energy_yj += amount_yj
        entry.time_ns += time_ns

    @property
    def total_yj(self) -> int:
        """Everything booked."""
        return sum(entry.energy_yj for entry in self.entries.values())

    @property
    def total_j(self) -> float:
        """Everything booked, in joules."""
        return self.total_yj / YJ_PER_J


class Battery:
    """Energy left in a node, emptied by the power its meters announce, and filled by a harvester where there is one.

    The instant of depletion is computed, never polled: one guard event is armed for an instant before which the cell
    cannot be empty; when it fires too early, because the draw has fallen since, it is armed again for the exact end at
    the present draw. It comes before everything else that happens at its nanosecond: from then on the node is dead, in
    whatever order the rest is handled.

    Args:
        clock: Simulated time.
        capacity_j: Usable energy at the start, to the nearest picojoule; infinity for mains power.
        on_empty: Called once, at the first nanosecond at which nothing is left.
        cell: The chemistry; by default a linear cell of that capacity, empty when the energy drawn reaches it.
    """

    def __init__(self, clock: Clock, capacity_j: float, on_empty: Callable[[], None], cell: Cell | None = None) -> None:
        self._clock = clock
        self.capacity_j = capacity_j
        self._cell = LinearCell(capacity_j) if cell is None else cell
        self._on_empty = on_empty
        self._meters: list[Meter] = []
        self._power_fw = 0
        self._harvest_fw = 0
        self._used_yj = 0
        self._harvested_yj = 0
        self._spilled_yj = 0
        self._since_ns = clock.now_ns
        self._guard_ns: int | None = None
        self._listeners: list[Callable[[], None]] = []
        self.is_empty = False
        self.is_harvested = False

    @property
    def used_j(self) -> float:
        """Energy drawn by the node until now. Asking changes nothing."""
        return self._used_now_yj / YJ_PER_J

    @property
    def left_j(self) -> float:
        """Energy left now, as the cell's chemistry counts it (see `netsim.models.batteries`).

        Empty is 0, or less by what was drawn within the nanosecond in which it ran out.
        """
        return self._cell.left_j(self._power_fw - self._harvest_fw, self._clock.now_ns - self._since_ns)

    @property
    def harvested_j(self) -> float:
        """Energy that the harvester has offered until now."""
        return (self._harvested_yj + self._harvest_fw * (self._clock.now_ns - self._since_ns)) / YJ_PER_J

    @property
    def spilled_j(self) -> float:
        """Of that, what found the battery full, up to when the draw or the harvest last changed (or `settle`)."""
        return self._spilled_yj / YJ_PER_J

    def connect(self, meter: "Meter") -> None:
        """Let a device draw from this battery."""
        self._meters.append(meter)

    def power_changed(self) -> None:
        """A meter's power has changed just now: settle what was drawn so far and predict the end anew."""
        self.settle()
        self._power_fw = sum(meter.power_fw for meter in self._meters)
        self._arm(self._cell.lasts_at_least_ns(self._power_fw - self._harvest_fw))
        for listener in list(self._listeners):
            listener()

    def harvest(self, power_mw: float) -> None:
        """From now on a harvester offers this power. What finds the battery full is spilled."""
        self.settle()
        self.is_harvested = True
        self._harvest_fw = round(power_mw * FW_PER_MW)
        self._arm(self._cell.lasts_at_least_ns(self._power_fw - self._harvest_fw))

    def settle(self) -> None:
        """Account for everything until now."""
        time_ns = self._clock.now_ns - self._since_ns
        self._used_yj += self._power_fw * time_ns
        self._harvested_yj += self._harvest_fw * time_ns
        self._spilled_yj += self._cell.pass_time(self._power_fw - self._harvest_fw, time_ns)
        self._since_ns = self._clock.now_ns

    def follow(self, listener: Callable[[], None]) -> None:
        """Call this whenever the power drawn has changed."""
        self._listeners.append(listener)

    def leave(self, listener: Callable[[], None]) -> None:
        """Call it no more."""
        self._listeners.remove(listener)

    @property
    def used_yj(self) -> int:
        """Energy drawn until now, exactly."""
        return self._used_now_yj

    @property
    def power_fw(self) -> int:
        """Power drawn at present, exactly."""
        return self._power_fw

    def check_closure(self, account: Account, node: int) -> None:
        """Compare the integrated draw with the ledger.

        Raises:
            InvariantError: If they differ at all.
        """
        if self._used_now_yj != account.total_yj:
            message = (
                f"energy of node {node} does not close at {self._clock.now_ns} ns: "
                f"drawn {self.used_j!r} J, booked {account.total_j!r} J"
            )
            raise InvariantError(message)

    @property
    def _used_now_yj(self) -> int:
        return self._used_yj + self._power_fw * (self._clock.now_ns - self._since_ns)

    def _arm(self, delay_ns: int | None) -> None:
        """Be called in that time, unless a guard comes earlier anyway."""
        if delay_ns is None or self.is_empty:
            return
        at_ns = self._since_ns + delay_ns
        if self._guard_ns is None or at_ns < self._guard_ns:
            self._guard_ns = at_ns
            self._clock.call_first(delay_ns, self._guard_fired)

    def _guard_fired(self, _: object) -> None:
        if self.is_empty or self._guard_ns != self._clock.now_ns:
            return  # a later guard was replaced by an earlier one
        self._guard_ns = None
        self.settle()
        if self._cell.is_empty:
            self.is_empty = True
            self._on_empty()
        else:
            self._arm(self._cell.lasts_ns(self._power_fw - self._harvest_fw))


class Meter:
    """One device's draw: tells the battery the power and books it, under what it turned out to be for."""

    def __init__(self, clock: Clock, battery: Battery, account: Account, device: str) -> None:
        self._clock = clock
        self._battery = battery
        self._account = account
        self._device = device
        self._since_ns = clock.now_ns
        self._key = (device, "off", "")
        self.power_fw = 0
        battery.connect(self)

    @property
    def since_ns(self) -> int:
        """When the present state began."""
        return self._since_ns

    def draw(self, power_mw: float, state: str, kind: str = "") -> None:
        """From now on this device draws `power_mw`, booked under `state` and message `kind`."""
        self.settle()
        self._key = (self._device, state, kind)
        power_fw = round(power_mw * FW_PER_MW)
        if power_fw != self.power_fw:
            self.power_fw = power_fw
            self._battery.power_changed()

    def relabel(self, state: str, kind: str = "") -> None:
        """Book what was drawn since the present state began under another heading: it became known only now."""
        self._key = (self._device, state, kind)

    def move(self, state: str, kind: str, to_state: str, to_kind: str, time_ns: int) -> None:
        """Book time that was booked under one heading, at the present power of that state, under another."""
        entry = self._account.entries[self._device, state, kind]
        amount_yj = entry.energy_yj // entry.time_ns * time_ns
        self._account.book((self._device, state, kind), -amount_yj, -time_ns)
        self._account.book((self._device, to_state, to_kind), amount_yj, time_ns)

    def settle(self) -> None:
        """Book everything drawn until now."""
        now_ns = self._clock.now_ns
        if now_ns > self._since_ns:
            time_ns = now_ns - self._since_ns
            self._account.book(self._key, self.power_fw * time_ns, time_ns)
            self._since_ns = now_ns
