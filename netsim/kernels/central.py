"""Message passing in one place, in synchronous rounds: the reference that a distributed run must equal bit for bit."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from netsim.kernels.communication import CommunicationRule, RoundOutput, VertexSender
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.vertex import Vertex


@dataclass(frozen=True, slots=True)
class RoundCount:
    """One round in figures.

    Attributes:
        round: Its number; 0 is the start round.
        computed: Messages computed.
        sent: Directed edges on which a message was sent, ascending.
        largest_change: Largest divergence of a computed message from what it is compared with.
    """

    round: int
    computed: int
    sent: tuple[tuple[int, int], ...]
    largest_change: float


@dataclass(frozen=True, slots=True)
class Result:
    """Outcome of message passing.

    Attributes:
        incoming: For each vertex the last message it received from each neighbour.
        beliefs: For each vertex its belief, log domain.
        rounds: One entry a round, the start round first.
        converged_round: First round in which no message was sent (with a tolerance) or none changed (without); None
            when there was none.
    """

    incoming: Mapping[int, Mapping[int, FloatArray]]
    beliefs: Mapping[int, FloatArray]
    rounds: tuple[RoundCount, ...]
    converged_round: int | None

    @property
    def messages_sent(self) -> int:
        """Messages sent over all rounds, the start round included."""
        return sum(len(count.sent) for count in self.rounds)


def run_synchronous(
    vertices: Iterable[Vertex],
    semiring: Semiring,
    rounds: int,
    rule: CommunicationRule | None = None,
    *,
    settled: float = 1e-12,
    stop_when_converged: bool = True,
    lost: Callable[[int, int, int], bool] | None = None,
) -> Result:
    """Pass messages in synchronous rounds: each round computes from what was received before it.

    Args:
        vertices: All vertices of the model.
        semiring: Max-product or sum-product.
        rounds: Most rounds of computed messages, after the start round.
        rule: Which messages are sent; None is the standard algorithm, which sends all.
        settled: Without a tolerance: largest divergence of a message from its predecessor that counts as no change.
        stop_when_converged: Whether to end there.
        lost: Whether a message of a round from one vertex to another is lost on the way; None for no loss.

    Raises:
        ScenarioError: When the model contradicts itself.
    """
    rule = rule or CommunicationRule()
    senders = {vertex.id: VertexSender(vertex, rule) for vertex in sorted(vertices, key=lambda vertex: vertex.id)}
    incoming: dict[int, dict[int, FloatArray]] = {vertex: {} for vertex in senders}
    outputs = {vertex: sender.start() for vertex, sender in senders.items()}
    counts = [_deliver(outputs, incoming, 0, lost)]
    converged = None
    for number in range(1, rounds + 1):
        outputs = {vertex: sender.step(incoming[vertex], semiring) for vertex, sender in senders.items()}
        counts.append(_deliver(outputs, incoming, number, lost))
        quiet = counts[-1].largest_change <= settled if rule.sends_always else not counts[-1].sent
        if converged is None and quiet and number >= rule.first_quiet_round:
            converged = number
        if converged is not None and stop_when_converged:
            break
    beliefs = {vertex: sender.vertex.belief(incoming[vertex], semiring) for vertex, sender in senders.items()}
    return Result(incoming, beliefs, tuple(counts), converged)


def _deliver(
    outputs: Mapping[int, RoundOutput],
    incoming: Mapping[int, dict[int, FloatArray]],
    number: int,
    lost: Callable[[int, int, int], bool] | None,
) -> RoundCount:
    """Put what was sent into the receivers' hands and count it."""
    for source, output in outputs.items():
        for destination, message in output.sent.items():
            if lost is not None and lost(number, source, destination):
                continue
            incoming[destination][source] = message
    return RoundCount(
        number,
        sum(output.computed for output in outputs.values()),
        tuple((source, destination) for source, output in outputs.items() for destination in output.sent),
        max((output.largest_change for output in outputs.values()), default=0.0),
    )
