"""Chance that does not depend on who asks, when or how often: uniform numbers by key, two-state processes by time."""

import hashlib
import math
import struct
from dataclasses import dataclass

import numpy as np

from netsim.rng import Streams
from netsim.units import NS_PER_S

_BLOCK = 64


class KeyedUniforms:
    """Uniform numbers that are functions of whole numbers: nothing is drawn, so no order of asking shows.

    Args:
        streams: Random streams of the run.
        name: What they are for; another name gives other numbers.
    """

    def __init__(self, streams: Streams, name: str) -> None:
        self._key = streams.generator(name).bytes(32)

    def of(self, *numbers: int) -> float:
        """The number in [0, 1) that belongs to these numbers, each within 64 bits."""
        digest = hashlib.blake2b(struct.pack(f"<{len(numbers)}q", *numbers), digest_size=8, key=self._key).digest()
        return float((int.from_bytes(digest, "little") >> 11) * 2.0**-53)

    def exponential_ns(self, mean_s: float, *numbers: int) -> int:
        """The exponential time with this mean that belongs to these numbers."""
        return round(-math.log1p(-self.of(*numbers)) * mean_s * NS_PER_S)


@dataclass(frozen=True, slots=True)
class Means:
    """Mean times of a two-state process, in seconds."""

    good_s: float
    bad_s: float


class TwoStates:
    """A process that is good and bad in turn, for exponential times; it starts in equilibrium at time 0.

    Its changes are drawn one after the other from a stream of its own, as far as they are asked for. Times asked for must
    not decrease.

    Args:
        generator: Its own random stream.
        means: Mean time in either state.
    """

    def __init__(self, generator: np.random.Generator, means: Means) -> None:
        self._generator = generator
        self._starts_bad = bool(generator.random() < means.bad_s / (means.good_s + means.bad_s))
        first, second = (means.bad_s, means.good_s) if self._starts_bad else (means.good_s, means.bad_s)
        self._means_s = np.resize([first, second], _BLOCK)
        self._block_ns = 0
        self._changes_ns = self._next_block()

    def is_bad(self, now_ns: int) -> bool:
        """The state at a time; of a change's own instant, the new one."""
        return self._starts_bad ^ bool(self._place(now_ns) % 2)

    def next_change_ns(self, now_ns: int) -> int:
        """When it changes next, later than `now_ns`."""
        place = self._place(now_ns)  # first: it may go on to the next block
        return int(self._changes_ns[place])

    def _place(self, now_ns: int) -> int:
        """How many changes of the block have happened; the last of a block is where the next block begins."""
        while self._changes_ns[-1] <= now_ns:
            self._changes_ns = self._next_block()
        return int(np.searchsorted(self._changes_ns, now_ns, side="right"))

    def _next_block(self) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        times_ns = np.rint(self._generator.exponential(self._means_s) * NS_PER_S).astype(np.int64)
        changes_ns = self._block_ns + np.cumsum(np.maximum(times_ns, 1))
        self._block_ns = int(changes_ns[-1])
        return changes_ns
