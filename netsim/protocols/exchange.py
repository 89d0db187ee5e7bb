"""Everyone tells its partners one thing, and tries again where no acknowledgement came."""

from collections.abc import Collection, Mapping

from netsim.api import NodeHandle, Op


def exchange(
    node: NodeHandle,
    kind: str,
    payload: bytes,
    partners: Collection[int],
    deadline_ns: int,
    attempts: int = 3,
) -> Op[Mapping[int, bytes]]:
    """Send the same payload to every partner and collect theirs, until the deadline.

    Each attempt falls at a random moment of its share of the time, so that the nodes do not all speak at once. A partner
    whose link layer acknowledged is not told again. The call returns at the deadline, never earlier: so all nodes leave
    it together.

    Args:
        node: The node.
        kind: Message kind.
        payload: What to tell.
        partners: Whom to tell, and whom to hear.
        deadline_ns: When to return, by the node's clock.
        attempts: How often to try.

    Returns:
        What each partner said; those that were not heard are missing.
    """
    task = node.spawn(_tell(node, kind, payload, sorted(partners), deadline_ns, attempts))
    heard: dict[int, bytes] = {}
    while node.now_ns < deadline_ns:
        message = yield from node.receive(kinds={kind}, timeout_ns=deadline_ns - node.now_ns)
        if message is not None:
            heard[message.source] = message.payload
    task.cancel()
    return {partner: heard[partner] for partner in sorted(partners) if partner in heard}


def _tell(
    node: NodeHandle, kind: str, payload: bytes, partners: Collection[int], deadline_ns: int, attempts: int
) -> Op[None]:
    """Tell each partner in turn; go round again for those that did not acknowledge."""
    share_ns = (deadline_ns - node.now_ns) // (attempts + 1)
    begin_ns = node.now_ns
    waiting = list(partners)
    for attempt in range(attempts):
        offset_ns = int(node.rng("exchange").random() * share_ns)
        yield from node.pause_until(begin_ns + attempt * share_ns + offset_ns)
        missed = []
        for partner in waiting:
            delivery = yield from node.send(partner, kind, payload, causes=()).wait()
            if not delivery.acknowledged:
                missed.append(partner)
        waiting = missed
