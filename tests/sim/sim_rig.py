"""Radios, MACs and a medium wired by hand, with every random number given: for tests of single layers."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from netsim.models.device_tables import load_radio
from netsim.models.noise import ConstantNoise
from netsim.sim.air import FrameLog, Link
from netsim.sim.clock import Clock
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.csma import CsmaMac, CsmaParameters
from netsim.sim.mac.link import LinkJob, Mac
from netsim.sim.medium import SinrMedium
from netsim.sim.radio import Radio
from netsim.trace.events import BROADCAST, EVENT_TYPES, OUTCOMES, RADIO_STATES, Frame, RadioState
from netsim.trace.recorder import Recorder
from netsim.units import dbm_to_mw

US = 1_000
MS = 1_000_000
DEAD = RADIO_STATES.index("dead")
TURNAROUND_NS = 192 * US
NOISE_DBM = -95.0


class Fixed:
    """A generator whose every uniform number is the same: 0 lets every possible frame through."""

    def __init__(self, value=0.0):
        self.value = value

    def random(self, count):
        return np.full(count, self.value)


class Draws:
    """Uniform numbers from a list, the last one for ever."""

    def __init__(self, *numbers):
        self.numbers = list(numbers) or [0.0]

    def __call__(self):
        return self.numbers.pop(0) if len(self.numbers) > 1 else self.numbers[0]


class Log:
    """Every event with its time."""

    def __init__(self):
        self.events = []

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def of(self, event_type):
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, event_type)]


@dataclass
class Station:
    """A radio with its battery, and what came in."""

    account: Account
    battery: Battery
    meter: Meter
    radio: Radio
    mac: Mac | None = None

    def ledger_uj(self):
        """Energy in uJ and time in us under each heading."""
        self.radio.settle()
        return {
            (state, kind): (entry.energy_j * 1e6, entry.time_ns / US)
            for (_, state, kind), entry in self.account.entries.items()
        }


class Rig:
    """Stations on a SINR medium.

    Args:
        received_dbm: (source, destination) -> received power; pairs that are missing do not hear each other.
        luck: What decides receptions, for each node.
        capacity_j: Batteries that are not infinite.
        medium: From (clock, paths, log) to another medium.
        clock: Another clock.
        full: Whether every radio state is recorded.
    """

    def __init__(self, received_dbm, luck=0.0, capacity_j=None, medium=None, clock=None, full=False):
        self.clock = clock or Clock()
        self.log = Log()
        self.received = []
        self.delivered = []
        self.device = load_radio("cc2420", Path())
        recorder = Recorder(lambda: self.clock.now_ns, [self.log])
        nodes = sorted({node for pair in received_dbm for node in pair})
        paths = {node: [] for node in nodes}
        floor_dbm = NOISE_DBM + self.device.preamble_lock_sinr_db
        for (source, destination), power_dbm in sorted(received_dbm.items()):
            paths[source].append(Link(destination, dbm_to_mw(power_dbm), power_dbm >= floor_dbm))
        self.paths = paths
        frame_log = FrameLog(recorder, True)
        self.medium = (medium or sinr_medium)(self.clock, paths, frame_log)
        self.stations = {}
        for node in nodes:
            self.stations[node] = self._station(node, recorder, (capacity_j or {}).get(node, float("inf")), full)
            self.medium.join(self.stations[node].radio, luck(node) if callable(luck) else Fixed(luck))

    def _station(self, node, recorder, capacity_j, full):
        account = Account()
        battery = Battery(self.clock, capacity_j, lambda: self._die(node))
        meter = Meter(self.clock, battery, account, "radio")
        radio = Radio(self.clock, node, self.device, 0.0, meter, self.medium, recorder, full)
        radio.on_receive = lambda frame: self.received.append((self.clock.now_ns, node, frame.source))
        radio.start()
        return Station(account, battery, meter, radio)

    def _die(self, node):
        station = self.stations[node]
        if station.mac is not None:
            station.mac.stop()
        station.radio.die()

    def add_macs(self, draws=None, **parameters):
        """A CSMA MAC on every radio; the first draw is the sequence number, the others are back-offs."""
        settings = CsmaParameters(**parameters)
        return self.add(
            lambda station, uniform, deliver: CsmaMac(
                self.clock, station.radio, self.assess(station.radio.node), uniform, settings, deliver
            ),
            draws,
        )

    def add(self, make, draws=None, nodes=None):
        """A MAC on every radio (of `nodes`), from (station, draws, where packets go); it is told that the radio is on."""
        for node in nodes or self.stations:
            station = self.stations[node]
            station.mac = make(
                station,
                (draws or {}).get(node, Draws(0.0)),
                lambda packet, source, node=node: self.delivered.append((self.clock.now_ns, node, source, packet)),
            )
            station.radio.on_started()
        return self

    def assess(self, node):
        """Clear channel assessment of a node."""
        return lambda *how: self.medium.is_busy(node, *how)

    def at(self, time_ns, action):
        """Do something at a time."""
        self.clock.call_after(time_ns - self.clock.now_ns, lambda _: action())

    def on_air(self, start_ns, source, destination=BROADCAST, psdu_byte=50, kind="k"):
        """Let a frame begin at a time, with no MAC asked."""
        packet = bytes(psdu_byte - 11)
        frame = LinkFrame(source, destination, 0, False, False, packet, kind, 0)
        self.at(start_ns - TURNAROUND_NS, lambda: self.stations[source].radio.transmit(frame))

    def submit(self, time_ns, source, destination, packet=bytes(39), kind="k"):
        """Hand a job to a MAC; returns the list its delivery will be appended to, with its time."""
        fate = []
        job = LinkJob(destination, packet, kind, 1, lambda delivery: fate.append((self.clock.now_ns, delivery)))
        self.at(time_ns, lambda: self.stations[source].mac.submit(job))
        return fate

    def run(self, until_ns=100 * MS):
        self.clock.environment.run(until=until_ns)
        return self

    @property
    def frames(self):
        """Finished frames in order of their ends."""
        return [event for _, event in self.log.of(Frame)]

    def outcomes(self, source=None):
        """For each frame (of a source), in order of start, what became of it at each listener."""
        return [outcomes_of(frame) for frame in sorted_frames(self.frames) if source in (None, frame.source)]

    def states(self, node):
        """A node's recorded radio states, (time in us, code)."""
        return [(time_ns / US, event.state) for time_ns, event in self.log.of(RadioState) if event.node == node]

    def states_after_death(self, node):
        """Recorded states of a node after the first `dead`."""
        states = [event.state for _, event in self.log.of(RadioState) if event.node == node]
        return states[states.index(DEAD) + 1 :]


def sinr_medium(clock, paths, log, noise_dbm=NOISE_DBM, **more):
    """A medium of constant noise."""
    return SinrMedium(clock, paths, ConstantNoise(np.full(len(paths), dbm_to_mw(noise_dbm))), log, **more)


def sorted_frames(frames):
    return sorted(frames, key=lambda frame: (frame.t_start_ns, frame.source))


def outcomes_of(frame):
    return {node: OUTCOMES[code] for node, code in zip(frame.rx_node, frame.rx_outcome, strict=True)}


def mesh(count, power_dbm=-60.0):
    """Everybody hears everybody equally well."""
    return {(a, b): power_dbm for a in range(count) for b in range(count) if a != b}


def airtime_ns(psdu_byte):
    """(6 + PSDU) bytes at 32 us."""
    return (6 + psdu_byte) * 32 * US
