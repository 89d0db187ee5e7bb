"""From a place to the devices and layers of its node."""

from collections.abc import Callable
from dataclasses import dataclass

from netsim.api import Message
from netsim.rng import Streams
from netsim.scenario.make_mac import MacMaker
from netsim.scenario.make_medium import AnyMedium
from netsim.scenario.make_network import NetworkMaker
from netsim.scenario.places import Place
from netsim.scenario.schema import Scenario
from netsim.sim.budget import NodeBudget
from netsim.sim.clock import Clock
from netsim.sim.devices import Cpu, SensorPort
from netsim.sim.duty_cycle import DutyCycle
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.harvester import Harvester
from netsim.sim.inbox import Inbox
from netsim.sim.local_clock import LocalClock, drawn_clock
from netsim.sim.parts import Parts
from netsim.sim.radio import Radio
from netsim.sim.radio_switch import RadioSwitch
from netsim.sim.stamps import Stamps
from netsim.trace.recorder import Recorder

DEVICES = ("radio", "cpu", "sensor")


@dataclass(frozen=True, slots=True)
class Shared:
    """What all nodes of one run share while they are built."""

    scenario: Scenario
    clock: Clock
    recorder: Recorder
    streams: Streams
    medium: AnyMedium
    make_mac: MacMaker
    make_network: NetworkMaker


def make_parts(place: Place, shared: Shared, on_empty: Callable[[], None], deliver: Callable[[Message], None]) -> Parts:
    """The devices and layers of a node.

    Args:
        place: The node before it is built.
        shared: What it shares with the others.
        on_empty: Called when its battery is empty.
        deliver: Takes whole messages for its algorithm.
    """
    clock = shared.clock
    local = drawn_clock(clock, place.group.clock, shared.streams.generator(f"node/{place.id}/clock"))
    account = Account()
    chemistry = place.battery.chemistry
    cell = None if chemistry is None else chemistry.cell()
    battery = Battery(clock, place.battery.energy_j, on_empty, cell)
    if place.group.harvester is not None:
        Harvester(clock, battery, place.group.harvester)
    meters = tuple(Meter(clock, battery, account, device) for device in DEVICES)
    radio = _radio(place, shared, meters[0])
    network = shared.make_network(place, deliver)
    stamps = Stamps(clock, local)
    radio.on_transmitting = stamps.leaving

    def received(packet: bytes, neighbour: int) -> None:
        stamps.came_in(radio.device.airtime_ns(MAC_OVERHEAD_BYTE + len(packet)))
        network.on_packet(packet, neighbour)

    mac = shared.make_mac(place, radio, received, local)
    switch = RadioSwitch(mac)
    budget = NodeBudget(clock, local, place.id, battery, place.group.budget, switch, mac, shared.recorder)
    network.attach(budget)
    _cycle(place, shared, local, switch)
    sensor = place.sensor
    port = None if sensor is None else SensorPort(clock, sensor.power_mw, sensor.sample_time_ns, meters[2])
    cpu = Cpu(clock, place.cpu, meters[1])
    return Parts(account, battery, radio, cpu, port, mac, network, Inbox(clock), meters, local, stamps, switch, budget)


def _cycle(place: Place, shared: Shared, local: LocalClock, switch: RadioSwitch) -> None:
    """Let the node's radio sleep regularly, if it is to."""
    cycle = place.group.duty_cycle
    if cycle is None:
        return
    random = shared.streams.generator(f"node/{place.id}/duty-cycle").random()
    DutyCycle(shared.clock, local, switch, cycle, random if cycle.phase == "random" else 0.0)


def _radio(place: Place, shared: Shared, meter: Meter) -> Radio:
    all_states = shared.scenario.trace.detail == "full"
    power_dbm = place.group.tx_power_dbm
    radio = Radio(shared.clock, place.id, place.radio, power_dbm, meter, shared.medium, shared.recorder, all_states)
    shared.medium.join(radio, shared.streams.generator(f"node/{place.id}/reception"))
    return radio
