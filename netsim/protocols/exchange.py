"""Everyone tells its partners one thing, and sees to it that nobody misses it."""

from collections.abc import Collection, Mapping
from typing import Literal

from netsim.api import NodeHandle, Op

Manner = Literal["unicast", "broadcast"]
REQUEST = "-request"
"""What the kind of a request adds to the kind of what is asked for."""


def exchange(
    node: NodeHandle,
    kind: str,
    payload: bytes | None,
    partners: Collection[int],
    deadline_ns: int,
    attempts: int = 3,
    manner: Manner = "unicast",
) -> Op[Mapping[int, bytes]]:
    """Send the same payload to every partner and collect theirs, until the deadline.

    Each attempt falls at a random moment of its share of the time, so that the nodes do not all speak at once. The call
    returns at the deadline, never earlier: so all nodes leave it together.

    With `unicast` each partner is told alone, and told again where its link layer did not acknowledge. With `broadcast`
    the first attempt is one transmission for all partners in direct reach (`NodeHandle.multicast`), which nobody
    acknowledges; in the later ones a node asks those it has not heard, again with one transmission, and they answer it
    alone.

    Args:
        node: The node.
        kind: Message kind; requests are of the kind with `-request` added.
        payload: What to tell; None to listen only.
        partners: Whom to tell, and whom to hear.
        deadline_ns: When to return, by the node's clock.
        attempts: How often to try.
        manner: How to tell.

    Returns:
        What each partner said; those that were not heard are missing.
    """
    heard: dict[int, bytes] = {}
    telling = []
    if payload is not None and manner == "unicast":
        telling.append(node.spawn(_tell(node, kind, payload, sorted(partners), deadline_ns, attempts)))
    elif payload is not None:
        telling.append(node.spawn(_tell_all(node, kind, payload, sorted(partners), heard, deadline_ns, attempts)))
    while node.now_ns < deadline_ns:
        message = yield from node.receive(kinds={kind, kind + REQUEST}, timeout_ns=deadline_ns - node.now_ns)
        if message is None:
            continue
        if message.kind == kind:
            heard[message.source] = message.payload
        elif payload is not None:
            node.send(message.source, kind, payload, causes=[message])
    for task in telling:
        task.cancel()
    return {partner: heard[partner] for partner in sorted(partners) if partner in heard}


def ask_again(
    node: NodeHandle, kind: str, partners: Collection[int], until_ns: int, attempts: int = 3
) -> Op[Mapping[int, bytes]]:
    """Ask partners for what they told at the start, as a node does that was down and comes back.

    Who serves such requests answers them alone: `kind + REQUEST` with a message of the kind.

    Args:
        node: The node.
        kind: Kind of what is asked for.
        partners: Whom to ask.
        until_ns: When to give up, by the node's clock.
        attempts: How often to ask those that have not answered.

    Returns:
        What each partner said, as soon as all have answered; at `until_ns` those that have not are missing.
    """
    heard: dict[int, bytes] = {}
    begin_ns = node.now_ns
    for attempt in range(attempts):
        end_ns = begin_ns + (attempt + 1) * (until_ns - begin_ns) // attempts
        for partner in sorted(set(partners) - heard.keys()):
            node.send(partner, kind + REQUEST, b"", causes=())
        while len(heard) < len(partners) and node.now_ns < end_ns:
            message = yield from node.receive(kinds={kind}, timeout_ns=end_ns - node.now_ns)
            if message is not None and message.source in partners:
                heard[message.source] = message.payload
    return heard


def _moment(node: NodeHandle, begin_ns: int, share_ns: int, attempt: int) -> Op[None]:
    """Wait for a random moment of an attempt's share of the time."""
    offset_ns = int(node.rng("exchange").random() * share_ns)
    yield from node.pause_until(begin_ns + attempt * share_ns + offset_ns)


def _tell(
    node: NodeHandle, kind: str, payload: bytes, partners: Collection[int], deadline_ns: int, attempts: int
) -> Op[None]:
    """Tell each partner in turn; go round again for those that did not acknowledge."""
    begin_ns = node.now_ns
    share_ns = (deadline_ns - begin_ns) // (attempts + 1)
    waiting = list(partners)
    for attempt in range(attempts):
        yield from _moment(node, begin_ns, share_ns, attempt)
        missed = []
        for partner in waiting:
            delivery = yield from node.send(partner, kind, payload, causes=()).wait()
            if not delivery.acknowledged:
                missed.append(partner)
        waiting = missed


def _tell_all(
    node: NodeHandle,
    kind: str,
    payload: bytes,
    partners: Collection[int],
    heard: Mapping[int, bytes],
    deadline_ns: int,
    attempts: int,
) -> Op[None]:
    """Tell all partners at once; later ask those that were not heard."""
    begin_ns = node.now_ns
    share_ns = (deadline_ns - begin_ns) // (attempts + 1)
    for attempt in range(attempts):
        yield from _moment(node, begin_ns, share_ns, attempt)
        if attempt == 0:
            node.multicast(partners, kind, payload, causes=())
        else:
            missing = [partner for partner in partners if partner not in heard]
            node.multicast(missing, kind + REQUEST, b"", causes=())
