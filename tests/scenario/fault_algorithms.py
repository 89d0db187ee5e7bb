"""Algorithms that the tests of fault rules name."""

from netsim.api import NodeHandle, Op
from netsim.trace.events import Role

S = 1_000_000_000


class Leader:
    """Tells everybody the highest number heard of, again and again, and after five seconds says which it is."""

    def run(self, node: NodeHandle) -> Op[None]:
        highest = node.id
        for turn in range(5):
            yield from node.pause(int(node.rng("turn").random() * S / 2))
            node.broadcast("highest", bytes([highest]))
            while True:
                message = yield from node.receive(timeout_ns=max(0, (turn + 1) * S - node.now_ns))
                if message is None:
                    break
                highest = max(highest, message.payload[0])
        node.log(f"leader {highest}")


class Turns:
    """The nodes lead in turn, a second each, with half a second in which nobody does."""

    def run(self, node: NodeHandle) -> Op[None]:
        for turn in range(2):
            yield from node.pause_until((6 * turn + node.id) * 3 * S // 2)
            node.record(Role(node.id, "leader", 1))
            yield from node.pause(S)
            node.record(Role(node.id, "leader", 0))
