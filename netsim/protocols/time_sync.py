"""Flooding time synchronisation: every node sets its clock by the root's.

Maroti, Kusy, Simon, Ledeczi, "The flooding time synchronization protocol", SenSys 2004. The root broadcasts its time once a
period, with a sequence number. Every other node takes the first message of each number, as a pair of its own counter at
the start of the frame and the time that the sender's link layer wrote into it, and passes the number on at its own moment
of each period, with its own estimate of the root's time. Offset and rate are a regression line through the last pairs.

Left out of the paper's protocol: the election of a new root when the root falls silent (the nodes then run on with the
last line), and byte-wise time stamps, which the link layer's single stamp with its error stands for.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal

from annotated_types import Ge, Le

from netsim.api import SERVICE_PREFIX, Message, NodeHandle, Op
from netsim.codec import Record
from netsim.parameters import NonNegativeInt, Positive, PositiveInt, parameters
from netsim.units import s_to_ns

TIME_SYNC: Final = f"{SERVICE_PREFIX}time-sync"
OPERATIONS_PER_ENTRY: Final = 10
"""Additions and multiplications per pair in the regression."""
_HEAD: Final = Record("HH")  # root, sequence number modulo 65,536; the stamp follows
_STAMP_BYTE: Final = 8
_PPB: Final = 10**9
MOST_RATE_PPB: Final = 1_000_000
"""What `adjust_clock` takes."""


@parameters
class FloodingTimeSyncParameters:
    """Flooding time synchronisation (Maroti et al. 2004): the nodes set their clocks by the root's."""

    type: Literal["ftsp"] = "ftsp"
    root: NonNegativeInt | None = None
    """Node whose clock the others follow; the one with the lowest id by default."""
    period_s: Positive = 10.0
    """Time between two messages of a node."""
    entries: Annotated[int, Ge(2), Le(64)] = 8
    """Pairs in the regression."""
    entries_to_send: PositiveInt = 3
    """A node passes the time on once it has so many pairs."""
    restart_above_s: Positive = 0.001
    """A pair further off than this from the line discards the older ones: the sender's clock must have jumped."""

    def __post_init__(self) -> None:
        """Nobody may wait for more pairs than are kept."""
        if self.entries_to_send > self.entries:
            message = "entries_to_send of at most entries"
            raise ValueError(message)


@dataclass(slots=True)
class Regression:
    """A line through the last pairs of own counter and reference time, in whole numbers.

    Args:
        entries: How many pairs are kept.
    """

    entries: int
    pairs: deque[tuple[int, int]] = field(init=False)
    _mean_ns: int = 0
    _offset_ns: int = 0
    _numerator: int = 0
    _denominator: int = 1

    def __post_init__(self) -> None:
        """Begin with no pairs."""
        self.pairs = deque(maxlen=self.entries)

    def add(self, counter_ns: int, reference_ns: int) -> None:
        """One more pair; the oldest goes if there are too many."""
        self.pairs.append((counter_ns, reference_ns))
        count = len(self.pairs)
        self._mean_ns = sum(counter for counter, _ in self.pairs) // count
        self._offset_ns = sum(reference - counter for counter, reference in self.pairs) // count
        deviations = [(c - self._mean_ns, r - c - self._offset_ns) for c, r in self.pairs]
        self._numerator = sum(x * y for x, y in deviations)
        self._denominator = sum(x * x for x, _ in deviations) or 1

    def reference_ns(self, counter_ns: int) -> int:
        """The reference time that belongs to a counter reading, by the line."""
        elapsed_ns = counter_ns - self._mean_ns
        return counter_ns + self._offset_ns + elapsed_ns * self._numerator // self._denominator

    @property
    def rate_ppb(self) -> int:
        """How much faster than the counter the reference runs, to the nearest part in 10^9, within what can be set."""
        rate_ppb = (2 * self._numerator * _PPB + self._denominator) // (2 * self._denominator)
        return max(-MOST_RATE_PPB, min(MOST_RATE_PPB, rate_ppb))


def flooding_time_sync(node: NodeHandle, parameters: FloodingTimeSyncParameters, root: int) -> Op[None]:
    """Take part for ever: beside an algorithm, with `spawn`.

    Args:
        node: The node; its clock is set, unless it is the root.
        parameters: Period and regression.
        root: Node whose clock the others follow.
    """
    follower = None if node.id == root else _Follower(parameters)
    period_ns = s_to_ns(parameters.period_s)
    due_ns = node.counter_ns + int(node.rng("time-sync").random() * period_ns)
    while True:
        wait_ns = max(0, due_ns - node.counter_ns)
        message = yield from node.receive(kinds={TIME_SYNC}, timeout_ns=wait_ns)
        if message is not None:
            if follower is not None:
                yield from follower.take(node, message)
            continue
        sent_in = due_ns // period_ns  # of the counter, so that a root that reboots goes on where it was
        due_ns += period_ns
        if follower is None:
            sequence = sent_in & 0xFFFF
            node.broadcast_stamped(TIME_SYNC, _HEAD.pack(root, sequence) + bytes(_STAMP_BYTE))
        elif follower.may_send:
            node.broadcast_stamped(TIME_SYNC, _HEAD.pack(root, follower.newest) + bytes(_STAMP_BYTE))


class _Follower:
    """What a node keeps that follows the root."""

    def __init__(self, parameters: FloodingTimeSyncParameters) -> None:
        self._parameters = parameters
        self._line = Regression(parameters.entries)
        self.newest = 0

    @property
    def may_send(self) -> bool:
        """Whether its estimate is good enough for others."""
        return len(self._line.pairs) >= self._parameters.entries_to_send

    def take(self, node: NodeHandle, message: Message) -> Op[None]:
        """Take a message of a sequence number that is new, and set the clock."""
        if len(message.payload) != _HEAD.size_byte + _STAMP_BYTE:
            return  # damaged on the way
        _, sequence = _HEAD.unpack(message.payload, 0)
        is_new = not self._line.pairs or 0 < (sequence - self.newest) & 0xFFFF < 0x8000
        if not is_new or message.frame_began_ns is None:
            return
        self.newest = sequence
        stamp_ns = int.from_bytes(message.payload[_HEAD.size_byte :], "little", signed=True)
        error_ns = stamp_ns - self._line.reference_ns(message.frame_began_ns)
        if self.may_send and abs(error_ns) > s_to_ns(self._parameters.restart_above_s):
            self._line.pairs.clear()
        self._line.add(message.frame_began_ns, stamp_ns)
        yield from node.compute(OPERATIONS_PER_ENTRY * len(self._line.pairs))
        counter_ns, now_ns = node.counter_ns, node.now_ns
        node.adjust_clock(self._line.reference_ns(counter_ns) - now_ns, self._line.rate_ppb)
