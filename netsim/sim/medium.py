"""The shared air with interference: who hears what, and with which outcome.

Each frame's outcome at each audible listener is decided at the frame's end, from every transmission that overlapped
it. Transmissions are half-open intervals, so that one that ends and one that begins at the same nanosecond do not
interfere, whichever event is handled first.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from netsim.models.reception import log_bit_success
from netsim.sim.air import (
    ASLEEP,
    BUSY,
    COLLIDED,
    DEAD,
    HALF_DUPLEX,
    OVERHEARD,
    RECEIVED,
    WEAK,
    FrameLog,
    Listener,
    Path,
    Uniforms,
    preamble_ns,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Reception, Transmission
from netsim.sim.radio import Radio
from netsim.trace.events import OUTCOME_CODE
from netsim.units import mw_to_dbm


class SinrMedium:
    """Additive interference: a frame survives with the probability that each bit survives its own SINR.

    Model: IEEE 802.15.4-2006 E.4.1.8 bit errors, independent given the SINR of each segment between changes of the
    interference; a receiver locks on a preamble it hears from its start with at least the device's lock SINR and, once
    locked, stays locked to the frame's end. Not modelled: propagation delay (under 1 us at 300 m), capture of a later
    stronger frame, adjacent channels.

    Args:
        clock: Simulated time.
        paths: For each node, the nodes its signal reaches above the interference floor, ascending.
        noise_mw: Thermal noise in the receiver's bandwidth.
        log: Where finished transmissions go.
    """

    def __init__(self, clock: Clock, paths: Mapping[int, Sequence[Path]], noise_mw: float, log: FrameLog) -> None:
        self._clock = clock
        self._paths = paths
        self._noise_mw = noise_mw
        self._log = log
        self._listeners: dict[int, Listener] = {}

    def join(self, radio: Radio, generator: np.random.Generator) -> None:
        """Let a radio take part; `generator` decides its receptions."""
        self._listeners[radio.node] = Listener(radio, Uniforms(generator), preamble_ns(radio))

    def is_busy(self, node: int) -> bool:
        """Clear channel assessment, mode 3 of IEEE 802.15.4-2006 6.9.9: energy above threshold or a carrier.

        What began at this very instant is not seen yet; what ended at this instant still is.
        """
        listener = self._listeners[node]
        now_ns = self._clock.now_ns
        if (listener.lock is not None and listener.lock.start_ns < now_ns) or listener.last_lock_end_ns == now_ns:
            return True
        energy_mw = math.fsum(power for other, power in listener.air.values() if other.start_ns < now_ns)
        if listener.last_end_ns == now_ns:
            energy_mw += listener.last_end_mw
        return mw_to_dbm(energy_mw + self._noise_mw) >= listener.radio.device.cca_threshold_dbm

    def begin(self, radio: Radio, frame: LinkFrame) -> Transmission:
        """See `Medium.begin`."""
        now_ns = self._clock.now_ns
        end_ns = now_ns + radio.device.airtime_ns(frame.psdu_byte)
        transmission = Transmission(self._log.next_id(), frame, now_ns, end_ns, radio.tx_power_dbm)
        for path in self._paths[radio.node]:
            self._signal_begins(self._listeners[path.destination], transmission, path)
        self._clock.call_after(end_ns - now_ns, lambda _: self._end(transmission))
        return transmission

    def abort(self, transmission: Transmission) -> None:
        """See `Medium.abort`."""
        if transmission.end_ns == self._clock.now_ns:
            return  # it was sent whole, and its end is yet to be handled
        transmission.truncated = True
        transmission.end_ns = self._clock.now_ns
        self._finish(transmission)
        self._log.record(transmission)

    def stopped_listening(self, node: int, outcome: str) -> None:
        """See `Medium.stopped_listening`. What begins at this very instant meets a deaf receiver, whatever it met first."""
        listener = self._listeners[node]
        lock, listener.lock = listener.lock, None
        if lock is not None:
            lock.receptions[node].outcome = OUTCOME_CODE[outcome]
        for other, _ in listener.air.values():
            if other.start_ns == self._clock.now_ns and (reception := other.receptions.get(node)) is not None:
                reception.outcome = OUTCOME_CODE[outcome]

    def _end(self, transmission: Transmission) -> None:
        if transmission.truncated:
            return
        self._finish(transmission)
        self._log.record(transmission)
        frame = transmission.frame
        self._listeners[frame.source].radio.transmission_ended(transmission)
        for reception in transmission.receptions.values():
            if reception.outcome in (RECEIVED, OVERHEARD):
                self._listeners[reception.node].radio.on_receive(frame)

    def _finish(self, transmission: Transmission) -> None:
        for path in self._paths[transmission.frame.source]:
            self._signal_ends(self._listeners[path.destination], transmission, path)

    def _signal_begins(self, listener: Listener, transmission: Transmission, path: Path) -> None:
        now_ns = transmission.start_ns
        locked_on = self._lock_at(listener, now_ns)
        if locked_on is not None:
            self._close_segment(listener, locked_on, now_ns)
        listener.air[transmission.id] = (transmission, path.power_mw)
        if locked_on is not None:
            self._open_segment(listener, locked_on, now_ns)
        if path.decodable:
            self._try_lock(listener, transmission, path.power_mw, locked_on)

    def _try_lock(
        self, listener: Listener, transmission: Transmission, power_mw: float, locked_on: Transmission | None
    ) -> None:
        node = listener.radio.node
        sinr = power_mw / (self._noise_mw + self._earlier_mw(listener, transmission.start_ns))
        reception = transmission.receptions[node] = Reception(node, power_mw, RECEIVED, sinr)
        outcome = self._deaf_outcome(listener, transmission, locked_on)
        if outcome is None and mw_to_dbm(sinr) < listener.radio.device.preamble_lock_sinr_db:
            outcome = self._cause_of_loss(transmission, reception)
        if outcome is None and locked_on is not None:
            outcome = self._yield_to(listener, transmission, locked_on)
        if outcome is None:
            self._lock(listener, transmission)
        else:
            reception.outcome = outcome

    def _yield_to(self, listener: Listener, transmission: Transmission, locked_on: Transmission) -> int | None:
        """Of two preambles that begin at the same instant the stronger wins, whichever event is handled first."""
        node = listener.radio.node
        held, new = locked_on.receptions[node], transmission.receptions[node]
        if (new.power_mw, -transmission.frame.source) < (held.power_mw, -locked_on.frame.source):
            return BUSY
        held.outcome = BUSY
        listener.lock = None
        return None

    def _lock(self, listener: Listener, transmission: Transmission) -> None:
        if listener.lock is not None:  # it ends at this very instant, and its end is yet to be handled
            self._conclude(listener, listener.lock)
        transmission.receptions[listener.radio.node].segment_ns = transmission.start_ns + listener.preamble_ns
        self._open_segment(listener, transmission, transmission.start_ns)
        listener.lock = transmission
        listener.radio.locked()

    def _deaf_outcome(
        self, listener: Listener, transmission: Transmission, locked_on: Transmission | None
    ) -> int | None:
        radio = listener.radio
        if radio.state == "dead":
            return DEAD
        if locked_on is not None and locked_on.start_ns < transmission.start_ns:
            return BUSY
        if radio.could_hear_since(transmission.start_ns):
            return None
        return HALF_DUPLEX if radio.is_awake else ASLEEP

    def _signal_ends(self, listener: Listener, transmission: Transmission, path: Path) -> None:
        now_ns = self._clock.now_ns
        listener.air.pop(transmission.id, None)
        if listener.last_end_ns != now_ns:
            listener.last_end_ns, listener.last_end_mw = now_ns, 0.0
        listener.last_end_mw += path.power_mw
        if listener.lock is transmission:
            self._conclude(listener, transmission)
        elif (locked_on := self._lock_at(listener, now_ns)) is not None:
            self._close_segment(listener, locked_on, now_ns)
            self._open_segment(listener, locked_on, now_ns)
        if transmission.truncated and (reception := transmission.receptions.get(path.destination)) is not None:
            reception.outcome = DEAD

    def _conclude(self, listener: Listener, transmission: Transmission) -> None:
        """The frame a listener is locked on is over: decide whether it was decoded."""
        now_ns = self._clock.now_ns
        node = listener.radio.node
        reception = transmission.receptions[node]
        self._close_segment(listener, transmission, now_ns)
        listener.lock = None
        listener.last_lock_end_ns = now_ns
        decoded = not transmission.truncated and listener.uniforms.next() < math.exp(reception.log_success)
        mine = transmission.frame.is_for(node)
        if decoded:
            reception.outcome = RECEIVED if mine else OVERHEARD
        else:
            reception.outcome = self._cause_of_loss(transmission, reception)
        label = ("ack_receive" if transmission.frame.is_ack else "receive") if mine else "overhear"
        listener.radio.reception_ended(label, transmission.frame.kind)

    def _cause_of_loss(self, transmission: Transmission, reception: Reception) -> int:
        snr = reception.power_mw / self._noise_mw
        bits = 8.0 * transmission.frame.psdu_byte
        interfered = reception.sinr < snr * (1.0 - 1e-9)
        return COLLIDED if interfered and math.exp(bits * log_bit_success(snr)) >= 0.5 else WEAK

    def _lock_at(self, listener: Listener, now_ns: int) -> Transmission | None:
        lock = listener.lock
        return lock if lock is not None and now_ns < lock.end_ns else None

    def _earlier_mw(self, listener: Listener, now_ns: int) -> float:
        """Power of what was on the air before this instant and still is: what a preamble that begins now meets.

        Preambles that begin together are told apart by their strength (see `_rivals`), not by this.
        """
        return math.fsum(power for other, power in listener.air.values() if other.start_ns < now_ns < other.end_ns)

    def _close_segment(self, listener: Listener, transmission: Transmission, now_ns: int) -> None:
        reception = transmission.receptions[listener.radio.node]
        if now_ns > reception.segment_ns:
            sinr = reception.power_mw / (self._noise_mw + reception.interference_mw)
            reception.sinr = min(reception.sinr, sinr)
            bits = (now_ns - reception.segment_ns) * listener.radio.device.bitrate_bps * 1e-9
            reception.log_success += bits * log_bit_success(sinr)
            reception.segment_ns = now_ns

    def _open_segment(self, listener: Listener, transmission: Transmission, now_ns: int) -> None:
        reception = transmission.receptions[listener.radio.node]
        reception.interference_mw = math.fsum(  # the same in whatever order they began
            power for other, power in listener.air.values() if other is not transmission and now_ns < other.end_ns
        )
