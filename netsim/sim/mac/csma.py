"""Unslotted CSMA-CA with acknowledgement and retries, IEEE 802.15.4-2006 clauses 7.5.1.4 and 7.5.6.4.

A callback state machine: back off a random number of unit periods, assess the channel, turn round and send, wait for the
acknowledgement.
"""

from collections.abc import Callable
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.parameters import NonNegativeInt, PositiveInt, parameters
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.exchange import UNIT_BACKOFF_SYMBOLS, Incoming, Outgoing, ack_wait_ns
from netsim.sim.mac.link import Deliver, LinkJob, QueuedMac
from netsim.sim.mac.timer import Timer
from netsim.sim.medium import CCA_SYMBOLS
from netsim.sim.radio import Radio

SIFS_SYMBOLS = 12
LIFS_SYMBOLS = 40
SIFS_LIMIT_BYTE = 18
"""aMaxSIFSFrameSize."""


@parameters
class CsmaParameters:
    """Unslotted CSMA-CA of IEEE 802.15.4-2006; the defaults are the standard's.

    Other stacks set: Contiki-NG max_backoffs 5, max_retries 7; Castalia min_be 5, max_be 7, max_retries 2; INET
    ack_wait_symbols 35 (560 us). TOSSIM's back-off is not exponential and cannot be set. The standard's battery life
    extension concerns the slotted kind only.
    """

    type: Literal["csma"] = "csma"
    min_be: Annotated[int, Ge(0), Le(8)] = 3
    """Back-off exponent of the first assessment (macMinBE): 0 to 2^min_be - 1 unit periods; 0 assesses at once."""
    max_be: Annotated[int, Ge(3), Le(8)] = 5
    """Largest back-off exponent (macMaxBE)."""
    max_backoffs: Annotated[int, Ge(0), Le(5)] = 4
    """Busy assessments before the frame is given up as `channel_busy`, less one (macMaxCSMABackoffs)."""
    max_retries: Annotated[int, Ge(0), Le(30)] = 3
    """Retransmissions without acknowledgement before the frame is given up as `no_ack` (macMaxFrameRetries)."""
    unit_backoff_symbols: PositiveInt = UNIT_BACKOFF_SYMBOLS
    """Unit back-off period (aUnitBackoffPeriod): 20 symbols, 320 us at 2.4 GHz."""
    cca_symbols: PositiveInt = CCA_SYMBOLS
    """Length of a clear channel assessment: 8 symbols, 128 us at 2.4 GHz (6.9.9)."""
    cca_mode: Literal["energy", "carrier", "either"] = "either"
    """What makes the channel busy: `energy` above the radio's threshold (mode 1), a `carrier` that was caught (mode 2), or
    `either` (mode 3)."""
    ack_wait_symbols: PositiveInt | None = None
    """How long to wait for an acknowledgement (macAckWaitDuration); by default unit back-off, turnaround and
    acknowledgement of the radio: 54 symbols, 864 us, at 2.4 GHz."""
    queue_frames: PositiveInt = 64
    """Frames that can wait; more are dropped as `queue_full`."""
    acknowledge: bool = True
    """Whether unicast frames ask for an acknowledgement."""
    lifs_symbols: NonNegativeInt = LIFS_SYMBOLS
    """Rest after a frame of more than 18 bytes (macMinLIFSPeriod): 40 symbols, 640 us at 2.4 GHz."""
    sifs_symbols: NonNegativeInt = SIFS_SYMBOLS
    """Rest after a shorter frame (macMinSIFSPeriod): 12 symbols, 192 us at 2.4 GHz."""

    def __post_init__(self) -> None:
        """Refuse exponents in the wrong order."""
        if self.min_be > self.max_be:
            message = "min_be of at most max_be"
            raise ValueError(message)


Assess = Callable[[int, str], bool]
"""Whether the channel at this node was busy in the last so many nanoseconds, in a mode of `CsmaParameters.cca_mode`."""


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
        channel_busy: Assess,
        uniform: Callable[[], float],
        parameters: CsmaParameters,
        deliver: Deliver,
    ) -> None:
        super().__init__(radio, parameters.queue_frames)
        self._clock = clock
        self._channel_busy = channel_busy
        self._uniform = uniform
        self._parameters = parameters
        self._timer = Timer(clock)
        self._outgoing = Outgoing(radio.node, int(uniform() * 256), parameters.acknowledge)
        self._incoming = Incoming(radio, deliver)
        symbol_ns, waits = radio.device.symbol_ns, parameters.ack_wait_symbols
        self._period_ns = parameters.unit_backoff_symbols * symbol_ns
        self._cca_ns = parameters.cca_symbols * symbol_ns
        self._ack_wait_ns = ack_wait_ns(radio.device) if waits is None else waits * symbol_ns
        self._backoffs = 0
        self._exponent = parameters.min_be
        self._spaced_until_ns = 0  # end of the inter-frame space
        self._sent_byte = 0
        radio.on_overhear = self._on_overhear

    def stop(self) -> None:
        """See `Mac.stop`."""
        super().stop()
        self._timer.cancel()
        self._incoming.forget()

    @property
    def _attempts_made(self) -> int:
        return self._outgoing.attempt

    def _begin(self, job: LinkJob) -> None:
        self._outgoing.begin()
        self._contend()

    def _contend(self) -> None:
        self._backoffs = 0
        self._exponent = self._parameters.min_be
        self._back_off()

    def _back_off(self) -> None:
        periods = int(self._uniform() * 2**self._exponent)
        spacing_ns = max(0, self._spaced_until_ns - self._clock.now_ns)
        self._timer.after(spacing_ns + periods * self._period_ns + self._cca_ns, self._assess)

    def _assess(self) -> None:
        if self._radio.can_transmit and not self._channel_busy(self._cca_ns, self._parameters.cca_mode):
            self._transmit()
            return
        self._backoffs += 1
        self._exponent = min(self._exponent + 1, self._parameters.max_be)
        if self._backoffs > self._parameters.max_backoffs:
            self._end_exchange("channel_busy")
        else:
            self._back_off()

    def _transmit(self) -> None:
        if self._job is not None:
            self._radio.transmit(self._outgoing.frame(self._job))

    def _on_transmitted(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._proceed()
            return
        self._outgoing.attempt += 1
        self._sent_byte = frame.psdu_byte
        self._space_after(frame.psdu_byte)
        if frame.wants_ack:
            self._outgoing.awaits_ack = True
            self._timer.after(self._ack_wait_ns, self._ack_missing)
        else:
            self._end_exchange("")

    def _space_after(self, psdu_byte: int) -> None:
        """Leave room after a frame, or after its acknowledgement where one came (7.5.1.3)."""
        is_short = psdu_byte <= SIFS_LIMIT_BYTE
        symbols = self._parameters.sifs_symbols if is_short else self._parameters.lifs_symbols
        self._spaced_until_ns = self._clock.now_ns + symbols * self._radio.device.symbol_ns

    def _ack_missing(self) -> None:
        self._outgoing.awaits_ack = False
        if self._outgoing.attempt > self._parameters.max_retries:
            self._end_exchange("no_ack")
        else:
            self._contend()

    def _end_exchange(self, reason: str) -> None:
        """The job is done, or given up for a reason: no timer of it counts any more."""
        self._outgoing.awaits_ack = False
        self._timer.cancel()
        self._finish(reason, self._outgoing.attempt)

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._on_ack(frame)
        elif frame.is_for(self._radio.node):
            self._incoming.take(frame)

    def _on_overhear(self, frame: LinkFrame) -> None:
        self._on_ack(frame)

    def _on_ack(self, frame: LinkFrame) -> None:
        if self._outgoing.is_answered_by(frame):
            self._space_after(self._sent_byte)
            self._end_exchange("")
