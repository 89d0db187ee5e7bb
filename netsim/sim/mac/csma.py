"""Unslotted CSMA-CA with acknowledgement and retries, IEEE 802.15.4-2006 clauses 7.5.1.4 and 7.5.6.4.

A callback state machine: back off a random number of unit periods, assess the channel for eight symbols, turn round and
send, wait for the acknowledgement.
"""

from collections.abc import Callable
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.api import BROADCAST
from netsim.parameters import PositiveInt, parameters
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.link import Deliver, Duplicates, LinkJob, QueuedMac
from netsim.sim.medium import CCA_SYMBOLS
from netsim.sim.radio import Radio

UNIT_BACKOFF_SYMBOLS = 20
"""aUnitBackoffPeriod, IEEE 802.15.4-2006 table 85."""
ACK_WAIT_SYMBOLS = 54
"""macAckWaitDuration at 2.4 GHz: unit back-off 20 + turnaround 12 + SHR 10 + 6 octets of 2 symbols (7.4.2)."""
SIFS_SYMBOLS = 12
LIFS_SYMBOLS = 40
SIFS_LIMIT_BYTE = 18
"""aMaxSIFSFrameSize."""


@parameters
class CsmaParameters:
    """Unslotted CSMA-CA of IEEE 802.15.4-2006; the defaults are the standard's."""

    type: Literal["csma"] = "csma"
    min_be: Annotated[int, Ge(0), Le(8)] = 3
    """Back-off exponent of the first attempt (macMinBE): 0 to 2^min_be - 1 unit periods of 320 us."""
    max_be: Annotated[int, Ge(3), Le(8)] = 5
    """Largest back-off exponent (macMaxBE)."""
    max_backoffs: Annotated[int, Ge(0), Le(5)] = 4
    """Busy assessments before the frame is given up as `channel_busy`, less one (macMaxCSMABackoffs)."""
    max_retries: Annotated[int, Ge(0), Le(30)] = 3
    """Retransmissions without acknowledgement before the frame is given up as `no_ack` (macMaxFrameRetries)."""
    queue_frames: PositiveInt = 64
    """Frames that can wait; more are dropped as `queue_full`."""
    acknowledge: bool = True
    """Whether unicast frames ask for an acknowledgement."""

    def __post_init__(self) -> None:
        """Refuse exponents in the wrong order."""
        if self.min_be > self.max_be:
            message = "min_be of at most max_be"
            raise ValueError(message)


class CsmaMac(QueuedMac):
    """See the module.

    Args:
        clock: Simulated time.
        radio: This node's radio; the MAC takes over its callbacks.
        channel_busy: Clear channel assessment at this node.
        uniform: Draws of the node's back-off stream, in [0, 1).
        parameters: Settings of the standard.
        deliver: Where received packets go.
    """

    def __init__(
        self,
        clock: Clock,
        radio: Radio,
        channel_busy: Callable[[], bool],
        uniform: Callable[[], float],
        parameters: CsmaParameters,
        deliver: Deliver,
    ) -> None:
        super().__init__(radio, parameters.queue_frames)
        self._clock = clock
        self._channel_busy = channel_busy
        self._uniform = uniform
        self._parameters = parameters
        self._deliver = deliver
        self._duplicates = Duplicates()
        self._sequence = int(uniform() * 256)
        self._attempt = 0
        self._backoffs = 0
        self._exponent = parameters.min_be
        self._spaced_until_ns = 0  # end of the inter-frame space
        self._sent_byte = 0
        self._awaits_ack = False
        self._step = 0  # counts steps of the exchange, so that an overtaken timer knows it
        radio.on_receive = self._on_receive
        radio.on_transmitted = self._on_transmitted

    def stop(self) -> None:
        """See `Mac.stop`."""
        super().stop()
        self._step += 1

    def _begin(self, job: LinkJob) -> None:
        self._sequence = (self._sequence + 1) % 256
        self._attempt = 0
        self._contend()

    def _contend(self) -> None:
        self._backoffs = 0
        self._exponent = self._parameters.min_be
        self._back_off()

    def _back_off(self) -> None:
        symbol_ns = self._radio.device.symbol_ns
        periods = int(self._uniform() * 2**self._exponent)
        spacing_ns = max(0, self._spaced_until_ns - self._clock.now_ns)
        delay_ns = spacing_ns + (periods * UNIT_BACKOFF_SYMBOLS + CCA_SYMBOLS) * symbol_ns
        self._after(delay_ns, self._assess)

    def _assess(self) -> None:
        if self._radio.can_transmit and not self._channel_busy():
            self._transmit()
            return
        self._backoffs += 1
        self._exponent = min(self._exponent + 1, self._parameters.max_be)
        if self._backoffs > self._parameters.max_backoffs:
            self._end_exchange("channel_busy")
        else:
            self._back_off()

    def _transmit(self) -> None:
        job = self._job
        if job is None:
            return
        wants_ack = self._parameters.acknowledge and job.destination != BROADCAST
        node = self._radio.node
        self._radio.transmit(
            LinkFrame(
                source=node,
                destination=job.destination,
                sequence=self._sequence,
                is_ack=False,
                wants_ack=wants_ack,
                packet=job.packet,
                kind=job.kind,
                message_id=job.message_id,
                attempt=self._attempt,
            )
        )

    def _on_transmitted(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._proceed()
            return
        self._attempt += 1
        self._sent_byte = frame.psdu_byte
        self._space_after(frame.psdu_byte)
        if frame.wants_ack:
            self._awaits_ack = True
            self._after(ACK_WAIT_SYMBOLS * self._radio.device.symbol_ns, self._ack_missing)
        else:
            self._end_exchange("")

    def _space_after(self, psdu_byte: int) -> None:
        """Leave room after a frame, or after its acknowledgement where one came (7.5.1.3)."""
        symbols = SIFS_SYMBOLS if psdu_byte <= SIFS_LIMIT_BYTE else LIFS_SYMBOLS
        self._spaced_until_ns = self._clock.now_ns + symbols * self._radio.device.symbol_ns

    def _ack_missing(self) -> None:
        self._awaits_ack = False
        if self._attempt > self._parameters.max_retries:
            self._end_exchange("no_ack")
        else:
            self._contend()

    def _end_exchange(self, reason: str) -> None:
        """The job is done, or given up for a reason: no timer of it counts any more."""
        self._awaits_ack = False
        self._step += 1
        self._finish(reason, self._attempt)

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            if self._awaits_ack and frame.is_for(self._radio.node) and frame.sequence == self._sequence:
                self._space_after(self._sent_byte)
                self._end_exchange("")
        elif frame.is_for(self._radio.node):
            if frame.wants_ack and self._radio.can_transmit:  # only over the ideal medium it may be sending itself
                self._acknowledge(frame)
            if frame.destination == BROADCAST or self._duplicates.is_new(frame):
                self._deliver(frame.packet, frame.source)

    def _acknowledge(self, frame: LinkFrame) -> None:
        """Answer after the turnaround, without contention (7.5.6.4.2)."""
        node = self._radio.node
        self._radio.transmit(
            LinkFrame(node, frame.source, frame.sequence, True, False, b"", frame.kind, frame.message_id)
        )

    def _after(self, delay_ns: int, action: Callable[[], None]) -> None:
        self._step += 1
        step = self._step
        self._clock.call_after(delay_ns, lambda _: action() if self._step == step else None)
