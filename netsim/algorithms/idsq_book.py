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
        self._said: dict[tuple[Thread, int], Heard] = {}

    def note(self, claim: Claim, source: int, now_ns: int) -> None:
        """Take down what a node says, and the claim itself unless one is known that counts more."""
        self._said[claim.thread, source] = Heard(claim, now_ns)
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

    def said_since(self, thread: Thread, node: int, time_ns: int) -> Claim | None:
        """What a node has said last of a thread, if at a time or later."""
        heard = self._said.get((thread, node))
        return None if heard is None or heard.heard_ns < time_ns else heard.claim
