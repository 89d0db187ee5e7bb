"""Pure ALOHA: send when there is something to send (Abramson, AFIPS 1970), with duty-cycle limit as in LoRaWAN.

Without acknowledgement and with frames of one length it is the textbook's: a share exp(-2G) of the frames meets no other,
G being the frames offered per airtime.
"""

from collections.abc import Callable
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.exchange import Incoming, Outgoing, ack_wait_ns
from netsim.sim.mac.link import Deliver, LinkJob, QueuedMac
from netsim.sim.mac.timer import Timer
from netsim.sim.radio import Radio
from netsim.units import s_to_ns

MOST_DOUBLINGS = 10


@parameters
class AlohaParameters:
    """Pure ALOHA: no carrier sense; a frame goes out at once."""

    type: Literal["aloha"] = "aloha"
    initial_delay_s: NonNegative = 0.0
    """A new frame waits a random time, even between 0 and this: nodes that hear the same thing do not all answer at once."""
    acknowledge: bool = False
    """Whether unicast frames ask for an acknowledgement."""
    max_retries: Annotated[int, Ge(0), Le(30)] = 3
    """Retransmissions without acknowledgement before the frame is given up as `no_ack`."""
    backoff_s: Positive = 0.1
    """Before the n-th retry it waits a random time, even between 0 and 2^n times this (n at most 10)."""
    duty_cycle: Annotated[float, Gt(0), Le(1)] = 1.0
    """Greatest share of time on the air. After a frame of airtime T the node sends none for T (1 / duty_cycle - 1), as
    LoRaWAN 1.0 has it, so that ETSI EN 300 220's limit (0.01 in most sub-bands) holds over any time. Acknowledgements
    count, but do not wait."""
    queue_frames: PositiveInt = 64
    """Frames that can wait; more are dropped as `queue_full`."""


class AlohaMac(QueuedMac):
    """See the module.

    Args:
        clock: Simulated time.
        radio: This node's radio; the MAC takes over its callbacks.
        uniform: Draws of the node's back-off stream, in [0, 1).
        parameters: Settings.
        deliver: Where received packets go.
    """

    def __init__(
        self,
        clock: Clock,
        radio: Radio,
        uniform: Callable[[], float],
        parameters: AlohaParameters,
        deliver: Deliver,
    ) -> None:
        super().__init__(radio, parameters.queue_frames)
        self._clock = clock
        self._uniform = uniform
        self._parameters = parameters
        self._timer = Timer(clock)
        self._outgoing = Outgoing(radio.node, int(uniform() * 256), parameters.acknowledge)
        self._incoming = Incoming(radio, deliver)
        self._ack_wait_ns = ack_wait_ns(radio.device)
        self._silent_until_ns = 0
        self._is_due = False  # a frame waits for the radio to finish with another
        radio.on_overhear = self._on_ack

    def stop(self) -> None:
        """See `Mac.stop`."""
        super().stop()
        self._timer.cancel()
        self._incoming.forget()
        self._is_due = False

    @property
    def _attempts_made(self) -> int:
        return self._outgoing.attempt

    def _begin(self, job: LinkJob) -> None:
        self._outgoing.begin()
        self._send_within(self._parameters.initial_delay_s)

    def _send_within(self, window_s: float) -> None:
        """Send after a random part of a window, and not before the duty cycle allows it."""
        delay_ns = int(self._uniform() * s_to_ns(window_s)) if window_s > 0.0 else 0
        silent_ns = self._silent_until_ns - self._clock.now_ns
        self._timer.after(max(0, delay_ns, silent_ns), self._send, last=True)

    def _send(self) -> None:
        """Send, unless an acknowledgement has to go out first or has used up the air meanwhile."""
        self._is_due = not self._radio.can_transmit
        if self._job is None or self._is_due:
            return
        if self._silent_until_ns > self._clock.now_ns:
            self._send_within(0.0)
        else:
            self._radio.transmit(self._outgoing.frame(self._job))

    def _on_ready(self) -> None:
        if self._is_due:
            self._send()
        else:
            self._proceed()

    def _on_transmitted(self, frame: LinkFrame) -> None:
        airtime_ns = self._radio.device.airtime_ns(frame.psdu_byte)
        pause_ns = round(airtime_ns * (1.0 / self._parameters.duty_cycle - 1.0))
        self._silent_until_ns = max(self._silent_until_ns, self._clock.now_ns) + pause_ns
        if frame.is_ack:
            return
        self._outgoing.attempt += 1
        if frame.wants_ack:
            self._outgoing.awaits_ack = True
            self._timer.after(self._ack_wait_ns, self._ack_missing)
        else:
            self._end_exchange("")

    def _ack_missing(self) -> None:
        self._outgoing.awaits_ack = False
        attempts = self._outgoing.attempt
        if attempts > self._parameters.max_retries:
            self._end_exchange("no_ack")
        else:
            self._send_within(self._parameters.backoff_s * 2.0 ** min(attempts, MOST_DOUBLINGS))

    def _end_exchange(self, reason: str) -> None:
        self._outgoing.awaits_ack = False
        self._timer.cancel()
        self._finish(reason, self._outgoing.attempt)

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._on_ack(frame)
        elif frame.is_for(self._radio.node):
            self._incoming.take(frame)

    def _on_ack(self, frame: LinkFrame) -> None:
        if self._outgoing.is_answered_by(frame):
            self._end_exchange("")
