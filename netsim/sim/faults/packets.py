"""What may befall a packet on its way from a node's MAC to its network layer: wrong bytes, a second copy, delay."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from netsim.sim.faults.announce import Announcer, Span
from netsim.sim.faults.chance import KeyedUniforms

Copies = Sequence[tuple[int, bytes]]
"""What the network layer is given of a packet: (delay in ns, bytes) each."""
MOST_FLIPPED = 8


@dataclass(frozen=True, slots=True)
class Occasion:
    """A packet that has come in at a node: what every chance about it is a function of."""

    neighbour: int
    node: int
    now_ns: int
    copy: int = 0

    @property
    def key(self) -> tuple[int, int, int, int]:
        """As whole numbers."""
        return self.neighbour, self.node, self.now_ns, self.copy


class PacketChange(Protocol):
    """What a rule makes of a packet."""

    def copies(self, data: bytes, occasion: Occasion) -> Copies | None:
        """What becomes of it; None where the rule does not strike."""
        ...


@dataclass(frozen=True, slots=True)
class PacketFault:
    """A rule about packets, ready for use.

    Attributes:
        change: What it does.
        announcer: Tells the trace.
        span: When it holds.
        effect: What it does, for the trace.
    """

    change: PacketChange
    announcer: Announcer
    span: Span
    effect: str


class PacketFaults:
    """The rules about packets at one node, to be set as the filter of its network layer.

    Args:
        node: The node.
        rules: In the order of the scenario: each is applied to what the one before has left.
        now_ns: Simulated time.
    """

    def __init__(self, node: int, rules: Sequence[PacketFault], now_ns: Callable[[], int]) -> None:
        self._node = node
        self._rules = rules
        self._now_ns = now_ns

    def __call__(self, data: bytes, neighbour: int) -> Copies:
        """The copies that are to be handled of a received packet, each after its delay."""
        now_ns = self._now_ns()
        copies: list[tuple[int, bytes]] = [(0, data)]
        for rule in self._rules:
            if rule.span.holds(now_ns):
                copies = self._apply(rule, copies, neighbour, now_ns)
        return copies

    def _apply(self, rule: PacketFault, copies: Copies, neighbour: int, now_ns: int) -> list[tuple[int, bytes]]:
        result: list[tuple[int, bytes]] = []
        for number, (delay_ns, data) in enumerate(copies):
            changed = rule.change.copies(data, Occasion(neighbour, self._node, now_ns, number))
            if changed is None:
                result.append((delay_ns, data))
                continue
            result += [(delay_ns + more_ns, copy) for more_ns, copy in changed]
            rule.announcer.strikes([self._node], f"packet from node {neighbour}: {rule.effect}")
        return result


@dataclass(frozen=True, slots=True)
class Garbled:
    """Up to eight bits of a packet are wrong, and its checksum happens to fit.

    Attributes:
        uniforms: Chance by occasion.
        share: Of the packets.
    """

    uniforms: KeyedUniforms
    share: float

    def copies(self, data: bytes, occasion: Occasion) -> Copies | None:
        """See `PacketChange.copies`."""
        if not data or self.uniforms.of(*occasion.key, 0) >= self.share:
            return None
        wrong = bytearray(data)
        for number in range(1 + int(self.uniforms.of(*occasion.key, 1) * MOST_FLIPPED)):
            bit = int(self.uniforms.of(*occasion.key, 2 + number) * 8 * len(data))
            wrong[bit // 8] ^= 1 << bit % 8
        return [(0, bytes(wrong))]


@dataclass(frozen=True, slots=True)
class Repeated:
    """A second copy, perhaps later.

    Attributes:
        uniforms: Chance by occasion.
        share: Of the packets.
        mean_delay_s: Of the second copy, exponential.
    """

    uniforms: KeyedUniforms
    share: float
    mean_delay_s: float

    def copies(self, data: bytes, occasion: Occasion) -> Copies | None:
        """See `PacketChange.copies`."""
        if self.uniforms.of(*occasion.key, 0) >= self.share:
            return None
        return [(0, data), (self.uniforms.exponential_ns(self.mean_delay_s, *occasion.key, 1), data)]


@dataclass(frozen=True, slots=True)
class Late:
    """It comes later.

    Attributes:
        uniforms: Chance by occasion.
        share: Of the packets.
        mean_s: Mean of the exponential delay.
    """

    uniforms: KeyedUniforms
    share: float
    mean_s: float

    def copies(self, data: bytes, occasion: Occasion) -> Copies | None:
        """See `PacketChange.copies`."""
        if self.uniforms.of(*occasion.key, 0) >= self.share:
            return None
        return [(max(1, self.uniforms.exponential_ns(self.mean_s, *occasion.key, 1)), data)]


def undetected(share: float, undetected_share: float) -> float:
    """Chance that a frame which passed its checksum is wrong, where `share` are corrupted and some of them pass."""
    detected = share * (1.0 - undetected_share)
    return share * undetected_share / (1.0 - detected) if detected < 1.0 else 0.0
