"""Communication-sensitive message passing: which computed messages are worth sending (Chen et al. 2006, section 5).

The central loop and the distributed algorithm share the objects of this module, so that both take the same decisions.
Round 0 is the start round: the uniform messages that all begin from. Messages are computed from round 1 on.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.errors import ScenarioError
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
    """

    tolerance: float | None = None
    first_round: Literal["init", "both", "ones"] = "init"
    log_base: Literal["e", "2"] = "e"
    support: Literal["full", "projected"] = "full"
    compare_with: Literal["last_sent", "previous_generated"] = "last_sent"
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping < 1.0:
            text = f"damping must lie in [0, 1), got {self.damping}"
            raise ScenarioError(text)
        if self.tolerance is not None and not self.tolerance >= 0.0:
            text = f"the message tolerance must be 0 or more, got {self.tolerance}"
            raise ScenarioError(text)


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
        divergence: How far it is from the message it is compared with.
    """

    message: FloatArray
    send: bool
    divergence: float


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

    def _over_states(self, message: FloatArray) -> FloatArray:
        return normalise_over_states(message, self._log_multiplicity)

    def decide(self, computed: FloatArray, tolerance: float | None = None) -> Decision:
        """Whether to send a newly computed message; remembers what the next one is compared with.

        Args:
            computed: The message.
            tolerance: Replaces the rule's for this once, unless the rule has none.
        """
        rule = self._rule
        message = self._damped(computed)
        spread = self._over_states(message)
        change = divergence(spread, self._reference, self._multiplicity, rule.log_base)
        always = rule.tolerance is None or (self._first and rule.first_round == "both")
        send = always or change > (tolerance if tolerance is not None else rule.tolerance or 0.0)
        if send or rule.compare_with == "previous_generated":
            self._before, self._reference = self._reference, spread
        self._first, self._generated = False, message
        return Decision(message, send, change)

    def take_back(self) -> None:
        """The message sent last did not arrive: the next is compared with what the receiver has had before it."""
        if self._rule.compare_with == "last_sent":
            self._reference = self._before

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
        self._sends_start = rule.first_round != "ones"
        self._edges = {other: EdgeMemory(rule, vertex.multiplicity(other)) for other in vertex.neighbours}

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
        computed = self.vertex.outgoing(incoming, semiring)
        decisions = {other: self._edges[other].decide(message, tolerance) for other, message in computed.items()}
        sent = {other: decision.message for other, decision in decisions.items() if decision.send}
        return RoundOutput(sent, len(computed), max((d.divergence for d in decisions.values()), default=0.0))

    def take_back(self, neighbour: int) -> None:
        """See `EdgeMemory.take_back`."""
        self._edges[neighbour].take_back()
