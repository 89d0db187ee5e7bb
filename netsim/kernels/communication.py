"""Communication-sensitive message passing: which computed messages are worth sending (Chen et al. 2006, section 5).

The central loop and the distributed algorithm share the objects of this module, so that both take the same decisions.
Round 0 is the start round: the uniform messages that all begin from. Messages are computed from round 1 on.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.adaptive_tolerance import AdaptiveTolerance, LossSuspicion, shared_edges
from netsim.kernels.semiring import FloatArray, Semiring, log_normalise, uniform
from netsim.kernels.vertex import Incoming, Vertex


@dataclass(frozen=True, slots=True, kw_only=True)
class CommunicationRule:
    """When a message is sent, with the choices that the paper leaves open.

    Attributes:
        tolerance: A message is sent if its divergence exceeds this; None sends always (standard max- or sum-product).
        first_round: `init`: the uniform start messages are sent and counted, and the first computed message is
            compared with them. `both`: as `init`, but the first computed message is always sent. `ones`: start messages
            are all ones, neither normalised nor sent.
        log_base: Base of the logarithm in the divergence.
        support: `full`: the divergence runs over the receiver's full state space; `projected`: over message entries.
        compare_with: `last_sent` message on the edge, or the `previous_generated` one, sent or not.
        damping: Weight of the previously generated message, in the log domain, in [0, 1); 0 is the plain update.
        adaptive: Replaces `tolerance`, `log_base`, `support` and `compare_with`: the change of the receiver's estimated
            belief is compared with a tolerance that needs no choice (see `netsim.kernels.adaptive_tolerance`).
        messages_per_round: Most messages that a vertex sends in a round after the start round: those with the largest
            divergence (residual; Elidan, McGraw, Koller 2006) of those the rule would send; None for no limit.
    """

    tolerance: float | None = None
    first_round: Literal["init", "both", "ones"] = "init"
    log_base: Literal["e", "2"] = "e"
    support: Literal["full", "projected"] = "full"
    compare_with: Literal["last_sent", "previous_generated"] = "last_sent"
    damping: float = 0.0
    adaptive: AdaptiveTolerance | None = None
    messages_per_round: int | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping < 1.0:
            text = f"damping must lie in [0, 1), got {self.damping}"
            raise ScenarioError(text)
        if self.tolerance is not None and not self.tolerance >= 0.0:
            text = f"the message tolerance must be 0 or more, got {self.tolerance}"
            raise ScenarioError(text)
        if self.messages_per_round is not None and self.messages_per_round < 1:
            text = f"messages_per_round must be 1 or more, or null for no limit, got {self.messages_per_round}"
            raise ScenarioError(text)
        if self.messages_per_round is not None and self.compare_with == "previous_generated":
            text = "messages_per_round would lose what it puts off with compare_with: previous_generated; use last_sent"
            raise ScenarioError(text)

    @property
    def sends_always(self) -> bool:
        """Whether every message is sent, changed or not: standard message passing."""
        return self.tolerance is None and self.adaptive is None

    @property
    def first_quiet_round(self) -> int:
        """First round in which no message sent means that none will be, as long as none is lost."""
        return 1 if self.adaptive is None else self.adaptive.rounds_until_settled


def divergence(new_log: FloatArray, old_log: FloatArray, multiplicity: FloatArray, base: Literal["e", "2"]) -> float:
    r"""Kullback-Leibler divergence of a new message from an old one, eq (19), for messages given by entry.

    Computed as $\sum_e c_e (M_e \ln (M_e / Q_e) - M_e + Q_e)$, which equals eq (19) when both sum to one, extends it to
    messages that do not, is never negative and exactly 0 for equal messages. With 0 ln 0 = 0.

    Args:
        new_log: Log of M, shape (n,).
        old_log: Log of Q, shape (n,).
        multiplicity: How many states c each entry stands for.
        base: Of the logarithm.

    Returns:
        The divergence in nats or bits; infinity when M has a state that Q lacks.
    """
    possible = new_log > -np.inf
    lost = 0.0
    if not possible.all():
        lost = float((multiplicity[~possible] * np.exp(old_log[~possible])).sum())
        new_log, old_log, multiplicity = new_log[possible], old_log[possible], multiplicity[possible]
    if old_log.min() == -np.inf:
        return np.inf
    # Not a dot product: BLAS may split it over threads, and runs must be equal bit for bit.
    total = float((multiplicity * _bregman(new_log, old_log)).sum()) + lost
    return total / float(np.log(2.0)) if base == "2" else total


def _bregman(new_log: FloatArray, old_log: FloatArray) -> FloatArray:
    """M ln (M / Q) - M + Q, without cancellation where both are close."""
    step = new_log - old_log
    small = np.abs(step) < 1.0
    near = np.where(small, step, 0.0)
    close: FloatArray = np.exp(new_log) * np.maximum(np.expm1(-near) + near, 0.0)
    if small.all():
        return close
    return np.where(small, close, np.exp(new_log) * (step - 1.0) + np.exp(old_log))


def normalise_over_states(message: FloatArray, log_multiplicity: FloatArray) -> FloatArray:
    """Shift a log message so that it sums to one over the receiver's states rather than over its entries."""
    return np.asarray(log_normalise(message + log_multiplicity) - log_multiplicity)


@dataclass(frozen=True, slots=True)
class Decision:
    """What to do with a computed message.

    Attributes:
        message: The message, damped if the rule says so.
        send: Whether to send it.
        divergence: How far the computed message is from the one it is compared with.
        repeat: Whether `message` is the last one sent over again, in case it was lost.
    """

    message: FloatArray
    send: bool
    divergence: float
    repeat: bool = False


@dataclass(frozen=True, slots=True)
class View:
    """What a sender knows of an edge beside the message it has computed.

    Attributes:
        round: Number of the round, 1 for the first with computed messages.
        tolerance: Replaces the rule's for this once, unless the rule has none.
        elsewhere: Log of what the receiver believes without our message, over that message's entries; None if unknown.
        repeats: How often the last message of an edge is repeated because messages get lost.
    """

    round: int = 1
    tolerance: float | None = None
    elsewhere: FloatArray | None = None
    repeats: int = 0


_NOTHING_MORE = View()


class EdgeMemory:
    """A sender's memory of one directed edge.

    Args:
        rule: The rule in force.
        multiplicity: How many states of the receiver each entry of a message stands for.
    """

    def __init__(self, rule: CommunicationRule, multiplicity: FloatArray) -> None:
        self._rule = rule
        self._multiplicity = multiplicity if rule.support == "full" else np.ones(len(multiplicity))
        self._log_multiplicity = np.log(self._multiplicity)
        self._generated = uniform(len(multiplicity))
        ones = rule.first_round == "ones"
        self._reference = np.zeros(len(multiplicity)) if ones else self._over_states(self._generated)
        self._before = self._reference
        self._first = True
        self._sent: FloatArray | None = None
        self._repeated = 0

    def _over_states(self, message: FloatArray) -> FloatArray:
        return normalise_over_states(message, self._log_multiplicity)

    def decide(self, computed: FloatArray, view: View = _NOTHING_MORE) -> Decision:
        """Whether to send a newly computed message; remembers what the next one is compared with.

        Args:
            computed: The message.
            view: What else the sender knows.
        """
        decision = self.consider(computed, view)
        self.remember(decision)
        return decision

    def consider(self, computed: FloatArray, view: View = _NOTHING_MORE) -> Decision:
        """As `decide`, but what is sent after all is left to `remember`."""
        rule = self._rule
        message = self._damped(computed)
        change = self._change(message, view)
        always = rule.sends_always or (self._first and rule.first_round == "both")
        send = always or change > self._tolerance(view)
        self._first, self._generated = False, message
        if not send and self._sent is not None and self._repeated < view.repeats:
            self._repeated += 1
            return Decision(self._sent.copy(), send=True, divergence=change, repeat=True)
        return Decision(message, send, change)

    def take_back(self) -> None:
        """The message sent last did not arrive: the next is compared with what the receiver has had before it."""
        if self._rule.compare_with == "last_sent":
            self._reference = self._before

    def _change(self, message: FloatArray, view: View) -> float:
        adaptive = self._rule.adaptive
        spread = self._over_states(message)
        if adaptive is None:
            return divergence(spread, self._reference, self._multiplicity, self._rule.log_base)
        elsewhere = view.elsewhere if view.elsewhere is not None else np.zeros(len(message))
        return adaptive.change(spread, self._reference, elsewhere)

    def _tolerance(self, view: View) -> float:
        if view.tolerance is not None:
            return view.tolerance
        if self._rule.adaptive is not None:
            return self._rule.adaptive.in_round(view.round)
        return self._rule.tolerance or 0.0

    def remember(self, decision: Decision) -> None:
        """Take note of what became of the message last considered."""
        if decision.repeat:
            return
        if decision.send or (self._rule.compare_with == "previous_generated" and self._rule.adaptive is None):
            self._before, self._reference = self._reference, self._over_states(decision.message)
        if decision.send:
            self._sent, self._repeated = decision.message, 0

    def _damped(self, computed: FloatArray) -> FloatArray:
        damping = self._rule.damping
        if damping == 0.0:
            return computed
        return log_normalise((1.0 - damping) * computed + damping * self._generated)


@dataclass(frozen=True, slots=True)
class RoundOutput:
    """What one vertex does in one round.

    Attributes:
        sent: The messages to send, by neighbour.
        computed: How many messages were computed, sent or not.
        largest_change: Largest divergence of a computed message from what it is compared with.
    """

    sent: dict[int, FloatArray]
    computed: int
    largest_change: float


class VertexSender:
    """A vertex with its memory of what it sent: computes and selects messages round by round.

    Args:
        vertex: The vertex.
        rule: When a message is sent.
    """

    def __init__(self, vertex: Vertex, rule: CommunicationRule) -> None:
        self.vertex = vertex
        self._rule = rule
        self._sends_start = rule.first_round != "ones"
        self._edges = {other: EdgeMemory(rule, vertex.multiplicity(other)) for other in vertex.neighbours}
        listens = rule.adaptive is not None and self._sends_start
        self._suspicion = LossSuspicion(rule.adaptive, vertex.neighbours) if rule.adaptive and listens else None
        self._shared = shared_edges(vertex) if rule.adaptive is not None else frozenset()
        self._round = 0
        self._computed: dict[int, FloatArray] | None = None
        self._seen: Incoming = {}
        self._semiring: Semiring | None = None

    def start(self) -> RoundOutput:
        """Round 0: the uniform messages, unless the rule has none."""
        if not self._sends_start:
            return RoundOutput({}, 0, 0.0)
        sent = {other: uniform(self.vertex.outgoing_size(other)) for other in self.vertex.neighbours}
        return RoundOutput(sent, len(sent), 0.0)

    def step(self, incoming: Incoming, semiring: Semiring, tolerance: float | None = None) -> RoundOutput:
        """A later round: compute every outgoing message and select those to send.

        Args:
            incoming: The last message of each neighbour.
            semiring: Max-product or sum-product.
            tolerance: Replaces the rule's in this round, unless the rule has none.
        """
        self._round += 1
        if self._suspicion is not None:
            self._suspicion.listen(incoming)
        computed = self._outgoing(incoming, semiring)
        considered = {
            other: self._edges[other].consider(message, self._view(other, incoming, tolerance))
            for other, message in computed.items()
        }
        decisions = largest(considered, self._rule.messages_per_round)
        for other, decision in decisions.items():
            self._edges[other].remember(decision)
        sent = {other: decision.message for other, decision in decisions.items() if decision.send}
        return RoundOutput(sent, len(computed), max((d.divergence for d in decisions.values()), default=0.0))

    def take_back(self, neighbour: int) -> None:
        """See `EdgeMemory.take_back`."""
        self._edges[neighbour].take_back()

    def _outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """The messages, computed anew only if one of those they come from is another than last time."""
        same = len(incoming) == len(self._seen) and all(self._seen.get(k) is each for k, each in incoming.items())
        if self._computed is None or not same or self._semiring is not semiring:
            self._computed, self._semiring, self._seen = (
                self.vertex.outgoing(incoming, semiring),
                semiring,
                dict(incoming),
            )
        return self._computed

    def _view(self, other: int, incoming: Incoming, tolerance: float | None) -> View:
        elsewhere = incoming.get(other) if other in self._shared else None
        repeats = self._suspicion.repeats if self._suspicion is not None else 0
        return View(self._round, tolerance, elsewhere, repeats)


def largest(decisions: Mapping[int, Decision], most: int | None) -> dict[int, Decision]:
    """Put off all but some of the messages to send: those with the largest divergence go, of equals the first.

    Args:
        decisions: What is to be done with each message, by neighbour.
        most: How many may go; None for all.
    """
    wanted = [other for other, decision in decisions.items() if decision.send]
    if most is None or len(wanted) <= most:
        return dict(decisions)
    going = set(sorted(wanted, key=lambda other: -decisions[other].divergence)[:most])
    return {other: each if other in going else replace(each, send=False) for other, each in decisions.items()}
