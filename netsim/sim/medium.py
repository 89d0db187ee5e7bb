"""The shared air with interference: who hears what, and with which outcome.

Transmissions are half-open intervals, so that one that ends and one that begins at the same nanosecond do not interfere,
whichever event is handled first. What happens to a signal at all its listeners is computed at once, in arrays over the
nodes. Received powers are whole zeptowatts (1e-18 mW): their sums are exact, in whatever order signals come and go.
"""

import heapq
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Final, Literal

import numpy as np

from netsim.models.delivery import DeliveryRatios
from netsim.models.noise import Noise
from netsim.sim.air import (
    ASLEEP,
    BUSY,
    CAPTURED,
    DEAD,
    OVERHEARD,
    RECEIVED,
    FrameFaults,
    FrameLog,
    Link,
    Uniforms,
    UniformSource,
)
from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame, Receptions, Transmission
from netsim.sim.radio import Radio
from netsim.sim.receivers import Receivers
from netsim.sim.reception_times import ReceptionTimes
from netsim.sim.signals import ZW_PER_MW, Floats, Indices, Instant, Mask, Reach, reach_of, zeptowatts
from netsim.trace.events import BROADCAST, OUTCOME_CODE
from netsim.units import mw_to_dbm

NEVER: Final = 1 << 62
RECENTLY_ENDED: Final = 4096
"""Ended transmissions remembered for channel assessment: far more than end anywhere within eight symbols."""
CCA_SYMBOLS: Final = 8
"""IEEE 802.15.4-2006 6.9.9."""

CcaMode = Literal["energy", "carrier", "either"]
FadingGains = Callable[[int, int], Floats]
"""From a sender and a number of listeners to the linear power gains of its next frame, drawn once a frame."""


class SinrMedium:
    """Additive interference: a frame survives with the probability that each bit survives its own SINR.

    A receiver locks on a preamble it hears from its start with at least the device's lock SINR. Locked, it stays so to the
    frame's end, unless its device captures: then a frame that begins later and has at least the capture SINR takes the
    receiver. Of preambles that begin at the same instant the strongest is caught. Bit errors are independent given the
    powers of each segment (see `netsim.sim.receivers`). Not modelled: propagation delay (under 1 us at 300 m), adjacent
    channels.

    Args:
        clock: Simulated time.
        paths: For each node, the nodes its signal reaches above the interference floor, ascending.
        noise: Noise of every node.
        log: Where finished transmissions go.
        fading: What varies from frame to frame; None for nothing.
        delivery: Measured delivery ratios that take the place of errors by noise; None where physics decides.

    Attributes:
        faults: What else may befall a frame at a listener.
    """

    def __init__(
        self,
        clock: Clock,
        paths: Mapping[int, Sequence[Link]],
        noise: Noise,
        log: FrameLog,
        fading: FadingGains | None = None,
        delivery: DeliveryRatios | None = None,
    ) -> None:
        size = len(paths)
        self._clock = clock
        self._log = log
        self._fading = fading
        self._delivery = delivery
        self._index = {node: index for index, node in enumerate(sorted(paths))}
        self._reach = {node: reach_of(links, self._index) for node, links in paths.items()}
        self._receivers = Receivers(noise)
        self._radios: list[Radio | None] = [None] * size
        self._uniforms: list[Uniforms | None] = [None] * size
        self._listens_since_ns = np.full(size, NEVER, np.int64)
        self._deaf_outcome = np.full(size, ASLEEP, np.int64)
        self._began = Instant(size)
        self._ended: deque[tuple[int, Reach]] = deque(maxlen=RECENTLY_ENDED)
        self._times = ReceptionTimes(self._radios)
        self._on_air: dict[int, tuple[Transmission, Reach]] = {}
        self._ends: list[tuple[int, int]] = []
        self._jammers: dict[int, Reach] = {}
        self.faults: FrameFaults | None = None

    def join(self, radio: Radio, generator: UniformSource) -> None:
        """Let a radio take part; `generator` decides its receptions."""
        index = self._index[radio.node]
        self._radios[index] = radio
        self._uniforms[index] = Uniforms(generator)
        self._times.join(index, radio)
        self._receivers.join(index, radio.device)

    def replace_links(self, source: int, links: Sequence[Link]) -> None:
        """From now on a node's signals go these ways (it or others moved); what is on the air goes on as it began."""
        self._reach[source] = reach_of(links, self._index)

    def jam(self, powers_mw: Mapping[int, float]) -> int:
        """A jammer begins: noise-like power at some nodes, until `unjam`.

        Args:
            powers_mw: Received power by node.

        Returns:
            What `unjam` is to be given.

        Raises:
            ScenarioError: If a node would receive more power than any receiver stands.
        """
        now_ns = self._clock.now_ns
        self._retire(now_ns)
        nodes = sorted(powers_mw)
        index = np.array([self._index[node] for node in nodes], np.intp)
        power_zw = zeptowatts([powers_mw[node] for node in nodes])
        reach = Reach.of(index, np.array(nodes, np.int64), power_zw, np.empty(0, np.intp))
        token = self._log.next_id()
        self._jammers[token] = reach
        self._powers_change(reach.index, now_ns)
        self._receivers.change_jam(index, power_zw)
        self._began.add(now_ns, index, power_zw)
        return token

    def unjam(self, token: int) -> None:
        """A jammer falls silent."""
        now_ns = self._clock.now_ns
        self._retire(now_ns)
        reach = self._jammers.pop(token)
        self._powers_change(reach.index, now_ns)
        self._receivers.change_jam(reach.index, -reach.power_zw)
        self._ended.append((now_ns, reach))

    @property
    def is_quiet(self) -> bool:
        """Whether no frame is on the air."""
        return not self._on_air

    def is_busy(
        self,
        node: int,
        duration_ns: int | None = None,
        mode: CcaMode = "either",
        threshold_dbm: float | None = None,
    ) -> bool:
        """Clear channel assessment (IEEE 802.15.4-2006 6.9.9). What begins at this very instant is not seen yet.

        The energy is that of all signals that touch the window, summed as if they overlapped for all of it; the standard
        averages over the window, so that short or successive signals read lower there.

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
        if mode != "energy" and self._receivers.carrier_since(index, since_ns, now_ns):
            return True
        if mode == "carrier":
            return False
        threshold_dbm = device.cca_threshold_dbm if threshold_dbm is None else threshold_dbm
        return self._energy_dbm(index, since_ns, now_ns) >= threshold_dbm

    def begin(self, radio: Radio, frame: LinkFrame) -> Transmission:
        """See `Medium.begin`."""
        now_ns = self._clock.now_ns
        self._retire(now_ns)
        end_ns = now_ns + radio.device.airtime_ns(frame.psdu_byte)
        reach = self._reach_now(radio.node, now_ns)
        size = len(reach.near)
        heard = Receptions(reach.near_ids, np.empty(size, np.int64), reach.near_dbm, np.empty(size))
        transmission = Transmission(self._log.next_id(), frame, now_ns, end_ns, radio.tx_power_dbm, heard)
        self._on_air[transmission.id] = (transmission, reach)
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
        if (
            outcome != "dead"
        ):  # what ended just now was heard to its end; a node that goes down comes first in its instant
            self._retire(self._clock.now_ns)
        index, locks = self._index[node], self._receivers.locks
        self._listens_since_ns[index] = NEVER
        self._deaf_outcome[index] = OUTCOME_CODE[outcome]
        if self._began.at(self._clock.now_ns)[index]:
            for other, _ in self._on_air.values():
                if other.start_ns == self._clock.now_ns:
                    _set_outcome(other, node, OUTCOME_CODE[outcome])
        number = int(locks.transmission[index])
        if number not in self._on_air:
            return
        self._leave(index, node, OUTCOME_CODE[outcome])
        locks.transmission[index], locks.end_ns[index] = 0, -1

    def settle(self, node: int) -> None:
        """See `Medium.settle`."""
        self._times.settle(self._index[node])

    def _reach_now(self, source: int, now_ns: int) -> Reach:
        """Where a signal that begins now arrives: as at the start, unless something varies with time."""
        reach = self._reach[source]
        if self._fading is not None:
            reach = reach.faded(self._fading(source, len(reach.index)))
        elif not self._receivers.noise_varies:
            return reach
        noise_zw = self._receivers.noise_zw(now_ns)[reach.index]
        return reach.nearer(reach.power_zw >= self._receivers.lock_ratio[reach.index] * noise_zw)

    def _leave(self, index: int, node: int, outcome: int) -> None:
        """A receiver leaves the frame it is locked on: note why, and book the time it spent on it."""
        transmission, _ = self._on_air[int(self._receivers.locks.transmission[index])]
        _set_outcome(transmission, node, outcome)
        self._times.broken(transmission, index, node, self._clock.now_ns)

    def _energy_dbm(self, index: int, since_ns: int, now_ns: int) -> float:
        """Power of noise and all signals that were on the air at a node since a time."""
        signals_zw = int(self._receivers.air_zw[index] - self._began.at(now_ns)[index]) + self._ended_zw(
            index, since_ns
        )
        return mw_to_dbm((signals_zw + float(self._receivers.noise_zw(now_ns)[index])) / ZW_PER_MW)

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
            if number in self._on_air:
                self._signal_ends(self._on_air[number][0])

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

    def _powers_change(self, index: Indices, now_ns: int) -> None:
        """Close the segments of the receivers among these that are locked on something."""
        self._receivers.close_segments(index[self._receivers.locks.end_ns[index] > now_ns], now_ns)

    def _signal_begins(self, transmission: Transmission, reach: Reach) -> None:
        now_ns, receivers, locks = transmission.start_ns, self._receivers, self._receivers.locks
        self._powers_change(reach.index, now_ns)
        receivers.air_zw[reach.index] += reach.power_zw
        self._began.add(now_ns, reach.index, reach.power_zw)
        near, heard = reach.near_index, transmission.receptions
        earlier_zw = receivers.air_zw[near] - self._began.at(now_ns)[near]
        heard.sinr[:] = reach.near_zw / (receivers.noise_zw(now_ns)[near] + earlier_zw)
        locked = locks.end_ns[near] > now_ns
        held = locked & (locks.start_ns[near] < now_ns) & (heard.sinr < receivers.capture_ratio[near])
        outcome = np.where(
            locked & (locks.start_ns[near] == now_ns) & ~self._beats(transmission, reach), BUSY, RECEIVED
        )
        weak = heard.sinr < receivers.lock_ratio[near]
        if weak.any():
            powers_zw, size_byte = (reach.near_zw[weak], earlier_zw[weak]), transmission.frame.psdu_byte
            outcome[weak] = receivers.causes_of_weakness(near[weak], *powers_zw, size_byte, now_ns)
        outcome = np.where(self._listens_since_ns[near] <= now_ns, outcome, self._deaf_outcome[near])
        heard.outcome[:] = np.where(held, BUSY, outcome)
        caught = heard.outcome == RECEIVED
        self._displace(near[caught & locked], now_ns)
        self._lock(transmission, reach, caught)

    def _beats(self, transmission: Transmission, reach: Reach) -> Mask:
        """Where a preamble that began at the same instant is caught, but this one is stronger: it wins, in any order."""
        locks, near, near_zw = self._receivers.locks, reach.near_index, reach.near_zw
        source = self._index[transmission.frame.source]
        beats: Mask = (near_zw > locks.power_zw[near]) | (
            (near_zw == locks.power_zw[near]) & (source < locks.source[near])
        )
        return beats

    def _displace(self, listeners: Indices, now_ns: int) -> None:
        """A stronger preamble takes these receivers: from one of the same instant as if that had never been caught."""
        locks = self._receivers.locks
        for index in listeners.tolist():
            node = self._radio(index).node
            if locks.start_ns[index] < now_ns:
                self._leave(index, node, CAPTURED)
                locks.end_ns[index] = now_ns
            else:
                _set_outcome(self._on_air[int(locks.transmission[index])][0], node, BUSY)
                locks.end_ns[index] = locks.previous_end_ns[index]

    def _lock(self, transmission: Transmission, reach: Reach, locks_on: Mask) -> None:
        listeners, locks = reach.near_index[locks_on], self._receivers.locks
        locks.transmission[listeners] = transmission.id
        locks.start_ns[listeners] = transmission.start_ns
        locks.previous_end_ns[listeners] = locks.end_ns[listeners]
        locks.end_ns[listeners] = transmission.end_ns
        locks.source[listeners] = self._index[transmission.frame.source]
        locks.sinr[listeners] = transmission.receptions.sinr[locks_on]
        self._receivers.lock(listeners, transmission.start_ns, reach.near_zw[locks_on])
        self._times.begun(listeners)

    def _signal_ends(self, transmission: Transmission) -> None:
        now_ns, receivers = transmission.end_ns, self._receivers
        _, reach = self._on_air.pop(transmission.id)
        receivers.close_segments(reach.index[receivers.locks.transmission[reach.index] != 0], now_ns)
        receivers.air_zw[reach.index] -= reach.power_zw
        self._ended.append((now_ns, reach))
        self._conclude(transmission, reach, receivers.locks.transmission[reach.near_index] == transmission.id)

    def _conclude(self, transmission: Transmission, reach: Reach, locked: Mask) -> None:
        """A signal is over: decide at each receiver that is locked on it whether it was decoded."""
        listeners, heard, locks = reach.near_index[locked], transmission.receptions, self._receivers.locks
        locks.transmission[listeners] = 0
        locks.end_ns[listeners] = transmission.end_ns
        heard.sinr[locked] = locks.sinr[listeners]
        if transmission.truncated:
            heard.outcome[:] = DEAD
        else:
            decoded = self._draws(listeners) < self._chances(transmission, reach, locked)
            destination = transmission.frame.destination
            mine = (heard.node[locked] == destination) | (destination == BROADCAST)
            outcome = np.where(mine, RECEIVED, OVERHEARD)
            if not decoded.all():
                outcome[~decoded] = self._receivers.causes_of_loss(listeners[~decoded], transmission.end_ns)
            heard.outcome[locked] = outcome
            self._strike(transmission, locked)
        self._times.ended(transmission, listeners, heard.node[locked])

    def _chances(self, transmission: Transmission, reach: Reach, locked: Mask) -> Floats:
        """Chance of each locked receiver to have decoded the frame; replayed where it was measured."""
        listeners, locks = reach.near_index[locked], self._receivers.locks
        if self._delivery is None:
            chances: Floats = np.exp(locks.log_success[listeners])
            return chances
        alone = self._receivers.log_alone(listeners, transmission.end_ns)
        ratios = self._delivery.ratios(transmission.frame.source, transmission.start_ns)[reach.near][locked]
        with np.errstate(invalid="ignore"):  # -inf - -inf, where even noise alone leaves no chance
            interference = np.nan_to_num(locks.log_success[listeners] - alone, nan=0.0)
        replayed: Floats = ratios * np.exp(np.minimum(interference, 0.0))
        return replayed

    def _strike(self, transmission: Transmission, locked: Mask) -> None:
        """Let fault rules take what would have been decoded."""
        if self.faults is None:
            return
        heard, frame = transmission.receptions, transmission.frame
        decoded = locked & np.isin(heard.outcome, (RECEIVED, OVERHEARD))
        codes = self.faults.verdicts(frame.source, heard.node[decoded], frame, transmission.end_ns)
        heard.outcome[decoded] = np.where(codes >= 0, codes, heard.outcome[decoded])

    def _draws(self, listeners: Indices) -> Floats:
        return np.array([uniforms.next() for index in listeners.tolist() if (uniforms := self._uniforms[index])])


def _set_outcome(transmission: Transmission, node: int, outcome: int) -> None:
    heard = transmission.receptions
    heard.outcome[heard.node == node] = outcome
