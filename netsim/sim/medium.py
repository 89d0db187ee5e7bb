"""The shared air with interference: who hears what, and with which outcome.

Transmissions are half-open intervals, so that one that ends and one that begins at the same nanosecond do not interfere,
whichever event is handled first. What happens to a signal at all its listeners is computed at once, in arrays over the
nodes. Received powers are whole zeptowatts (1e-18 mW): their sums are exact, in whatever order signals come and go.
"""

import heapq
import math
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from netsim.models.reception import log_bit_success_of
from netsim.sim.air import (
    ASLEEP,
    BUSY,
    COLLIDED,
    DEAD,
    OVERHEARD,
    RECEIVED,
    WEAK,
    FrameLog,
    Link,
    Uniforms,
    UniformSource,
    label_of,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Receptions, Transmission
from netsim.sim.radio import Radio
from netsim.sim.signals import ZW_PER_MW, Floats, Instant, Ints, Locks, Reach, reach_of
from netsim.trace.events import BROADCAST, OUTCOME_CODE
from netsim.units import NS_PER_S, mw_to_dbm

NEVER: Final = 1 << 62
RECENTLY_ENDED: Final = 4096
"""Ended transmissions remembered for channel assessment: far more than end anywhere within eight symbols."""
CCA_SYMBOLS: Final = 8
"""IEEE 802.15.4-2006 6.9.9."""
INTERFERED: Final = 1.0 - 1e-9

Mask = NDArray[np.bool_]


class SinrMedium:
    """Additive interference: a frame survives with the probability that each bit survives its own SINR.

    Model: IEEE 802.15.4-2006 E.4.1.8 bit errors, independent given the SINR of each segment between changes of the
    interference; a receiver locks on a preamble it hears from its start with at least the device's lock SINR and, once
    locked, stays locked to the frame's end. Of preambles that begin at the same instant the strongest is caught. Not
    modelled: propagation delay (under 1 us at 300 m), capture of a later stronger frame, adjacent channels.

    Args:
        clock: Simulated time.
        paths: For each node, the nodes its signal reaches above the interference floor, ascending.
        noise_mw: Thermal noise in the receiver's bandwidth.
        log: Where finished transmissions go.
    """

    def __init__(self, clock: Clock, paths: Mapping[int, Sequence[Link]], noise_mw: float, log: FrameLog) -> None:
        size = len(paths)
        self._clock = clock
        self._log = log
        self._noise_zw = noise_mw * ZW_PER_MW
        self._index = {node: index for index, node in enumerate(sorted(paths))}
        self._reach = {node: reach_of(links, self._index, self._noise_zw) for node, links in paths.items()}
        self._radios: list[Radio | None] = [None] * size
        self._uniforms: list[Uniforms | None] = [None] * size
        self._follows = np.zeros(size, bool)
        self._lock_ratio = np.zeros(size)
        self._bits_per_ns = np.zeros(size)
        self._preamble_ns = np.zeros(size, np.int64)
        self._listens_since_ns = np.full(size, NEVER, np.int64)
        self._deaf_outcome = np.full(size, ASLEEP, np.int64)
        self._air_zw = np.zeros(size, np.int64)
        self._began = Instant(size)
        self._ended: deque[tuple[int, Reach]] = deque(maxlen=RECENTLY_ENDED)
        self._locks = Locks(size)
        self._heard_ns: defaultdict[tuple[str, str], Ints] = defaultdict(lambda: np.zeros(size, np.int64))
        self._on_air: dict[int, Transmission] = {}
        self._ends: list[tuple[int, int]] = []

    def join(self, radio: Radio, generator: UniformSource) -> None:
        """Let a radio take part; `generator` decides its receptions."""
        index, device = self._index[radio.node], radio.device
        self._radios[index] = radio
        self._uniforms[index] = Uniforms(generator)
        self._follows[index] = radio.follows_receptions
        self._lock_ratio[index] = 10.0 ** (device.preamble_lock_sinr_db / 10.0)
        self._bits_per_ns[index] = device.bitrate_bps / NS_PER_S
        self._preamble_ns[index] = (device.phy_header_byte - 1) * 8 * NS_PER_S // device.bitrate_bps

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is on the air."""
        return not self._on_air

    def is_busy(
        self,
        node: int,
        duration_ns: int | None = None,
        mode: str = "either",
        threshold_dbm: float | None = None,
    ) -> bool:
        """Clear channel assessment (IEEE 802.15.4-2006 6.9.9). What begins at this very instant is not seen yet.

        Args:
            node: Who assesses.
            duration_ns: How far back it looks; eight symbols by default.
            mode: Busy if a `carrier` was caught, if the `energy` of all that was on the air reaches the threshold, or on
                `either`: modes 2, 1 and 3 of the standard.
            threshold_dbm: Energy threshold; the device's by default.
        """
        now_ns, index = self._clock.now_ns, self._index[node]
        self._retire(now_ns)
        device = self._radio(index).device
        since_ns = now_ns - (CCA_SYMBOLS * device.symbol_ns if duration_ns is None else duration_ns)
        if mode != "energy" and self._carrier_since(index, since_ns):
            return True
        if mode == "carrier":
            return False
        threshold_dbm = device.cca_threshold_dbm if threshold_dbm is None else threshold_dbm
        energy_zw = int(self._air_zw[index] - self._began.at(now_ns)[index]) + self._ended_zw(index, since_ns)
        return mw_to_dbm((energy_zw + self._noise_zw) / ZW_PER_MW) >= threshold_dbm

    def begin(self, radio: Radio, frame: LinkFrame) -> Transmission:
        """See `Medium.begin`."""
        now_ns = self._clock.now_ns
        self._retire(now_ns)
        end_ns = now_ns + radio.device.airtime_ns(frame.psdu_byte)
        reach = self._reach[radio.node]
        heard = Receptions(
            reach.near_ids, np.empty(len(reach.near), np.int64), reach.near_dbm, np.empty(len(reach.near))
        )
        transmission = Transmission(self._log.next_id(), frame, now_ns, end_ns, radio.tx_power_dbm, heard)
        self._on_air[transmission.id] = transmission
        heapq.heappush(self._ends, (end_ns, transmission.id))
        self._signal_begins(transmission, reach)
        self._clock.call_after(end_ns - now_ns, lambda _: self._end(transmission))
        return transmission

    def abort(self, transmission: Transmission) -> None:
        """See `Medium.abort`."""
        if transmission.end_ns == self._clock.now_ns:
            return  # it was sent whole, and its end is yet to be handled
        transmission.truncated = True
        transmission.end_ns = self._clock.now_ns
        self._signal_ends(transmission)
        self._log.record(transmission)

    def listening(self, node: int, since_ns: int) -> None:
        """See `Medium.listening`."""
        self._listens_since_ns[self._index[node]] = since_ns

    def stopped_listening(self, node: int, outcome: str) -> None:
        """See `Medium.stopped_listening`. What begins at this very instant meets a deaf receiver, whatever it met first."""
        index = self._index[node]
        self._listens_since_ns[index] = NEVER
        self._deaf_outcome[index] = OUTCOME_CODE[outcome]
        if self._began.at(self._clock.now_ns)[index]:
            for other in self._on_air.values():
                if other.start_ns == self._clock.now_ns:
                    self._set_outcome(other, index, OUTCOME_CODE[outcome])
        transmission = self._on_air.get(int(self._locks.transmission[index]))
        if transmission is None:
            return
        self._set_outcome(transmission, index, OUTCOME_CODE[outcome])
        self._locks.transmission[index], self._locks.end_ns[index] = 0, -1
        label, kind = label_of(transmission, node), transmission.frame.kind
        if self._follows[index]:
            self._radio(index).reception_broken(label, kind)
        else:
            self._heard_ns[label, kind][index] += self._clock.now_ns - transmission.start_ns

    def settle(self, node: int) -> None:
        """See `Medium.settle`."""
        index = self._index[node]
        for (label, kind), times_ns in self._heard_ns.items():
            if times_ns[index]:
                self._radio(index).heard(label, kind, int(times_ns[index]))
                times_ns[index] = 0

    def _carrier_since(self, index: int, since_ns: int) -> bool:
        locks = self._locks
        caught = locks.start_ns[index] < self._clock.now_ns and locks.end_ns[index] > since_ns
        return bool(caught or locks.previous_end_ns[index] > since_ns)

    def _ended_zw(self, index: int, since_ns: int) -> int:
        """Power at a node of the signals that ended after `since_ns`."""
        total_zw = 0
        for end_ns, reach in reversed(self._ended):
            if end_ns <= since_ns:
                break
            total_zw += reach.power_at(index)
        return total_zw

    def _radio(self, index: int) -> Radio:
        radio = self._radios[index]
        if radio is None:
            message = f"node at index {index} has not joined the medium"
            raise LookupError(message)
        return radio

    def _retire(self, now_ns: int) -> None:
        """End every signal whose interval is over by now, before anything else happens at this instant."""
        while self._ends and self._ends[0][0] <= now_ns:
            _, number = heapq.heappop(self._ends)
            transmission = self._on_air.get(number)
            if transmission is not None:
                self._signal_ends(transmission)

    def _end(self, transmission: Transmission) -> None:
        if transmission.truncated:
            return
        self._retire(self._clock.now_ns)
        self._log.record(transmission)
        frame = transmission.frame
        self._radio(self._index[frame.source]).transmission_ended(transmission)
        heard = transmission.receptions
        for node in heard.node[heard.outcome == RECEIVED].tolist():
            self._radio(self._index[node]).on_receive(frame)
        if frame.concerns_all:
            for node in heard.node[heard.outcome == OVERHEARD].tolist():
                self._radio(self._index[node]).on_overhear(frame)

    def _signal_begins(self, transmission: Transmission, reach: Reach) -> None:
        now_ns, locks = transmission.start_ns, self._locks
        self._close_segments(reach.index[locks.end_ns[reach.index] > now_ns], now_ns)
        self._air_zw[reach.index] += reach.power_zw
        self._began.add(now_ns, reach.index, reach.power_zw)
        near, heard = reach.near, transmission.receptions
        earlier_zw = self._air_zw[near] - self._began.at(now_ns)[near]
        heard.sinr[:] = reach.near_zw / (self._noise_zw + earlier_zw)
        locked = locks.end_ns[near] > now_ns
        outcome = np.where(locked & ~self._beats(transmission, reach), BUSY, RECEIVED)
        weak = heard.sinr < self._lock_ratio[near]
        outcome = np.where(weak, self._causes_of_loss(transmission, reach, heard.sinr), outcome)
        outcome = np.where(self._listens_since_ns[near] <= now_ns, outcome, self._deaf_outcome[near])
        heard.outcome[:] = np.where(locked & (locks.start_ns[near] < now_ns), BUSY, outcome)
        caught = heard.outcome == RECEIVED
        self._displace(near[caught & locked])
        self._lock(transmission, reach, caught)

    def _beats(self, transmission: Transmission, reach: Reach) -> Mask:
        """Where a preamble that began at the same instant is caught, but this one is stronger: it wins, in any order."""
        locks, near = self._locks, reach.near
        source = self._index[transmission.frame.source]
        stronger = reach.near_zw > locks.power_zw[near]
        first = (reach.near_zw == locks.power_zw[near]) & (source < locks.source[near])
        beats: Mask = (locks.start_ns[near] == transmission.start_ns) & (stronger | first)
        return beats

    def _displace(self, listeners: NDArray[np.intp]) -> None:
        for index in listeners.tolist():
            self._set_outcome(self._on_air[int(self._locks.transmission[index])], index, BUSY)
        self._locks.end_ns[listeners] = self._locks.previous_end_ns[listeners]

    def _set_outcome(self, transmission: Transmission, index: int, outcome: int) -> None:
        near = self._reach[transmission.frame.source].near
        transmission.receptions.outcome[near == index] = outcome

    def _lock(self, transmission: Transmission, reach: Reach, locks_on: Mask) -> None:
        listeners, locks = reach.near[locks_on], self._locks
        locks.transmission[listeners] = transmission.id
        locks.start_ns[listeners] = transmission.start_ns
        locks.previous_end_ns[listeners] = locks.end_ns[listeners]
        locks.end_ns[listeners] = transmission.end_ns
        locks.power_zw[listeners] = reach.near_zw[locks_on]
        locks.source[listeners] = self._index[transmission.frame.source]
        locks.segment_ns[listeners] = transmission.start_ns + self._preamble_ns[listeners]
        locks.log_success[listeners] = 0.0
        locks.sinr[listeners] = transmission.receptions.sinr[locks_on]
        for index in listeners[self._follows[listeners]].tolist():
            self._radio(index).locked()

    def _close_segments(self, listeners: NDArray[np.intp], now_ns: int) -> None:
        """Account for the interference that locked receivers met until now; call before it changes."""
        locks = self._locks
        listeners = listeners[locks.segment_ns[listeners] < now_ns]
        if not len(listeners):
            return
        power_zw = locks.power_zw[listeners]
        sinr = power_zw / (self._noise_zw + (self._air_zw[listeners] - power_zw))
        bits = (now_ns - locks.segment_ns[listeners]) * self._bits_per_ns[listeners]
        locks.sinr[listeners] = np.minimum(locks.sinr[listeners], sinr)
        locks.log_success[listeners] += bits * log_bit_success_of(sinr)
        locks.segment_ns[listeners] = now_ns

    def _signal_ends(self, transmission: Transmission) -> None:
        now_ns, locks = transmission.end_ns, self._locks
        del self._on_air[transmission.id]
        reach = self._reach[transmission.frame.source]
        self._close_segments(reach.index[locks.transmission[reach.index] != 0], now_ns)
        self._air_zw[reach.index] -= reach.power_zw
        self._ended.append((now_ns, reach))
        self._conclude(transmission, reach, locks.transmission[reach.near] == transmission.id)

    def _conclude(self, transmission: Transmission, reach: Reach, locked: Mask) -> None:
        """A signal is over: decide at each receiver that is locked on it whether it was decoded."""
        listeners, heard, locks = reach.near[locked], transmission.receptions, self._locks
        locks.transmission[listeners] = 0
        locks.end_ns[listeners] = transmission.end_ns
        heard.sinr[locked] = locks.sinr[listeners]
        if transmission.truncated:
            heard.outcome[:] = DEAD
        else:
            decoded = self._draws(listeners) < np.exp(locks.log_success[listeners])
            lost = self._causes_of_loss(transmission, reach, heard.sinr)[locked]
            destination = transmission.frame.destination
            mine = (heard.node[locked] == destination) | (destination == BROADCAST)
            heard.outcome[locked] = np.where(decoded, np.where(mine, RECEIVED, OVERHEARD), lost)
        self._book(transmission, listeners, heard.node[locked])

    def _draws(self, listeners: NDArray[np.intp]) -> Floats:
        return np.array([uniforms.next() for index in listeners.tolist() if (uniforms := self._uniforms[index])])

    def _causes_of_loss(self, transmission: Transmission, reach: Reach, sinr: Floats) -> Ints:
        """Collided where there was interference and the frame alone would have had an even chance, weak elsewhere."""
        interfered = sinr < reach.near_zw / self._noise_zw * INTERFERED
        likely_alone = 8.0 * transmission.frame.psdu_byte * reach.alone >= math.log(0.5)
        return np.where(interfered & likely_alone, COLLIDED, WEAK)

    def _book(self, transmission: Transmission, listeners: NDArray[np.intp], nodes: Ints) -> None:
        """Book the time of a reception, at the radios themselves where they follow it."""
        kind, time_ns = transmission.frame.kind, transmission.end_ns - transmission.start_ns
        follows = self._follows[listeners]
        for index, node in zip(listeners[follows].tolist(), nodes[follows].tolist(), strict=True):
            self._radio(index).reception_ended(label_of(transmission, node), kind)
        quiet, quiet_nodes = listeners[~follows], nodes[~follows]
        destination = transmission.frame.destination
        mine = (quiet_nodes == destination) | (destination == BROADCAST)
        if mine.any():
            self._heard_ns[label_of(transmission, int(quiet_nodes[mine][0])), kind][quiet[mine]] += time_ns
        self._heard_ns["overhear", kind][quiet[~mine]] += time_ns
