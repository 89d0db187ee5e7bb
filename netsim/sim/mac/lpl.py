"""Low-power listening in its two classic timings: strobed (X-MAC) and with a long preamble (B-MAC).

A sender backs off, makes sure that the channel has been clear for longer than a gap between strobes, and sends strobes for
as long as a check of its receiver can be away. With X-MAC it stops as soon as the receiver answers one; the data follow,
and their acknowledgement. With B-MAC, and for broadcasts, it sends them all and the data at the end; B-MAC's follow each
other without a gap. All energy is booked: strobes as `strobe_transmit` and `strobe_receive` under the message they announce,
what wakes in vain as listening and overhearing.
"""

from collections.abc import Callable

from netsim.api import BROADCAST
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.exchange import Incoming, Outgoing
from netsim.sim.mac.link import Deliver, LinkJob, QueuedMac
from netsim.sim.mac.lpl_timing import LplParameters, lpl_timing
from netsim.sim.mac.sampler import Sampler
from netsim.sim.mac.timer import Timer
from netsim.sim.radio import Radio

APART, ASSESS, TRAIN, DATA = "apart", "assess", "train", "data"
"""What the sender is at: nothing or backing off; assessing the channel; sending strobes; data sent, acknowledgement due."""

MOST_DOUBLINGS = 3


class LplMac(QueuedMac):
    """See the module.

    `sleep` ends the sampling: nothing is received, but jobs are still sent. `wake` goes back to sampling, not to a radio
    that is always on.

    Args:
        clock: Simulated time.
        radio: This node's radio; the MAC takes over its callbacks.
        channel_busy: Clear channel assessment at this node: over how long, in which mode, from which power on.
        uniform: Draws of the node's back-off stream, in [0, 1): sequence number, first check, back-offs.
        parameters: Settings.
        deliver: Where received packets go.
    """

    _begins_awake = False

    def __init__(
        self,
        clock: Clock,
        radio: Radio,
        channel_busy: Callable[[int, str, float], bool],
        uniform: Callable[[], float],
        parameters: LplParameters,
        deliver: Deliver,
    ) -> None:
        super().__init__(radio, parameters.queue_frames)
        self._clock = clock
        self._uniform = uniform
        self._parameters = parameters
        self._timing = lpl_timing(parameters, radio.device)
        self._busy: Callable[[int], bool] = lambda duration_ns: channel_busy(
            duration_ns, "either", parameters.sample_threshold_dbm
        )
        self._outgoing = Outgoing(radio.node, int(uniform() * 256), parameters.acknowledge)
        self._incoming = Incoming(radio, deliver)
        self._sampler = Sampler(clock, radio, self._timing, parameters.samples, self._busy, self._relax)
        self._timer = Timer(clock)
        self._phase = APART
        self._is_waking = False
        self._backoffs = 0
        self._train_until_ns = 0
        radio.on_overhear = self._on_overhear

    # --- the radio's day --------------------------------------------------------------------------------------------

    def sleep(self) -> None:
        """See `Mac.sleep`."""
        self._sampler.is_paused = True
        self._sampler.release()
        super().sleep()
        self._rest()

    def wake(self) -> None:
        """See `Mac.wake`."""
        self._wants_sleep = False
        self._sampler.is_paused = False

    def stop(self) -> None:
        """See `Mac.stop`."""
        super().stop()
        self._sampler.stop()
        self._timer.cancel()
        self._incoming.forget()
        self._phase = APART
        self._is_waking = False

    def _on_started(self) -> None:
        self._sampler.start(int(self._uniform() * self._timing.interval_ns))
        self._rest()

    def _on_ready(self) -> None:
        if self._is_waking:
            self._is_waking = False
            self._timer.after(self._timing.clear_ns, self._assess, last=True)
        elif not self._sampler.ready():
            self._relax()

    def _relax(self) -> None:
        """Go on with the next job, or sleep if nothing needs the radio."""
        self._proceed()
        self._rest()

    def _rest(self) -> None:
        """Sleep unless it is sending or expects something."""
        if self._phase == APART and self._sampler.may_rest and self._radio.can_transmit:
            self._radio.sleep()

    # --- sending ----------------------------------------------------------------------------------------------------

    @property
    def _attempts_made(self) -> int:
        return self._outgoing.attempt + (self._phase in (TRAIN, DATA))

    def _begin(self, job: LinkJob) -> None:
        self._outgoing.begin()
        self._backoffs = 0
        self._back_off(round(self._parameters.backoff_ms * 1e6))

    def _back_off_after(self, failures: int) -> None:
        """Wait for wake intervals, twice as many after every failure."""
        self._back_off(self._timing.interval_ns << min(failures - 1, MOST_DOUBLINGS))

    def _back_off(self, window_ns: int) -> None:
        self._phase = APART
        self._timer.after(int(self._uniform() * window_ns), self._wake_up, last=True)
        self._rest()

    def _wake_up(self) -> None:
        """Listen for long enough to know that nobody sends."""
        self._phase = ASSESS
        self._sampler.yield_radio()
        self._is_waking = not self._radio.is_awake
        if self._is_waking:
            self._radio.wake()
        else:
            self._timer.after(self._timing.clear_ns, self._assess, last=True)

    def _assess(self) -> None:
        if self._radio.can_transmit and not self._busy(self._timing.clear_ns):
            self._phase = TRAIN
            self._train_until_ns = self._clock.now_ns + self._timing.train_ns
            self._strobe(straight_on=False)
            return
        self._backoffs += 1
        if self._backoffs > self._parameters.max_backoffs:
            self._end_exchange("channel_busy", self._outgoing.attempt)
        else:
            self._back_off_after(self._backoffs)

    def _strobe(self, straight_on: bool) -> None:
        if self._job is not None:
            has_address = self._parameters.variant == "x-mac"
            destination = self._job.destination if has_address else BROADCAST
            self._radio.transmit(self._outgoing.strobe(self._job, destination, self._timing.strobe_byte), straight_on)

    def _send_data(self, straight_on: bool = False) -> None:
        self._phase = DATA
        if self._job is not None:
            self._radio.transmit(self._outgoing.frame(self._job), straight_on)

    def _on_transmitted(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            return
        if frame.is_strobe:
            self._strobe_sent(frame)
        elif frame.wants_ack:
            self._outgoing.awaits_ack = True
            self._timer.after(self._timing.ack_wait_ns, self._attempt_failed, last=True)
        else:
            self._end_exchange("", self._outgoing.attempt + 1)

    def _strobe_sent(self, frame: LinkFrame) -> None:
        if self._parameters.variant == "x-mac":
            self._outgoing.awaits_ack = frame.destination != BROADCAST
            self._timer.after(self._timing.gap_ns, self._gap_over, last=True)
        elif self._clock.now_ns < self._train_until_ns:
            self._strobe(straight_on=True)
        else:
            self._send_data(straight_on=True)

    def _gap_over(self) -> None:
        """Nobody answered the strobe: the next one, or the end of the train."""
        self._outgoing.awaits_ack = False
        if self._job is None:
            return
        if not self._radio.can_transmit:  # it answers somebody else
            self._timer.after(self._timing.gap_ns, self._gap_over, last=True)
        elif self._clock.now_ns < self._train_until_ns:
            self._strobe(straight_on=False)
        elif self._job.destination == BROADCAST:
            self._send_data()
        else:
            self._attempt_failed()

    def _attempt_failed(self) -> None:
        self._outgoing.awaits_ack = False
        self._outgoing.attempt += 1
        if self._outgoing.attempt > self._parameters.max_retries:
            self._end_exchange("no_ack", self._outgoing.attempt)
        else:
            self._backoffs = 0
            self._back_off_after(self._outgoing.attempt)

    def _end_exchange(self, reason: str, attempts: int) -> None:
        self._outgoing.awaits_ack = False
        self._phase = APART
        self._timer.cancel()
        self._finish(reason, attempts)

    # --- receiving --------------------------------------------------------------------------------------------------

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._on_ack(frame)
        elif frame.is_strobe:
            self._on_strobe(frame)
        elif frame.is_for(self._radio.node):
            self._sampler.hold()
            self._incoming.take(frame)

    def _on_strobe(self, frame: LinkFrame) -> None:
        """Wait for the data; answer if it is asked for this node alone, putting off strobes of one's own."""
        self._sampler.hold()
        if frame.destination == BROADCAST or self._phase == DATA or not self._radio.can_transmit:
            return
        self._incoming.acknowledge(frame)
        if self._phase == TRAIN:
            self._outgoing.awaits_ack = False
            self._timer.after(self._timing.listen_ns, self._gap_over, last=True)

    def _on_overhear(self, frame: LinkFrame) -> None:
        if frame.is_strobe:
            self._sampler.dismiss()
        else:
            self._on_ack(frame)

    def _on_ack(self, frame: LinkFrame) -> None:
        if not self._outgoing.is_answered_by(frame):
            return
        self._outgoing.awaits_ack = False
        if self._phase == TRAIN:
            self._timer.cancel()
            self._send_data()
        else:
            self._end_exchange("", self._outgoing.attempt + 1)
