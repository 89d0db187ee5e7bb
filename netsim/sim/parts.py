"""The devices and layers that a node is made of, and what happens to all of them when it starts, crashes or dies."""

from dataclasses import dataclass

from netsim.sim.budget import NodeBudget
from netsim.sim.devices import Cpu, SensorPort
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.inbox import Inbox
from netsim.sim.layers import LinkLayer, NetworkLayer, Transceiver
from netsim.sim.local_clock import LocalClock
from netsim.sim.radio_switch import RadioSwitch
from netsim.sim.stamps import Stamps


@dataclass(slots=True)
class Parts:
    """The devices and layers a node is made of."""

    account: Account
    battery: Battery
    radio: Transceiver
    cpu: Cpu
    sensor: SensorPort | None
    mac: LinkLayer
    network: NetworkLayer
    inbox: Inbox
    meters: tuple[Meter, ...]
    clock: LocalClock
    stamps: Stamps
    switch: RadioSwitch
    budget: NodeBudget

    @property
    def is_quiet(self) -> bool:
        """Nothing left to send and no frame under way."""
        waiting = self.mac.pending + self.network.pending + self.budget.held
        return waiting == 0 and not self.radio.is_sending

    def settle(self) -> None:
        """Book what every device has drawn until now."""
        for meter in self.meters:
            meter.settle()
        self.radio.settle()

    def start(self) -> None:
        """Every device on again after a crash; nothing is left of what was under way."""
        self.inbox.clear()
        self.cpu.start()
        if self.sensor is not None:
            self.sensor.start()
        self.radio.start()
        self.network.start()
        self.budget.restart()

    def give_up(self, reason: str) -> None:
        """End all that waits to be sent, with this reason, and forget what was received."""
        self.budget.give_up(reason)
        self.network.give_up(reason)
        self.mac.give_up(reason)
        self.network.stop()
        self.mac.stop()

    def die(self) -> None:
        """Every device off for good, at this nanosecond."""
        self.radio.die()
        self._stop_devices("dead")

    def power_off(self) -> None:
        """Every device off, at this nanosecond, until `start`."""
        self.radio.power_off()
        self._stop_devices("off")

    def _stop_devices(self, state: str) -> None:
        self.cpu.stop(state)
        if self.sensor is not None:
            self.sensor.stop(state)
