"""The ideal air: a delay and perhaps a loss, for algorithms to be tested without a radio's troubles."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from netsim.sim.air import (
    ASLEEP,
    DEAD,
    LOST,
    OVERHEARD,
    RECEIVED,
    FrameLog,
    Listener,
    Path,
    Uniforms,
    preamble_ns,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Reception, Transmission
from netsim.sim.radio import Radio


class IdealMedium:
    """Delay and an independent loss probability, nothing else: no interference, no half duplex, no deaf receivers.

    A sleeping or dead node still hears nothing. Where receptions overlap at a listener, its receive time is booked
    once.

    Args:
        clock: Simulated time.
        paths: For each node, the nodes within range, ascending.
        delay_ns: From the end of the transmission to its reception.
        loss_probability: Of each frame at each listener.
        log: Where finished transmissions go.
    """

    def __init__(
        self,
        clock: Clock,
        paths: Mapping[int, Sequence[Path]],
        delay_ns: int,
        loss_probability: float,
        log: FrameLog,
    ) -> None:
        self._clock = clock
        self._paths = paths
        self._delay_ns = delay_ns
        self._loss_probability = loss_probability
        self._log = log
        self._listeners: dict[int, Listener] = {}

    def join(self, radio: Radio, generator: np.random.Generator) -> None:
        """Let a radio take part; `generator` decides its losses."""
        self._listeners[radio.node] = Listener(radio, Uniforms(generator), preamble_ns(radio))

    def is_busy(self, node: int) -> bool:
        """Clear channel assessment: the ideal channel is never busy."""
        return False

    def begin(self, radio: Radio, frame: LinkFrame) -> Transmission:
        """See `Medium.begin`."""
        now_ns = self._clock.now_ns
        airtime_ns = radio.device.airtime_ns(frame.psdu_byte)
        transmission = Transmission(self._log.next_id(), frame, now_ns, now_ns + airtime_ns, radio.tx_power_dbm)
        for path in self._paths[radio.node]:
            listener = self._listeners[path.destination]
            if listener.lock is None and listener.radio.is_listening:
                listener.lock = transmission
                listener.radio.locked()
        self._clock.call_after(airtime_ns, lambda _: self._end(transmission))
        return transmission

    def abort(self, transmission: Transmission) -> None:
        """See `Medium.abort`."""
        if transmission.end_ns == self._clock.now_ns:
            return  # it was sent whole, and its end is yet to be handled
        transmission.truncated = True
        transmission.end_ns = self._clock.now_ns
        self._release(transmission)
        self._decide(transmission)

    def stopped_listening(self, node: int, outcome: str) -> None:
        """See `Medium.stopped_listening`; costs no reception here."""
        self._listeners[node].lock = None

    def _end(self, transmission: Transmission) -> None:
        if transmission.truncated:
            return
        self._release(transmission)
        self._listeners[transmission.frame.source].radio.transmission_ended(transmission)
        self._clock.call_after(self._delay_ns, lambda _: self._decide(transmission))

    def _release(self, transmission: Transmission) -> None:
        frame = transmission.frame
        for path in self._paths[frame.source]:
            listener = self._listeners[path.destination]
            if listener.lock is transmission:
                listener.lock = None
                mine = frame.is_for(path.destination)
                label = ("ack_receive" if frame.is_ack else "receive") if mine else "overhear"
                listener.radio.reception_ended(label, frame.kind)

    def _decide(self, transmission: Transmission) -> None:
        """Settle every listener's outcome, record, then hand up what was decoded."""
        frame = transmission.frame
        for path in self._paths[frame.source]:
            outcome = self._outcome(self._listeners[path.destination], transmission)
            reception = Reception(path.destination, path.power_mw, outcome, math.inf)
            transmission.receptions[path.destination] = reception
        self._log.record(transmission)
        for reception in transmission.receptions.values():
            if reception.outcome in (RECEIVED, OVERHEARD):
                self._listeners[reception.node].radio.on_receive(frame)

    def _outcome(self, listener: Listener, transmission: Transmission) -> int:
        radio = listener.radio
        if transmission.truncated or radio.state == "dead":
            return DEAD
        if not radio.is_awake:
            return ASLEEP
        if self._loss_probability > 0.0 and listener.uniforms.next() < self._loss_probability:
            return LOST
        return RECEIVED if transmission.frame.is_for(radio.node) else OVERHEARD
