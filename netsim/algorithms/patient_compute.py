"""Computing that cannot be left out: it waits for the node's energy allowance instead."""

from netsim.api import NodeHandle, NoEnergyError, Op


def compute_when_allowed(node: NodeHandle, operations: int, until_ns: int) -> Op[bool]:
    """Occupy the CPU, as soon as the node's energy allowance admits it (see `netsim.api.NodeHandle.budget`).

    Args:
        node: The node.
        operations: How many elementary operations; none need no energy.
        until_ns: Until when an allowance that is replenished is worth waiting for, by the node's clock.

    Returns:
        Whether they were computed: False where the allowance is used up and not replenished in time.
    """
    while True:
        try:
            yield from node.compute(operations)
        except NoEnergyError:
            if operations == 0:
                return True
            again_ns = node.budget.replenishes_ns
            if again_ns is None or again_ns >= until_ns:
                return False
            # A clock that runs slow shows the instant of replenishment a little before it.
            yield from node.pause_until(max(again_ns, node.now_ns + 1))
        else:
            return True
