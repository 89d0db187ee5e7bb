"""The radio as a state machine that announces its power draw: off, sleep, idle, listen, receive, transmit, switch, dead."""

from collections.abc import Callable
from typing import Protocol

from netsim.errors import InvariantError
from netsim.models.devices import RadioDevice
from netsim.sim.clock import Clock
from netsim.sim.energy import Meter
from netsim.sim.frames import LinkFrame, Transmission
from netsim.trace.events import RADIO_STATE_CODE, RadioState
from netsim.trace.recorder import Recorder


class Medium(Protocol):
    """The shared air, as a radio sees it."""

    def begin(self, radio: "Radio", frame: LinkFrame) -> Transmission:
        """Put a frame on the air now; its end is the medium's to announce (`Radio.transmission_ended`)."""
        ...

    def settle(self, node: int) -> None:
        """Tell the node's radio what it heard since the last time (`Radio.heard`)."""
        ...

    def abort(self, transmission: Transmission) -> None:
        """The sender died half-way: nobody can decode the frame, and its signal is gone."""
        ...

    def listening(self, node: int, since_ns: int) -> None:
        """A node's receiver is open for signals that begin at `since_ns` or later."""
        ...

    def stopped_listening(self, node: int, outcome: str) -> None:
        """A node's receiver turned away, also from whatever it was locked on; `outcome` is what it misses from now on."""
        ...


class Radio:
    """One node's transceiver.

    Half duplex: it hears only in the states listen and receive. `listens_since_ns` tells whether it could hear a signal
    from its first symbol, independent of the order in which simultaneous events are handled.

    Args:
        clock: Simulated time.
        node: The node's id.
        device: Power draws and timings.
        tx_power_dbm: Output power.
        meter: Where the draw is announced.
        medium: The shared air.
        recorder: For `RadioState` events.
        all_states: Record every state change (detail `full`), not only sleep, wake, crash and death.

    Attributes:
        on_receive: Called with each frame that was decoded and is for this node.
        on_overhear: Called with those decoded frames for others that concern everybody (`LinkFrame.concerns_all`).
        on_transmitted: Called with each frame whose last symbol has just been sent.
        on_ready: Called when it listens again after start-up or turnaround.
        on_started: Called when it was powered up, at the start of the run or after a reboot.
    """

    def __init__(
        self,
        clock: Clock,
        node: int,
        device: RadioDevice,
        tx_power_dbm: float,
        meter: Meter,
        medium: Medium,
        recorder: Recorder,
        all_states: bool = False,
    ) -> None:
        self._clock = clock
        self.node = node
        self.device = device
        self.tx_power_dbm = tx_power_dbm
        self._transmit_mw = device.transmit_power_mw(tx_power_dbm)
        self._meter = meter
        self._medium = medium
        self._recorder = recorder
        self._all_states = all_states
        self.state = "off"
        self.listens_since_ns: int | None = None
        self._waking = False
        self._is_away = False  # has slept or been off, and is not yet back; the first start is no return
        self._transmission: Transmission | None = None
        self._era = 0  # counts state changes, so that a delayed one knows when it is out of date
        self._life = 0  # counts the times it fell silent, for the same reason
        self.on_receive: Callable[[LinkFrame], None] = lambda frame: None
        self.on_overhear: Callable[[LinkFrame], None] = lambda frame: None
        self.on_transmitting: Callable[[LinkFrame], None] = lambda frame: None
        self.on_transmitted: Callable[[LinkFrame], None] = lambda frame: None
        self.on_ready: Callable[[], None] = lambda: None
        self.on_started: Callable[[], None] = lambda: None

    @property
    def is_listening(self) -> bool:
        """Whether the receiver is on and not locked on a frame."""
        return self.state == "listen" or (self.state == "switch" and self.could_hear_since(self._clock.now_ns))

    @property
    def is_awake(self) -> bool:
        """Whether it is neither off, asleep, idle, dead nor still starting up."""
        return self.state not in ("off", "sleep", "idle", "dead") and not self._waking

    @property
    def is_sending(self) -> bool:
        """Whether a frame is going out, is about to, or has just gone out; starting up is not sending."""
        return self.state == "transmit" or (self.state == "switch" and not self._waking)

    @property
    def can_transmit(self) -> bool:
        """Whether a frame can be started: awake and neither transmitting nor about to."""
        return self.state in ("listen", "receive") or self.is_listening

    def could_hear_since(self, start_ns: int) -> bool:
        """Whether a signal that began at `start_ns` met an open receiver."""
        return self.listens_since_ns is not None and self.listens_since_ns <= start_ns

    def start(self) -> None:
        """Power up straight into listening, at the start of the run or after a crash."""
        self.listens_since_ns = self._clock.now_ns
        self._medium.listening(self.node, self.listens_since_ns)
        self._listen()
        self.on_started()

    def transmit(self, frame: LinkFrame, straight_on: bool = False) -> None:
        """Switch to transmit (turnaround time), send the frame, switch back to listen.

        Args:
            frame: What to send.
            straight_on: Follow the frame that has ended at this instant without a gap; to be used in `on_transmitted`.

        Raises:
            InvariantError: If the radio cannot send: a MAC must wake it first, and send one frame after the other.
        """
        is_committed = self.state == "switch" and self.listens_since_ns is None
        if not self.is_awake or is_committed or self._transmission is not None:
            message = f"the radio of node {self.node} was told to send at {self._clock.now_ns} ns in state {self.state}"
            raise InvariantError(message)
        self._turn_away("half_duplex")
        if straight_on:
            self._transmit_now(frame)
            return
        self._enter("switch", self.device.switching_mw, "switch", frame.kind)
        self._later(self.device.turnaround_ns, lambda: self._transmit_now(frame))

    def transmission_ended(self, transmission: Transmission) -> None:
        """The medium tells that this radio's frame has left the air."""
        if self._transmission is not transmission:
            return  # it died or crashed at this very instant
        self._transmission = None
        self._enter("switch", self.device.switching_mw, "switch", transmission.frame.kind)
        self._ready_in(self.device.turnaround_ns)
        self.on_transmitted(transmission.frame)

    @property
    def follows_receptions(self) -> bool:
        """Whether each reception must be told (`locked`, `reception_ended`): where it draws other power, or is recorded.

        Elsewhere the medium only sums up the time of receptions, which is taken from the listening time (`heard`).
        """
        return self._all_states or self.device.receive_mw != self.device.listen_mw

    def heard(self, label: str, kind: str, time_ns: int) -> None:
        """So much of the time booked as listening was spent on receptions."""
        self._meter.move("listen", "", label, kind, time_ns)

    def settle(self) -> None:
        """Book what was drawn until now, receptions included."""
        self._meter.settle()
        self._medium.settle(self.node)

    def locked(self) -> None:
        """The receiver synchronised on a preamble."""
        self._enter("receive", self.device.receive_mw, "receive", "")

    def reception_broken(self, label: str, kind: str) -> None:
        """It turns away from the frame it was locked on."""
        self._meter.relabel(label, kind)

    def reception_ended(self, label: str, kind: str) -> None:
        """The frame it was locked on is over; `label` is what the ledger books the time under."""
        self._meter.relabel(label, kind)
        self._enter("listen", self.device.listen_mw, "listen")

    def sleep(self) -> None:
        """Turn the receiver off. Only from listen, receive or idle; the MAC sees to that."""
        self._turn_away("asleep")
        self._enter("sleep", self.device.power_down_mw, "sleep")

    def idle(self) -> None:
        """Turn the receiver off but keep the oscillator running. Only from listen or receive; the MAC sees to that."""
        self._turn_away("asleep")
        self._enter("idle", self.device.idle_mw, "idle")

    def wake(self) -> None:
        """Turn on again; it listens after the start-up time, from idle after a shorter one."""
        if self.state == "sleep":
            self._start_up(self.device.wake_mw, self.device.wake_ns)
        elif self.state == "idle":
            self._start_up(self.device.switching_mw, self.device.idle_wake_ns)

    def die(self) -> None:
        """The battery is empty: fall silent at once."""
        self._fall_silent("dead", 0.0)

    def power_off(self) -> None:
        """The node crashed: fall silent at once, until `start`."""
        self._fall_silent("off", self.device.off_mw)

    def _fall_silent(self, state: str, power_mw: float) -> None:
        transmission, self._transmission = self._transmission, None
        self._life += 1
        self._turn_away("dead")
        self._enter(state, power_mw, state)
        if transmission is not None:
            self._medium.abort(transmission)

    def _transmit_now(self, frame: LinkFrame) -> None:
        self._enter("transmit", self._transmit_mw, _purpose(frame), frame.kind)
        self.on_transmitting(frame)
        self._transmission = self._medium.begin(self, frame)

    def _start_up(self, power_mw: float, delay_ns: int) -> None:
        self._enter("switch", power_mw, "wake")
        self._waking = True
        self._ready_in(delay_ns)

    def _ready_in(self, delay_ns: int) -> None:
        """Listen again after start-up or turnaround, and tell the MAC, also if a frame begins at that very instant."""
        self.listens_since_ns = self._clock.now_ns + delay_ns
        self._medium.listening(self.node, self.listens_since_ns)
        era, life = self._era, self._life

        def ready(_: object) -> None:
            if self._life != life:
                return
            if self._era == era:
                self._listen()
            self.on_ready()

        self._clock.call_after(delay_ns, ready)

    def _listen(self) -> None:
        self._enter("listen", self.device.listen_mw, "listen")

    def _turn_away(self, outcome: str) -> None:
        self.listens_since_ns = None
        self._medium.stopped_listening(self.node, outcome)

    def _later(self, delay_ns: int, action: Callable[[], None]) -> None:
        era = self._era
        self._clock.call_after(delay_ns, lambda _: action() if self._era == era else None)

    def _enter(self, state: str, power_mw: float, label: str, kind: str = "") -> None:
        self.state = state
        self._era += 1
        self._waking = False
        self._meter.draw(power_mw, label, kind)
        if self._notable(state) and self._recorder.wants(RadioState):
            self._recorder.record(RadioState(self.node, RADIO_STATE_CODE[state]))

    def _notable(self, state: str) -> bool:
        """Whether the trace tells of it at every level: that it cannot hear, and that it can again."""
        if state in ("sleep", "off"):
            self._is_away = True
        back = self._is_away and state not in ("sleep", "off", "switch")
        self._is_away &= not back
        return self._all_states or back or state in ("sleep", "dead", "off")


def _purpose(frame: LinkFrame) -> str:
    """What the ledger books a transmission under."""
    if frame.is_strobe:
        return "strobe_transmit"
    return "ack_transmit" if frame.is_ack else ("retransmit" if frame.attempt else "transmit")
