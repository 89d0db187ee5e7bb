"""The ideal air: a delay and perhaps a loss, for algorithms to be tested without a radio's troubles."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from netsim.sim.air import (
    ASLEEP,
    DEAD,
    LOST,
    OVERHEARD,
    RECEIVED,
    FrameLog,
    Link,
    Uniforms,
    UniformSource,
    label_of,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Receptions, Transmission
from netsim.sim.radio import Radio
from netsim.units import mw_to_dbm


@dataclass(slots=True, eq=False)
class Listener:
    """A radio, its luck, and the transmission its receive time is booked for."""

    radio: Radio
    uniforms: Uniforms
    lock: Transmission | None = None


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
        paths: Mapping[int, Sequence[Link]],
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
        self._under_way = 0
        self._nodes = {
            source: np.array([path.destination for path in links], np.int64) for source, links in paths.items()
        }
        self._power_dbm = {
            source: np.array([mw_to_dbm(path.power_mw) for path in links]) for source, links in paths.items()
        }

    def join(self, radio: Radio, generator: UniformSource) -> None:
        """Let a radio take part; `generator` decides its losses."""
        self._listeners[radio.node] = Listener(radio, Uniforms(generator))

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is on its way."""
        return self._under_way == 0

    def is_busy(
        self,
        node: int,
        duration_ns: int | None = None,
        mode: str = "either",
        threshold_dbm: float | None = None,
    ) -> bool:
        """Clear channel assessment: the ideal channel is never busy."""
        return False

    def begin(self, radio: Radio, frame: LinkFrame) -> Transmission:
        """See `Medium.begin`."""
        now_ns = self._clock.now_ns
        airtime_ns = radio.device.airtime_ns(frame.psdu_byte)
        nodes = self._nodes[radio.node]
        undecided, clean = np.full(len(nodes), LOST, np.int64), np.full(len(nodes), math.inf)
        heard = Receptions(nodes, undecided, self._power_dbm[radio.node], clean)
        transmission = Transmission(self._log.next_id(), frame, now_ns, now_ns + airtime_ns, radio.tx_power_dbm, heard)
        for path in self._paths[radio.node]:
            listener = self._listeners[path.destination]
            if listener.lock is None and listener.radio.is_listening:
                listener.lock = transmission
                listener.radio.locked()
        self._under_way += 1
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

    def listening(self, node: int, since_ns: int) -> None:
        """See `Medium.listening`; the ideal medium asks the radio."""

    def settle(self, node: int) -> None:
        """See `Medium.settle`; receptions are booked as they end."""

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
                listener.radio.reception_ended(label_of(transmission, path.destination), frame.kind)

    def _decide(self, transmission: Transmission) -> None:
        """Settle every listener's outcome, record, then hand up what was decoded."""
        self._under_way -= 1
        frame, heard = transmission.frame, transmission.receptions
        heard.outcome[:] = [self._outcome(self._listeners[node], transmission) for node in heard.node.tolist()]
        self._log.record(transmission)
        for node in heard.node[heard.outcome == RECEIVED].tolist():
            self._listeners[node].radio.on_receive(frame)
        if frame.concerns_all:
            for node in heard.node[heard.outcome == OVERHEARD].tolist():
                self._listeners[node].radio.on_overhear(frame)

    def _outcome(self, listener: Listener, transmission: Transmission) -> int:
        radio = listener.radio
        if transmission.truncated or radio.state == "dead":
            return DEAD
        if not radio.is_awake:
            return ASLEEP
        if self._loss_probability > 0.0 and listener.uniforms.next() < self._loss_probability:
            return LOST
        return RECEIVED if transmission.frame.is_for(radio.node) else OVERHEARD
