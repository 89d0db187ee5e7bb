"""An adaptive message tolerance: which messages are worth sending, without a tolerance chosen for the problem at hand.

Chen, Wainwright, Cetin, Willsky 2006 leave open (section VI-A) how to choose the tolerance of communication-sensitive
message passing in advance. A fixed one errs because eq (19) weighs a message by itself: a change in states that the
receiver excludes counts, one among states that the message finds unlikely but the receiver must choose from does not. Here

1. the change is measured in the *receiver's belief* as far as the sender knows it. Where both directions of an edge speak
   of the same variable (a variable and its factor, a sensor and a target it covers), the receiver's last message is its
   belief without ours: the estimate is our message times that message. Elsewhere it is our message alone.
2. A change that leaves the receiver's estimated *best state* as it is counts a fraction only.
3. The tolerance starts high and falls to its final value in a few rounds, so that what tells most goes first and what
   follows takes it into account: residual scheduling (Elidan, McGraw, Koller 2006) without a common queue.
4. Where messages get lost, the last one is *repeated*. In the start round every neighbour sends, so that a vertex that
   misses one knows of loss and how much, unless it never hears of that neighbour at all; a repeated message tells its
   receiver, who might have missed none, the same.

The constants hold for all problems; they were fixed on other random problems than those they were judged on.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, log
from typing import Protocol, runtime_checkable

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.semiring import FloatArray, log_normalise
from netsim.kernels.vertex import Vertex


@runtime_checkable
class SharesStates(Protocol):
    """A vertex that can tell on which edges both directions speak of the same states."""

    def shares_states(self, neighbour: int) -> bool:
        """Whether messages from and to `neighbour` are indexed by the states of the same variable."""
        ...


def shared_edges(vertex: Vertex) -> frozenset[int]:
    """The neighbours whose last message to the vertex is, state by state, what they believe without it."""
    if not isinstance(vertex, SharesStates):
        return frozenset()
    return frozenset(other for other in vertex.neighbours if vertex.shares_states(other))


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaptiveTolerance:
    """Constants of the rule.

    Attributes:
        settled: Tolerance from the round on in which it has fallen, in nats of the receiver's estimated belief; with 0
            and `first` 1 every change of that belief is sent.
        unchanged: Divisor of a change that leaves the receiver's best state as it is, 1 or more.
        first: In the first round of computed messages the tolerance is this many times `settled`, 1 or more.
        decay: Factor of the tolerance from round to round until it is `settled`, in (0, 1).
        lost_share: Repeats are made until at most this share of messages should be lost, in (0, 1).
        rumoured_loss: Frame loss assumed by a vertex that missed no start message but heard a repeated one, in (0, 1).
        most_repeats: However great the loss, no more repeats than this; 0 for none at all.
    """

    settled: float = 0.05
    unchanged: float = 4.0
    first: float = 8.0
    decay: float = 0.5
    lost_share: float = 0.02
    rumoured_loss: float = 0.1
    most_repeats: int = 5

    def __post_init__(self) -> None:
        shares = self.decay, self.lost_share, self.rumoured_loss
        if not (
            self.settled >= 0.0 and self.unchanged >= 1.0 and self.first >= 1.0 and all(0.0 < s < 1.0 for s in shares)
        ):
            text = (
                "an adaptive tolerance needs settled >= 0, unchanged and first >= 1, and its shares and decay in (0, 1)"
            )
            raise ScenarioError(text)

    def in_round(self, number: int) -> float:
        """The tolerance in a round; 1 is the first with computed messages."""
        return self.settled * max(1.0, self.first * self.decay ** (number - 1))

    @property
    def rounds_until_settled(self) -> int:
        """The first round in which the tolerance is `settled`."""
        return 1 + ceil(log(self.first) / -log(self.decay) - 1e-9)

    def repeats(self, loss: float) -> int:
        """How often a message is repeated at a frame loss in [0, 1): until loss^(1 + repeats) <= `lost_share`.

        But no more often than `most_repeats`.
        """
        if loss <= 0.0:
            return 0
        return min(self.most_repeats, max(0, ceil(log(self.lost_share) / log(loss) - 1e-9) - 1))

    def change(self, new_log: FloatArray, old_log: FloatArray, elsewhere_log: FloatArray) -> float:
        """How much a new message would change what its receiver believes.

        Args:
            new_log: Log of the new message, shape (n,).
            old_log: Log of the one the receiver has.
            elsewhere_log: Log of what the receiver knows without it, as far as the sender can tell.

        Returns:
            Kullback-Leibler divergence in nats of the belief with the new from that with the old message, divided by
            `unchanged` when both have the same single best state; infinity when a belief becomes possible that was not, or
            when nothing is possible with one of them.
        """
        new, old = new_log + elsewhere_log, old_log + elsewhere_log
        if new.max() == -np.inf or old.max() == -np.inf:
            return np.inf
        divergence = _divergence(log_normalise(new), log_normalise(old))
        best = [np.flatnonzero(belief >= belief.max() - _TIE) for belief in (new, old)]
        stays = len(best[0]) == len(best[1]) == 1 and best[0][0] == best[1][0]
        return divergence / self.unchanged if stays else divergence


_TIE = 1e-9
"""Log weights closer than this are equal: sums in another order differ by less."""


def _divergence(new_log: FloatArray, old_log: FloatArray) -> float:
    """Kullback-Leibler divergence in nats of two normalised log distributions."""
    possible = new_log > -np.inf
    new_log, old_log = new_log[possible], old_log[possible]
    if old_log.min() == -np.inf:
        return np.inf
    return max(0.0, float((np.exp(new_log) * (new_log - old_log)).sum()))


class LossSuspicion:
    """What one vertex knows of frame loss from what it hears.

    A start message that did not come tells of loss. But a neighbour of which nothing has been heard when the tolerance has
    settled may as well be dead, and repeating is of no use to the dead: from then on it does not count.

    Args:
        rule: The rule's constants.
        neighbours: Who sends to the vertex; all do so in the start round.
    """

    def __init__(self, rule: AdaptiveTolerance, neighbours: tuple[int, ...]) -> None:
        self._rule = rule
        self._neighbours = frozenset(neighbours)
        self._heard: dict[int, FloatArray] | None = None
        self._missed: frozenset[int] = frozenset()
        self._computed: set[int] = set()  # neighbours of which a message later than the start message came
        self._rumoured = False
        self._rounds = 0
        self.loss = 0.0

    def listen(self, incoming: Mapping[int, FloatArray]) -> None:
        """Take in the last message of each neighbour, once a round, before anything else is computed from it."""
        self._rounds += 1
        if self._heard is None:
            self._missed = self._neighbours - incoming.keys()
        else:
            new = {each for each, message in incoming.items() if self._heard.get(each) is not message}
            repeated = (np.array_equal(self._heard[each], incoming[each]) for each in new & self._computed)
            self._rumoured = self._rumoured or any(repeated)
            self._computed |= new
        self._heard = dict(incoming)
        self.loss = self._estimate(self._missed - incoming.keys())

    def _estimate(self, unheard: frozenset[int]) -> float:
        """The share of lost messages, given the neighbours never heard."""
        dead = unheard if self._rounds > self._rule.rounds_until_settled else frozenset()
        missed = len(self._missed - dead)
        if missed:  # one more success and failure than seen: four neighbours are a small sample
            return (missed + 1.0) / (len(self._neighbours - dead) + 2.0)
        return self._rule.rumoured_loss if self._rumoured else 0.0

    @property
    def repeats(self) -> int:
        """How often the last message of an edge should be repeated."""
        return self._rule.repeats(self.loss)
