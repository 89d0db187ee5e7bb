"""What every medium is made of: outcomes, paths between nodes, uniform numbers, the log of finished transmissions."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from netsim.sim.frames import LinkFrame, Transmission
from netsim.trace.events import OUTCOME_CODE, Frame
from netsim.trace.recorder import Recorder

RECEIVED: Final = OUTCOME_CODE["received"]
OVERHEARD: Final = OUTCOME_CODE["overheard"]
COLLIDED: Final = OUTCOME_CODE["collided"]
WEAK: Final = OUTCOME_CODE["weak"]
HALF_DUPLEX: Final = OUTCOME_CODE["half_duplex"]
BUSY: Final = OUTCOME_CODE["busy"]
ASLEEP: Final = OUTCOME_CODE["asleep"]
DEAD: Final = OUTCOME_CODE["dead"]
LOST: Final = OUTCOME_CODE["lost"]
CAPTURED: Final = OUTCOME_CODE["captured"]
JAMMED: Final = OUTCOME_CODE["jammed"]


class UniformSource(Protocol):
    """What uniform numbers are drawn from, such as a numpy generator."""

    def random(self, size: int, /) -> NDArray[np.float64]:
        """That many numbers in [0, 1)."""
        ...


class FrameFaults(Protocol):
    """What may befall a frame at a listener that would have decoded it."""

    def verdicts(self, source: int, listeners: NDArray[np.int64], frame: LinkFrame, now_ns: int) -> NDArray[np.int64]:
        """Codes in `netsim.trace.events.OUTCOMES`, one a listener; -1 where the frame passes.

        Args:
            source: Node that sent the frame.
            listeners: Node ids, ascending.
            frame: What was sent.
            now_ns: The end of the frame.
        """
        ...


class Uniforms:
    """Uniform numbers of one random stream, drawn in blocks because single draws are slow."""

    def __init__(self, generator: UniformSource, block: int = 256) -> None:
        self._generator = generator
        self._block = block
        self._numbers: list[float] = []

    def next(self) -> float:
        """The next number in [0, 1)."""
        if not self._numbers:
            self._numbers = self._generator.random(self._block).tolist()[::-1]
        return self._numbers.pop()


@dataclass(frozen=True, slots=True)
class Link:
    """The way from one node to another.

    Attributes:
        destination: The listener.
        power_mw: Received power.
        decodable: Whether it is strong enough to be decoded at all.
        prr: Chance that a full-size frame arrives without interference; decides where no interference is modelled.
    """

    destination: int
    power_mw: float
    decodable: bool
    prr: float = 1.0


def label_of(transmission: Transmission, listener: int) -> str:
    """What the ledger books a reception under."""
    frame = transmission.frame
    if not frame.is_for(listener):
        return "overhear"
    if frame.is_strobe:
        return "strobe_receive"
    return "ack_receive" if frame.is_ack else "receive"


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
        frame, heard = transmission.frame, transmission.receptions
        shown = slice(None) if self._with_receptions else heard.node == frame.destination
        with np.errstate(divide="ignore"):
            sinr_db = 10.0 * np.log10(heard.sinr[shown])
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
                rx_node=heard.node[shown].tolist(),
                rx_outcome=heard.outcome[shown].tolist(),
                rx_rssi_dbm=heard.power_dbm[shown].tolist(),
                rx_sinr_db=sinr_db.tolist(),
                is_strobe=int(frame.is_strobe),
            )
        )
