"""What every medium is made of: listeners, paths between nodes, and the log of finished transmissions."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from netsim.sim.frames import Transmission
from netsim.sim.radio import Radio
from netsim.trace.events import OUTCOME_CODE, Frame
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S, mw_to_dbm

RECEIVED: Final = OUTCOME_CODE["received"]
OVERHEARD: Final = OUTCOME_CODE["overheard"]
COLLIDED: Final = OUTCOME_CODE["collided"]
WEAK: Final = OUTCOME_CODE["weak"]
HALF_DUPLEX: Final = OUTCOME_CODE["half_duplex"]
BUSY: Final = OUTCOME_CODE["busy"]
ASLEEP: Final = OUTCOME_CODE["asleep"]
DEAD: Final = OUTCOME_CODE["dead"]
LOST: Final = OUTCOME_CODE["lost"]


class Uniforms:
    """Uniform numbers of one random stream, drawn in blocks because single draws are slow."""

    def __init__(self, generator: np.random.Generator, block: int = 256) -> None:
        self._generator = generator
        self._block = block
        self._numbers: list[float] = []

    def next(self) -> float:
        """The next number in [0, 1)."""
        if not self._numbers:
            self._numbers = self._generator.random(self._block).tolist()[::-1]
        return self._numbers.pop()


@dataclass(slots=True, eq=False)
class Listener:
    """A radio and what is on the air around it."""

    radio: Radio
    uniforms: Uniforms
    preamble_ns: int
    air: dict[int, tuple[Transmission, float]] = field(default_factory=dict)
    lock: Transmission | None = None
    last_end_ns: int = -1
    last_end_mw: float = 0.0
    last_lock_end_ns: int = -1


@dataclass(frozen=True, slots=True)
class Path:
    """The way from one node to another: received power, and whether it is strong enough to be decoded at all."""

    destination: int
    power_mw: float
    decodable: bool


def preamble_ns(radio: Radio) -> int:
    """Airtime of preamble and start-of-frame delimiter: all of the physical header but its length octet."""
    device = radio.device
    return (device.phy_header_byte - 1) * 8 * NS_PER_S // device.bitrate_bps


class FrameLog:
    """Numbers transmissions and turns finished ones into `Frame` events."""

    def __init__(self, recorder: Recorder, with_receptions: bool) -> None:
        self._recorder = recorder
        self._with_receptions = with_receptions
        self._count = 0

    def next_id(self) -> int:
        """The number of the next transmission."""
        self._count += 1
        return self._count

    def record(self, transmission: Transmission) -> None:
        """Record a finished transmission, with a row for each listener that detail asks for."""
        if not self._recorder.wants(Frame):
            return
        frame = transmission.frame
        rows = [
            reception
            for reception in transmission.receptions.values()
            if self._with_receptions or reception.node == frame.destination
        ]
        self._recorder.record(
            Frame(
                frame_id=transmission.id,
                t_start_ns=transmission.start_ns,
                t_end_ns=transmission.end_ns,
                source=frame.source,
                destination=frame.destination,
                kind=frame.kind,
                is_ack=int(frame.is_ack),
                size_byte=frame.psdu_byte,
                attempt=frame.attempt,
                message_id=frame.message_id,
                tx_power_dbm=transmission.tx_power_dbm,
                rx_node=[row.node for row in rows],
                rx_outcome=[row.outcome for row in rows],
                rx_rssi_dbm=[mw_to_dbm(row.power_mw) for row in rows],
                rx_sinr_db=[mw_to_dbm(row.sinr) for row in rows],
            )
        )
