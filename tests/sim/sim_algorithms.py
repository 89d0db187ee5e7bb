"""Algorithms that scenarios of the tests name."""

from netsim.api import NodeHandle, Op
from netsim.trace.events import AlgorithmRecord

MS = 1_000_000


class Together:
    """Every node speaks at the same instants, so that back-offs, frames and turnarounds of many nodes coincide."""

    def run(self, node: NodeHandle) -> Op[None]:
        for turn in range(8):
            yield from node.pause_until(turn * 60 * MS)
            node.broadcast("all", bytes(10))
            for neighbour in node.neighbours[:2]:
                node.send(neighbour.id, "one", bytes(120))
            heard = []
            while (message := (yield from node.receive(timeout_ns=(turn + 1) * 60 * MS - node.now_ns))) is not None:
                heard.append([message.source, message.received_ns])
                yield from node.compute(1000 * len(heard))
            node.record(AlgorithmRecord(node.id, "heard", str(heard)))
            if turn == 5 and node.id % 2:
                node.radio_sleep()
            elif turn == 6:
                node.radio_wake()


class Across:
    """Every node sends 300 bytes to the node opposite, at a time of its own, and checks what it gets."""

    def run(self, node: NodeHandle) -> Op[None]:
        yield from node.pause(node.id * 200 * MS)
        if node.id != 4:
            node.send(8 - node.id, "across", bytes([node.id]) * 300)
        while (message := (yield from node.receive(timeout_ns=3000 * MS))) is not None:
            if message.payload != bytes([8 - node.id]) * 300:
                text = f"node {node.id} got what was not sent"
                raise ValueError(text)


class Watch:
    """Notes whom it knows, at the start and after five seconds; then tells them something."""

    def run(self, node: NodeHandle) -> Op[None]:
        for _ in range(2):
            known = [neighbour.id for neighbour in node.neighbours]
            node.record(AlgorithmRecord(node.id, "known", str(known)))
            yield from node.pause(5000 * MS)
        for neighbour in node.neighbours:
            delivery = yield from node.send(neighbour.id, "hello", b"").wait()
            if not delivery.acknowledged:
                node.log(f"{neighbour.id} does not answer")
