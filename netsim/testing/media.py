"""What carries messages in a test: media, and the rules that script them."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from netsim.units import s_to_ns

Verdict = tuple[int, ...]
"""What becomes of a message at one receiver: the extra delay in ns of every copy that arrives; none if it is lost."""
PASS: Final[Verdict] = (0,)
DROP: Final[Verdict] = ()


def delay(extra_s: float) -> Verdict:
    """It arrives later than usual."""
    return (s_to_ns(extra_s),)


def duplicate(after_s: float) -> Verdict:
    """It arrives as usual and once more, `after_s` later."""
    return (0, s_to_ns(after_s))


@dataclass(frozen=True, slots=True)
class Passage:
    """A message on its way to one receiver, as rules see it.

    Attributes:
        source: Who sent it.
        destination: Who is to receive it: one passage for each receiver of a broadcast.
        kind: Its kind.
        payload: Its bytes.
        time_ns: When it was sent.
        count: How many messages of this kind went from source to destination before it.
        is_broadcast: Whether it was sent to all.
    """

    source: int
    destination: int
    kind: str
    payload: bytes
    time_ns: int
    count: int
    is_broadcast: bool


Rule = Callable[[Passage], Verdict | None]
"""Decides about a passage; None leaves it to the next rule."""


def rule(
    verdict: Verdict,
    *,
    source: int | None = None,
    destination: int | None = None,
    kind: str | None = None,
    counts: Collection[int] | None = None,
    from_s: float = 0.0,
    until_s: float = math.inf,
    when: Callable[[Passage], bool] | None = None,
) -> Rule:
    """A rule that gives `verdict` where everything named holds.

    Args:
        verdict: `PASS`, `DROP`, `delay(...)` or `duplicate(...)`.
        source: Only messages of this node.
        destination: Only messages to this node.
        kind: Only messages of this kind.
        counts: Only these of the kind's messages on the edge, counted from 0: `{0}` is the first.
        from_s: Only messages sent at this time or later.
        until_s: Only messages sent before this time.
        when: Only where this holds.
    """

    def decide(passage: Passage) -> Verdict | None:
        fits = (
            source in (None, passage.source)
            and destination in (None, passage.destination)
            and kind in (None, passage.kind)
            and (counts is None or passage.count in counts)
            and from_s * 1e9 <= passage.time_ns < until_s * 1e9
            and (when is None or when(passage))
        )
        return verdict if fits else None

    return decide


class MessageMedium(Protocol):
    """What carries messages in a test."""

    @property
    def delay_s(self) -> float:
        """Usual time from sending to reception."""
        ...

    def verdict(self, passage: Passage) -> Verdict:
        """What becomes of a message."""
        ...


@dataclass(frozen=True, slots=True)
class PerfectMedium:
    """Everything arrives, `delay_s` after it was sent."""

    delay_s: float = 1e-3

    def verdict(self, passage: Passage) -> Verdict:
        """See `MessageMedium.verdict`."""
        return PASS


@dataclass(frozen=True, slots=True)
class ScriptedMedium:
    """Rules decide; the first that has an opinion counts, and without one the message passes."""

    rules: Sequence[Rule]
    delay_s: float = 1e-3

    def verdict(self, passage: Passage) -> Verdict:
        """See `MessageMedium.verdict`."""
        verdicts = (decide(passage) for decide in self.rules)
        return next((verdict for verdict in verdicts if verdict is not None), PASS)
