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


def elect(node: NodeHandle, score: int, deadline_ns: int, hop_limit: int = 32) -> Op[int]:
    """The node of the highest score, of equals the one with the lowest id, as far as this node has heard.

    Every node that takes part calls this. Those that hear nothing of each other elect several.

    Args:
        node: The node.
        score: How well it suits, 0 to 65,535.
        deadline_ns: When the election is over, by the node's clock.
        hop_limit: How far a candidate is heard.

    Returns:
        The winner's id, at the deadline, perhaps this node's own.

    Raises:
        AlgorithmError: For a score out of range.
    """
    if not 0 <= score <= MOST_SCORE:
        text = f"a score of an election is from 0 to {MOST_SCORE}, got {score}"
        raise AlgorithmError(text)
    best = (score, -node.id)
    speak_ns = node.now_ns + _backoff_ns(node, score, deadline_ns - node.now_ns)
    while node.now_ns < deadline_ns:
        is_candidate = best == (score, -node.id) and node.now_ns < speak_ns
        until_ns = min(speak_ns, deadline_ns) if is_candidate else deadline_ns
        message = yield from node.receive(kinds={ELECTION}, timeout_ns=until_ns - node.now_ns)
        if message is not None:
            best = max(best, (int(_SCORE.unpack(message.payload, 0)[0]), -message.source))
        elif is_candidate and speak_ns < deadline_ns:
            yield from node.pause_until(speak_ns)
            node.flood(ELECTION, _SCORE.pack(score), hop_limit=hop_limit, causes=())
    return -best[1]


def _backoff_ns(node: NodeHandle, score: int, time_ns: int) -> int:
    """Half the time is for speaking, the better the sooner; the rest for the last flood to get through."""
    share = (1.0 + float(node.rng("election").random())) / (2.0 + score)
    return int(0.5 * max(time_ns, 0) * min(share, 1.0))
