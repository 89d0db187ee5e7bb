"""What each receiver meets, in arrays over the nodes: noise, the power on its air, and what it is locked on.

A frame is cut into segments of constant interference, jamming and noise. Each segment adds the logarithm of the chance
that all its bits are right, three times over: with everything, without interference (that is, noise alone), and without
the jammers. The first decides; the others tell what a lost frame was lost to.
"""

import math
from typing import Final

import numpy as np

from netsim.models.devices import RadioDevice
from netsim.models.modulation import O_QPSK, Modulation
from netsim.models.noise import Noise
from netsim.sim.air import COLLIDED, JAMMED, WEAK
from netsim.sim.signals import ZW_PER_MW, Floats, Indices, Ints
from netsim.units import NS_PER_S

NEVER_CAPTURES: Final = np.inf
NOTABLE: Final = 1e-9
"""Interference below this share of the noise is none."""
EVEN: Final = math.log(0.5)


class Locks:
    """What each receiver is locked on; arrays over the nodes.

    Attributes:
        transmission: Number of the transmission; 0 for none.
        start_ns: Its start.
        end_ns: Its end; kept after the reception is over, for channel assessment.
        previous_end_ns: The end of the one before it.
        power_zw: Its received power.
        source: Array index of its sender.
        segment_ns: Start of the segment of constant powers not yet accounted for.
        log_success: ln of the chance that every bit so far is right.
        log_alone: The same without interference and jammers; kept only where the noise varies.
        log_unjammed: The same without jammers; kept only where there are any.
        sinr: Lowest ratio so far.
    """

    def __init__(self, size: int) -> None:
        self.transmission = np.zeros(size, np.int64)
        self.start_ns = np.full(size, -1, np.int64)
        self.end_ns = np.full(size, -1, np.int64)
        self.previous_end_ns = np.full(size, -1, np.int64)
        self.power_zw = np.zeros(size, np.int64)
        self.source = np.zeros(size, np.int64)
        self.segment_ns = np.zeros(size, np.int64)
        self.log_success = np.zeros(size)
        self.log_alone = np.zeros(size)
        self.log_unjammed = np.zeros(size)
        self.sinr = np.zeros(size)


class Receivers:
    """See the module.

    Args:
        noise: Noise of every node.

    Attributes:
        air_zw: Power of all signals and jammers on the air at each node.
        jam_zw: That of the jammers.
        locks: What each receiver is locked on.
        lock_ratio: Lowest SINR at which a preamble is caught.
        capture_ratio: SINR from which a later frame takes the receiver; infinity where none does.
    """

    def __init__(self, noise: Noise) -> None:
        size = len(noise.typical_mw)
        self._noise = noise
        self._step_ns = noise.step_ns
        self._has_jammers = False
        self._noise_step = -1
        self._noise_zw: Floats = np.zeros(0)
        self.air_zw = np.zeros(size, np.int64)
        self.jam_zw = np.zeros(size, np.int64)
        self.locks = Locks(size)
        self.lock_ratio = np.zeros(size)
        self.capture_ratio = np.full(size, NEVER_CAPTURES)
        self._bits_per_ns = np.zeros(size)
        self._preamble_ns = np.zeros(size, np.int64)
        self._modulation: Modulation = O_QPSK

    def join(self, index: int, device: RadioDevice) -> None:
        """A receiver takes part. All radios of one medium share a physical layer, so the last one's modulation holds."""
        self.lock_ratio[index] = 10.0 ** (device.preamble_lock_sinr_db / 10.0)
        if device.capture_sinr_db is not None:
            self.capture_ratio[index] = 10.0 ** (device.capture_sinr_db / 10.0)
        self._bits_per_ns[index] = device.bitrate_bps / NS_PER_S
        self._preamble_ns[index] = device.preamble_ns
        self._modulation = device.modulation

    @property
    def noise_varies(self) -> bool:
        """Whether the noise changes with time."""
        return self._step_ns is not None

    def noise_zw(self, time_ns: int) -> Floats:
        """Noise of every node at a time, in zeptowatts."""
        return self._noise_in(0 if self._step_ns is None else time_ns // self._step_ns)

    def lock(self, listeners: Indices, start_ns: int, signal_zw: Ints) -> None:
        """Begin to count the bits of a frame caught at `start_ns`; those of its preamble are not counted."""
        locks = self.locks
        locks.power_zw[listeners] = signal_zw
        locks.segment_ns[listeners] = start_ns + self._preamble_ns[listeners]
        locks.log_success[listeners] = 0.0
        if self._step_ns is not None:
            locks.log_alone[listeners] = 0.0
        if self._has_jammers:
            locks.log_unjammed[listeners] = 0.0

    def change_jam(self, index: Indices, power_zw: Ints) -> None:
        """A jammer begins (power above 0) or ends; the segments of its listeners must have been closed."""
        if not self._has_jammers:
            self._has_jammers = True
            self.locks.log_unjammed[:] = self.locks.log_success
        self.air_zw[index] += power_zw
        self.jam_zw[index] += power_zw

    def log_unjammed(self, listeners: Indices) -> Floats:
        """Ln of the chance that the frame which ends now would have been decoded without jammers."""
        return (self.locks.log_unjammed if self._has_jammers else self.locks.log_success)[listeners]

    def close_segments(self, listeners: Indices, now_ns: int) -> None:
        """Account for the time since each listener's segment began: the powers change now."""
        listeners = listeners[self.locks.segment_ns[listeners] < now_ns]
        while len(listeners):
            step_ns = self._step_ns
            if step_ns is None:
                self._close(listeners, now_ns, self._noise_in(0)[listeners])
                return
            first = int(self.locks.segment_ns[listeners].min()) // step_ns
            until_ns = min(now_ns, (first + 1) * step_ns)
            early = listeners[self.locks.segment_ns[listeners] < until_ns]
            self._close(early, until_ns, self._noise_in(first)[early])
            listeners = listeners[self.locks.segment_ns[listeners] < now_ns]

    def log_alone(self, listeners: Indices, until_ns: int) -> Floats:
        """Ln of the chance that the frame which ends now would have been decoded without interference and jammers."""
        locks = self.locks
        if self.noise_varies:
            return locks.log_alone[listeners]
        begun_ns = locks.start_ns[listeners] + self._preamble_ns[listeners]
        bits = (until_ns - begun_ns) * self._bits_per_ns[listeners]
        alone: Floats = bits * self.log_bit_alone(listeners, locks.power_zw[listeners], until_ns)
        return alone

    def log_bit_alone(self, index: Indices, signal_zw: Ints, time_ns: int) -> Floats:
        """Ln of the chance of a bit against the noise of a time, without interference."""
        signal, none = signal_zw.astype(float), np.zeros(len(index))
        return self._modulation.log_bit_success(signal, none, self.noise_zw(time_ns)[index])

    def carrier_since(self, index: int, since_ns: int, now_ns: int) -> bool:
        """Whether a receiver was locked on a frame at any time since then; one caught just now does not count yet."""
        locks = self.locks
        caught = locks.start_ns[index] < now_ns and locks.end_ns[index] > since_ns
        return bool(caught or locks.previous_end_ns[index] > since_ns)

    def causes_of_loss(self, listeners: Indices, end_ns: int) -> Ints:
        """What the frames that end now were lost to: jammed or collided where, without that, their chance was even."""
        success = self.locks.log_success[listeners]
        alone, unjammed = self.log_alone(listeners, end_ns), self.log_unjammed(listeners)
        interfered = success < alone * (1.0 + NOTABLE)
        by_others = np.where(interfered & (alone >= EVEN), COLLIDED, WEAK)
        return np.where((success < unjammed) & (unjammed >= EVEN), JAMMED, by_others)

    def causes_of_weakness(
        self, index: Indices, signal_zw: Ints, earlier_zw: Ints, psdu_byte: int, now_ns: int
    ) -> Ints:
        """What preambles that begin now were not caught for: as for a loss, judged by the powers at their start.

        Args:
            index: Listeners.
            signal_zw: Received power there.
            earlier_zw: Power of what was on the air before.
            psdu_byte: Length of the frame.
            now_ns: The present instant.
        """
        noise_zw, jam_zw = self.noise_zw(now_ns)[index], self.jam_zw[index]
        even_alone = 8.0 * psdu_byte * self.log_bit_alone(index, signal_zw, now_ns) >= EVEN
        caught_unjammed = signal_zw / (noise_zw + earlier_zw - jam_zw) >= self.lock_ratio[index]
        by_others = np.where((earlier_zw > NOTABLE * noise_zw) & even_alone, COLLIDED, WEAK)
        return np.where((jam_zw > 0) & caught_unjammed & even_alone, JAMMED, by_others)

    def _close(self, listeners: Indices, until_ns: int, noise_zw: Floats) -> None:
        locks, log_of = self.locks, self._modulation.log_bit_success
        bits = (until_ns - locks.segment_ns[listeners]) * self._bits_per_ns[listeners]
        signal = locks.power_zw[listeners].astype(float)
        other = (self.air_zw[listeners] - locks.power_zw[listeners]).astype(float)
        locks.sinr[listeners] = np.minimum(locks.sinr[listeners], signal / (noise_zw + other))
        whole = bits * log_of(signal, other, noise_zw)
        locks.log_success[listeners] += whole
        if self._step_ns is not None:
            locks.log_alone[listeners] += bits * log_of(signal, np.zeros(len(other)), noise_zw)
        if self._has_jammers:
            locks.log_unjammed[listeners] += bits * log_of(signal, other - self.jam_zw[listeners], noise_zw)
        locks.segment_ns[listeners] = until_ns

    def _noise_in(self, step: int) -> Floats:
        if step != self._noise_step:
            self._noise_step = step
            self._noise_zw = self._noise.power_mw(step) * ZW_PER_MW
        return self._noise_zw
