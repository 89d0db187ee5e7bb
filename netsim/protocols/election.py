"""Nodes agree on one of them by flooding: extrema finding, in which those that have heard a better one keep silent.

Chang and Roberts 1979 find the extreme of unlike ids on a ring by passing on none but better ones; here the network's flood
takes the ring's place, and a random pause before speaking, shorter for better scores, keeps most nodes from speaking at all.
"""

from netsim.api import NodeHandle, Op
from netsim.codec import Record
from netsim.errors import AlgorithmError

ELECTION = "election"
MOST_SCORE = 0xFFFF
_SCORE = Record("H")


def elect(node: NodeHandle, score: int, deadline_ns: int, hop_limit: int = 32) -> Op[int | None]:
    """The node of the highest score, of equals the one with the lowest id, as far as this node has heard.

    Every node that takes part calls this. Those that hear nothing of each other elect several.

    Args:
        node: The node.
        score: How well it suits, 0 to 65,535.
        deadline_ns: When the election is over, by the node's clock.
        hop_limit: How far a candidate is heard.

    Returns:
        The winner's id, at the deadline, perhaps this node's own; None at once where the deadline is over, as for a node
        that was down: it can only wait for the winner's word.

    Raises:
        AlgorithmError: For a score out of range.
    """
    if not 0 <= score <= MOST_SCORE:
        text = f"a score of an election is from 0 to {MOST_SCORE}, got {score}"
        raise AlgorithmError(text)
    if node.now_ns >= deadline_ns:
        return None
    own = best = (score, -node.id)
    for speak_ns in [*_moments_ns(node, score, deadline_ns), deadline_ns]:
        best = yield from _heard(node, best, speak_ns)
        if best == own and speak_ns < deadline_ns:
            node.flood(ELECTION, _SCORE.pack(score), hop_limit=hop_limit, causes=())
    return -best[1]


def _heard(node: NodeHandle, best: tuple[int, int], until_ns: int) -> Op[tuple[int, int]]:
    """The best candidate known at a moment."""
    while node.now_ns < until_ns:
        message = yield from node.receive(kinds={ELECTION}, timeout_ns=until_ns - node.now_ns)
        if message is not None:
            best = max(best, (int(_SCORE.unpack(message.payload, 0)[0]), -message.source))
    return best


def _moments_ns(node: NodeHandle, score: int, deadline_ns: int) -> tuple[int, int]:
    """When to speak: once in the first half of the time, the better the sooner, and once in the third quarter.

    By the second time only those speak that are still the best they know of: it tells whom the first flood missed.
    """
    now_ns = node.now_ns
    time_ns = max(deadline_ns - now_ns, 0)
    first, second = node.rng("election").random(2).tolist()
    share = min((1.0 + first) / (2.0 + score), 1.0)
    return now_ns + int(0.5 * share * time_ns), now_ns + int((0.5 + 0.25 * second) * time_ns)
