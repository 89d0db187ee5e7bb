"""What a node has heard of tracks: the latest claim of every thread, and who said it."""

from collections.abc import Iterator
from dataclasses import dataclass

from netsim.algorithms.idsq_messages import Claim, Thread


@dataclass(frozen=True, slots=True)
class Heard:
    """A claim that was heard, or made by this node.

    Attributes:
        claim: The claim.
        heard_ns: When, by the node's clock.
    """

    claim: Claim
    heard_ns: int


class Book:
    """See the module."""

    def __init__(self) -> None:
        self._latest: dict[Thread, Heard] = {}
        self._spoke_ns: dict[tuple[Thread, int], int] = {}

    def note(self, claim: Claim, source: int, now_ns: int) -> None:
        """Take down a claim, unless one is known that counts more, and that its source has spoken."""
        self._spoke_ns[claim.thread, source] = now_ns
        known = self._latest.get(claim.thread)
        if known is None or known.claim.rank <= claim.rank:
            self._latest[claim.thread] = Heard(claim, now_ns)

    def latest(self, thread: Thread) -> Claim | None:
        """The claim of a thread that counts."""
        heard = self._latest.get(thread)
        return None if heard is None else heard.claim

    def since(self, time_ns: int) -> Iterator[Claim]:
        """The claims that count and that were heard at a time or later."""
        return (heard.claim for heard in self._latest.values() if heard.heard_ns >= time_ns)

    def spoke_since(self, thread: Thread, node: int, time_ns: int) -> bool:
        """Whether a node has said anything of a thread at a time or later."""
        return self._spoke_ns.get((thread, node), -1) >= time_ns
