"""Messages out of fragments, each handed up once or not at all; and what that rests on: numbers that are not used twice."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass

from netsim.sim.clock import Clock
from netsim.sim.net.packet import Packet

MOST_REMEMBERED = 16_384
SEQUENCES = 0x10000
_BLOCK = 4096


class Recent:
    """Keys that were seen lately, oldest forgotten first: after their lifetime, or when there are too many.

    Args:
        lifetime_ns: How long a key is remembered.
        most: How many at once.
    """

    def __init__(self, lifetime_ns: int, most: int = MOST_REMEMBERED) -> None:
        self._lifetime_ns = lifetime_ns
        self._most = most
        self._seen_ns: dict[Hashable, int] = {}

    def add(self, key: Hashable, now_ns: int) -> bool:
        """Remember a key; returns whether it is new."""
        self._forget(now_ns)
        if key in self._seen_ns:
            return False
        self._seen_ns[key] = now_ns
        return True

    def has(self, key: Hashable, now_ns: int) -> bool:
        """Whether a key is remembered."""
        self._forget(now_ns)
        return key in self._seen_ns

    def clear(self) -> None:
        """Forget everything."""
        self._seen_ns.clear()

    def _forget(self, now_ns: int) -> None:
        while self._seen_ns:
            oldest = next(iter(self._seen_ns))
            if len(self._seen_ns) <= self._most and now_ns - self._seen_ns[oldest] < self._lifetime_ns:
                return
            del self._seen_ns[oldest]


class SequenceNumbers:
    """A node's message numbers modulo 65,536. None is used again while somebody may remember it.

    The counter is taken to survive a reboot, so that a message of the new life is not mistaken for one of the old.

    Args:
        lifetime_ns: How long others remember a number.
    """

    def __init__(self, lifetime_ns: int) -> None:
        self._lifetime_ns = lifetime_ns
        self._last = 0
        self._left_ns: dict[int, int] = {}  # when each block of numbers was last used to its end

    def next(self, now_ns: int) -> int | None:
        """The next number; None where it was used less than a lifetime ago."""
        number = (self._last + 1) % SEQUENCES
        if number % _BLOCK == 0:
            used_ns = self._left_ns.get(number // _BLOCK)
            if used_ns is not None and now_ns - used_ns < self._lifetime_ns:
                return None
            self._left_ns[self._last // _BLOCK] = now_ns
        self._last = number
        return number


@dataclass(slots=True, eq=False)
class Assembly:
    """A message whose fragments are coming in."""

    first: Packet
    chunks: dict[int, bytes]


class Reassembly:
    """Puts fragments together.

    A message that is not whole a time-out after its first fragment came is given up at that instant (RFC 791, 3.2); a
    fragment that comes at that very instant still counts.

    Args:
        clock: Simulated time.
        timeout_ns: How long a message may stay incomplete.
        most: How many incomplete messages are kept.
        lifetime_ns: How long a whole message is remembered, so that a late copy is not taken for another one.
        give_up: Called with a fragment and the reason when it, or the message it began, is given up.
    """

    def __init__(
        self, clock: Clock, timeout_ns: int, most: int, lifetime_ns: int, give_up: Callable[[Packet, str], None]
    ) -> None:
        self._clock = clock
        self._timeout_ns = timeout_ns
        self._most = most
        self._give_up = give_up
        self._done = Recent(lifetime_ns)
        self._assemblies: dict[tuple[int, int], Assembly] = {}

    @property
    def incomplete(self) -> int:
        """How many messages are waiting for fragments."""
        return len(self._assemblies)

    def add(self, packet: Packet) -> bytes | None:
        """Take a fragment; returns the whole message when this was the last that was missing."""
        key = (packet.origin, packet.sequence)
        if self._done.has(key, self._clock.now_ns):
            return None
        if packet.count > 1:
            assembly = self._assemblies.get(key) or self._begin(key, packet)
            if assembly is None or not self._fits(assembly, packet):
                return None
            assembly.chunks.setdefault(packet.index, packet.chunk)
            if len(assembly.chunks) < packet.count:
                return None
            del self._assemblies[key]
            payload = b"".join(assembly.chunks[index] for index in range(packet.count))
        else:
            payload = packet.chunk
        self._done.add(key, self._clock.now_ns)
        return payload

    def give_up_all(self, reason: str) -> None:
        """Give up every message that is not whole yet."""
        assemblies, self._assemblies = self._assemblies, {}
        for assembly in assemblies.values():
            self._give_up(assembly.first, reason)

    def clear(self) -> None:
        """Forget everything, as a node does that loses its memory."""
        self._assemblies.clear()
        self._done.clear()

    def _begin(self, key: tuple[int, int], packet: Packet) -> Assembly | None:
        if len(self._assemblies) >= self._most:
            self._give_up(packet, "reassembly_full")
            return None
        assembly = self._assemblies[key] = Assembly(packet, {})
        self._clock.call_last(self._timeout_ns, lambda _: self._expire(key, assembly))
        return assembly

    def _fits(self, assembly: Assembly, packet: Packet) -> bool:
        """Whether a fragment is of the same message as the first; only a broken header makes it another."""
        first = assembly.first
        if (first.count, first.kind_code, first.destination) == (packet.count, packet.kind_code, packet.destination):
            return True
        self._give_up(packet, "malformed")
        return False

    def _expire(self, key: tuple[int, int], assembly: Assembly) -> None:
        if self._assemblies.get(key) is assembly:
            del self._assemblies[key]
            self._give_up(assembly.first, "reassembly_timeout")
