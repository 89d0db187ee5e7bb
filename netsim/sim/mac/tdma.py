"""TDMA: every node sends in a slot of its own, and sleeps while neither it nor a neighbour has to send.

Slots are counted by the node's own clock from time 0. In its slot a node waits for the guard time, turns its radio round
and sends one frame, whose acknowledgement comes within the slot; a frame that is not acknowledged goes out again one frame
of slots later. Clocks that differ by no more than the guard time do no harm; beyond that senders reach into each other's
slots and into their listeners' sleep.
"""

from collections.abc import Callable
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.models.devices import RadioDevice
from netsim.parameters import NonNegative, Positive, PositiveInt, Probability, parameters
from netsim.sim.clock import Clock
from netsim.sim.frames import ACK_PSDU_BYTE, LinkFrame
from netsim.sim.mac.exchange import Incoming, Outgoing, ack_wait_ns
from netsim.sim.mac.link import Deliver, LinkJob, QueuedMac
from netsim.sim.mac.slots import SlotPlan
from netsim.sim.mac.timer import LocalTime, Timer, TrueTime
from netsim.sim.medium import CCA_SYMBOLS
from netsim.sim.radio import Radio
from netsim.units import NS_PER_MS


@parameters
class TdmaParameters:
    """Slots assigned at the start so that no two nodes within two hops of each other send at the same time.

    The assignment knows every link (see `min_prr`); nodes that move keep their slots.
    """

    type: Literal["tdma"] = "tdma"
    slot_ms: Positive = 10.0
    """Length of a slot: guard time, frame and acknowledgement must fit (10 ms in IEEE 802.15.4e TSCH)."""
    guard_ms: NonNegative = 1.0
    """A sender waits this long into its slot, and is done this long before its end: clocks may differ by as much."""
    frame_slots: PositiveInt | None = None
    """Slots after which they repeat; by default as many as the assignment needs."""
    min_prr: Probability = 0.1
    """Nodes with a better link than this, in either direction, count as neighbours."""
    listen: Literal["neighbours", "always"] = "neighbours"
    """`neighbours`: the radio is on in their slots, and in its own when there is something to send; it leaves a slot in
    which nobody has begun after two guard times, a turnaround and an assessment of the channel (but over the ideal medium,
    where a channel cannot be sensed, only at its end). `always`: it never sleeps."""
    acknowledge: bool = True
    """Whether unicast frames ask for an acknowledgement."""
    max_retries: Annotated[int, Ge(0), Le(30)] = 3
    """Retransmissions without acknowledgement before the frame is given up as `no_ack`."""
    queue_frames: PositiveInt = 64
    """Frames that can wait; more are dropped as `queue_full`."""

    def busy_ns(self, device: RadioDevice) -> int:
        """What a slot must hold: guard times, turnarounds, the longest frame, its acknowledgement."""
        frames_ns = device.airtime_ns(device.max_psdu_byte) + device.airtime_ns(ACK_PSDU_BYTE)
        return 2 * round(self.guard_ms * NS_PER_MS) + 2 * device.turnaround_ns + frames_ns


class TdmaMac(QueuedMac):
    """See the module. `sleep` keeps the radio off but for its own slots, `wake` returns to the schedule.

    Args:
        clock: Simulated time.
        radio: This node's radio; the MAC takes over its callbacks.
        first: Number before that of its first frame, 0 to 255.
        parameters: Settings.
        plan: The slots that concern it.
        deliver: Where received packets go.
        channel_busy: Whether anything was on the channel within the last so many nanoseconds; None where that cannot be
            known.
        local: The node's own clock; a clock that is right by default.
    """

    _begins_awake = False

    def __init__(
        self,
        clock: Clock,
        radio: Radio,
        first: int,
        parameters: TdmaParameters,
        plan: SlotPlan,
        deliver: Deliver,
        channel_busy: Callable[[int], bool] | None,
        local: LocalTime | None = None,
    ) -> None:
        super().__init__(radio, parameters.queue_frames)
        self._parameters = parameters
        self._plan = plan
        self._local: LocalTime = local or TrueTime(clock)
        self._slot_ns = round(parameters.slot_ms * NS_PER_MS)
        self._guard_ns = round(parameters.guard_ms * NS_PER_MS)
        assessment_ns = CCA_SYMBOLS * radio.device.symbol_ns
        self._look_ns = 2 * self._guard_ns + radio.device.turnaround_ns + assessment_ns
        self._channel_busy = channel_busy
        self._ack_wait_ns = ack_wait_ns(radio.device)
        self._sending = Timer(clock)
        self._listening = Timer(clock)
        self._outgoing = Outgoing(radio.node, first, parameters.acknowledge)
        self._incoming = Incoming(radio, deliver)
        self._in_own_slot = False
        self._listens = True
        radio.on_overhear = self._on_ack

    # --- the radio's day: on in the slots of neighbours -------------------------------------------------------------

    def sleep(self) -> None:
        """See `Mac.sleep`."""
        super().sleep()
        self._rest()

    def wake(self) -> None:
        """See `Mac.wake`."""
        self._wants_sleep = False
        if self._listens:
            self._radio.wake()

    def stop(self) -> None:
        """See `Mac.stop`."""
        super().stop()
        self._sending.cancel()
        self._listening.cancel()
        self._incoming.forget()
        self._in_own_slot = False

    def _on_started(self) -> None:
        if self._parameters.listen == "neighbours":
            self._follow(self._slot_now)

    @property
    def _slot_now(self) -> int:
        return self._local.local_ns() // self._slot_ns

    def _follow(self, index: int) -> None:
        """Sleep until a neighbour may send, in slot `index` or later; listen on if that is now."""
        begin = self._plan.next_heard(index)
        wake_ns = (index if begin is None else begin) * self._slot_ns - self._radio.device.wake_ns
        self._listens = begin is not None and self._local.delay_until(wake_ns) == 0
        self._rest()
        if begin is not None:
            self._at(self._listening, wake_ns, lambda: self._listen_in(begin), self._follow_anew)

    def _follow_anew(self) -> None:
        self._follow(self._slot_now)

    def _listen_in(self, slot: int) -> None:
        self._listens = True
        if not self._wants_sleep:
            self._radio.wake()
        if self._channel_busy is None:
            self._listen_through(slot)
        else:
            self._at(self._listening, slot * self._slot_ns + self._look_ns, lambda: self._look(slot), self._follow_anew)

    def _look(self, slot: int) -> None:
        """By now a neighbour whose clock is right enough has begun; if none has, this slot is left out."""
        if self._channel_busy is not None and self._channel_busy(self._look_ns):
            self._listen_through(slot)
        else:
            self._follow(max(slot + 1, self._slot_now))

    def _listen_through(self, slot: int) -> None:
        after = slot + 1
        follow = lambda: self._follow(max(after, self._slot_now))  # noqa: E731
        self._at(self._listening, after * self._slot_ns, follow, self._follow_anew)

    def _rest(self) -> None:
        """Sleep unless this slot is a neighbour's, or its own and in use."""
        if not self._in_own_slot and (self._wants_sleep or not self._listens) and self._radio.can_transmit:
            self._radio.sleep()

    def _at(self, timer: Timer, local_ns: int, action: Callable[[], None], anew: Callable[[], None]) -> None:
        """Do something when the node's own clock shows a time; if it was set back by more than a frame, plan anew."""

        def due() -> None:
            left_ns = self._local.delay_until(local_ns)
            if left_ns > self._plan.frame_slots * self._slot_ns:
                anew()
            elif left_ns > 0:
                self._at(timer, local_ns, action, anew)
            else:
                action()

        timer.after(self._local.delay_until(local_ns), due, last=True)

    # --- its own slot -----------------------------------------------------------------------------------------------

    @property
    def _attempts_made(self) -> int:
        return self._outgoing.attempt

    def _begin(self, job: LinkJob) -> None:
        self._outgoing.begin()
        self._await_slot()

    def _await_slot(self) -> None:
        """Be ready at the start of the next own slot that the radio can make."""
        self._in_own_slot = False
        wake_ns = self._radio.device.wake_ns
        earliest_ns = self._local.local_ns() + (0 if self._radio.is_awake else wake_ns)
        start_ns = self._plan.next_own(-(-earliest_ns // self._slot_ns)) * self._slot_ns
        self._at(self._sending, start_ns - wake_ns, lambda: self._prepare(start_ns), self._await_slot)
        self._rest()

    def _prepare(self, start_ns: int) -> None:
        self._in_own_slot = True
        self._radio.wake()
        self._at(self._sending, start_ns + self._guard_ns, self._send, self._await_slot)

    def _send(self) -> None:
        if self._job is not None and self._radio.can_transmit:
            self._radio.transmit(self._outgoing.frame(self._job))
        else:  # it still answers somebody: clocks have drifted apart
            self._await_slot()

    def _on_ready(self) -> None:
        self._proceed()
        self._rest()

    def _on_transmitted(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            return
        self._outgoing.attempt += 1
        if frame.wants_ack:
            self._outgoing.awaits_ack = True
            self._sending.after(self._ack_wait_ns, self._ack_missing)
        else:
            self._end_exchange("")

    def _ack_missing(self) -> None:
        self._outgoing.awaits_ack = False
        if self._outgoing.attempt > self._parameters.max_retries:
            self._end_exchange("no_ack")
        else:
            self._await_slot()

    def _end_exchange(self, reason: str) -> None:
        self._outgoing.awaits_ack = False
        self._in_own_slot = False
        self._sending.cancel()
        self._finish(reason, self._outgoing.attempt)

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_ack:
            self._on_ack(frame)
        elif frame.is_for(self._radio.node):
            self._incoming.take(frame)

    def _on_ack(self, frame: LinkFrame) -> None:
        if self._outgoing.is_answered_by(frame):
            self._end_exchange("")
