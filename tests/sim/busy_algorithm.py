"""An algorithm that keeps every part of its node busy, and that notices when its former life interferes."""

from collections import Counter
from collections.abc import Callable

from netsim.api import NodeHandle, Op
from netsim.trace.events import AlgorithmRecord

MS = 1_000_000


class Busy:
    """Sends, broadcasts, computes, senses and waits in several tasks at once, for twenty turns from its start.

    Every step says which life of the node it belongs to; a step of a life that is over raises.
    """

    def __init__(self) -> None:
        self.lives: Counter[int] = Counter()

    def run(self, node: NodeHandle) -> Op[None]:
        self.lives[node.id] += 1
        mine = self.lives[node.id]

        def say(what: str) -> None:
            if self.lives[node.id] != mine:
                text = f"life {mine} of node {node.id} acts in life {self.lives[node.id]}"
                raise ValueError(text)
            node.record(AlgorithmRecord(node.id, what, str(mine)))

        try:
            node.spawn(hear(node, say))
            node.spawn(measure(node, say))
            yield from speak(node, say)
        finally:
            node.log(f"end of life {mine}")
            node.broadcast("all", b"last word")


def hear(node: NodeHandle, say: Callable[[str], None]) -> Op[None]:
    """Receive with a time-out and compute, for ever; nothing may come that was received in a former life."""
    born_ns = node.now_ns
    while True:
        message = yield from node.receive(kinds={"all", "one"}, timeout_ns=7 * MS)
        if message is not None and message.received_ns < born_ns:
            text = f"node {node.id} was given a message of its former life"
            raise ValueError(text)
        say("timeout" if message is None else "heard")
        if message is not None:
            begun_ns = node.now_ns
            yield from node.compute(20_000)
            say(f"computed for {node.now_ns - begun_ns}")


def measure(node: NodeHandle, say: Callable[[str], None]) -> Op[None]:
    """Read the sensor, for ever."""
    while True:
        yield from node.sense()
        say("sensed")
        yield from node.pause(3 * MS)


def speak(node: NodeHandle, say: Callable[[str], None]) -> Op[None]:
    """Twenty turns of broadcast, unicast, radio asleep and awake."""
    for turn in range(20):
        node.broadcast("all", bytes(10))
        ticket = node.send((node.id + 1) % 4, "one", bytes(200))
        if turn % 7 == 3:
            node.radio_sleep()
        yield from node.pause(int(node.rng("wait").random() * 30 * MS))
        node.radio_wake()
        delivery = yield from ticket.wait()
        say(f"sent {delivery.reason}")
