"""Air without interference: a delay and each link's own chance of loss, for algorithms without a radio's troubles."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from netsim.models.delivery import DeliveryRatios
from netsim.sim.air import (
    ASLEEP,
    DEAD,
    LOST,
    OVERHEARD,
    RECEIVED,
    FrameFaults,
    FrameLog,
    Link,
    Uniforms,
    UniformSource,
    label_of,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Receptions, Transmission
from netsim.sim.radio import Radio
from netsim.sim.signals import Floats, Ints
from netsim.units import mw_to_dbm


@dataclass(slots=True, eq=False)
class Listener:
    """A radio, its luck, and the transmission its receive time is booked for."""

    radio: Radio
    uniforms: Uniforms
    lock: Transmission | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Where one node's frames go; arrays over its links, ascending by node."""

    nodes: Ints
    power_dbm: Floats
    prr: Floats


class IdealMedium:
    """Delay and an independent chance of loss on each link, nothing else: no interference, half duplex or deaf receiver.

    A sleeping or dead node still hears nothing. Where receptions overlap at a listener, its receive time is booked
    once. What is simultaneous is put in the order of the senders, whoever was handled first.

    Args:
        clock: Simulated time.
        paths: For each node, the nodes within range, ascending; a link's `prr` decides the fate of a frame of any size.
        delay_ns: From the end of the transmission to its reception.
        log: Where finished transmissions go.
        delivery: Measured delivery ratios that take the place of the links' own; None for those.

    Attributes:
        faults: What else may befall a frame at a listener.
    """

    def __init__(
        self,
        clock: Clock,
        paths: Mapping[int, Sequence[Link]],
        delay_ns: int,
        log: FrameLog,
        delivery: DeliveryRatios | None = None,
    ) -> None:
        self._clock = clock
        self._ways = {source: _ways(links) for source, links in paths.items()}
        self._delay_ns = delay_ns
        self._log = log
        self._delivery = delivery
        self._listeners: dict[int, Listener] = {}
        self._under_way = 0
        self._on_air: dict[int, Ways] = {}
        self._began: list[Transmission] = []
        self._due: dict[int, list[Transmission]] = {}
        self.faults: FrameFaults | None = None

    def join(self, radio: Radio, generator: UniformSource) -> None:
        """Let a radio take part; `generator` decides its losses."""
        self._listeners[radio.node] = Listener(radio, Uniforms(generator))

    def replace_links(self, source: int, links: Sequence[Link]) -> None:
        """From now on a node's signals go these ways; what is on the air goes on as it began."""
        self._ways[source] = _ways(links)

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
        ways = self._ways[radio.node]
        undecided, clean = np.full(len(ways.nodes), LOST, np.int64), np.full(len(ways.nodes), math.inf)
        heard = Receptions(ways.nodes, undecided, ways.power_dbm, clean)
        transmission = Transmission(self._log.next_id(), frame, now_ns, now_ns + airtime_ns, radio.tx_power_dbm, heard)
        self._on_air[transmission.id] = ways
        if not self._began:
            self._clock.call_settled(0, self._lock)
        self._began.append(transmission)
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
        self._decide_in(0, transmission)

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
        self._decide_in(self._delay_ns, transmission)

    def _lock(self, _: object) -> None:
        """Let idle receivers book their time for a frame that began now: the strongest, then the lowest sender's."""
        began, self._began = self._began, []
        offers: dict[int, list[tuple[float, int, Transmission]]] = {}
        for transmission in began:
            heard = transmission.receptions
            for node, power_dbm in zip(heard.node.tolist(), heard.power_dbm.tolist(), strict=True):
                offers.setdefault(node, []).append((-power_dbm, transmission.frame.source, transmission))
        for node, offered in sorted(offers.items()):
            listener = self._listeners[node]
            if listener.lock is None and listener.radio.is_listening:
                listener.lock = min(offered, key=lambda offer: offer[:2])[2]
                listener.radio.locked()

    def _decide_in(self, delay_ns: int, transmission: Transmission) -> None:
        """Decide about a frame after a delay, together with what else arrives then, in the order of the senders."""
        at_ns = self._clock.now_ns + delay_ns
        if at_ns not in self._due:
            self._due[at_ns] = []
            self._clock.call_settled(delay_ns, self._decide_due)
        self._due[at_ns].append(transmission)

    def _decide_due(self, _: object) -> None:
        due = self._due.pop(self._clock.now_ns)
        for transmission in sorted(due, key=lambda each: (each.frame.source, each.start_ns)):
            self._decide(transmission)

    def _release(self, transmission: Transmission) -> None:
        for node in transmission.receptions.node.tolist():
            listener = self._listeners[node]
            if listener.lock is transmission:
                listener.lock = None
                listener.radio.reception_ended(label_of(transmission, node), transmission.frame.kind)

    def _decide(self, transmission: Transmission) -> None:
        """Settle every listener's outcome, record, then hand up what was decoded."""
        self._under_way -= 1
        frame, heard = transmission.frame, transmission.receptions
        prr = self._on_air.pop(transmission.id).prr
        if self._delivery is not None:
            prr = self._delivery.ratios(frame.source, transmission.start_ns)
        listeners = [self._listeners[node] for node in heard.node.tolist()]
        heard.outcome[:] = [
            self._outcome(listener, transmission, chance)
            for listener, chance in zip(listeners, prr.tolist(), strict=True)
        ]
        self._strike(transmission)
        self._log.record(transmission)
        for node in heard.node[heard.outcome == RECEIVED].tolist():
            self._listeners[node].radio.on_receive(frame)
        if frame.concerns_all:
            for node in heard.node[heard.outcome == OVERHEARD].tolist():
                self._listeners[node].radio.on_overhear(frame)

    def _outcome(self, listener: Listener, transmission: Transmission, chance: float) -> int:
        radio = listener.radio
        if transmission.truncated or radio.state in ("dead", "off"):
            return DEAD
        if not radio.is_awake:
            return ASLEEP
        if chance < 1.0 and listener.uniforms.next() < 1.0 - chance:
            return LOST
        return RECEIVED if transmission.frame.is_for(radio.node) else OVERHEARD

    def _strike(self, transmission: Transmission) -> None:
        """Let fault rules take what would have been decoded."""
        heard, frame = transmission.receptions, transmission.frame
        decoded = np.isin(heard.outcome, (RECEIVED, OVERHEARD))
        if self.faults is None or not decoded.any():
            return
        codes = self.faults.verdicts(frame.source, heard.node[decoded], frame, transmission.end_ns)
        heard.outcome[decoded] = np.where(codes >= 0, codes, heard.outcome[decoded])


def _ways(links: Sequence[Link]) -> Ways:
    return Ways(
        nodes=np.array([link.destination for link in links], np.int64),
        power_dbm=np.array([mw_to_dbm(link.power_mw) for link in links], float),
        prr=np.array([link.prr for link in links], float),
    )
