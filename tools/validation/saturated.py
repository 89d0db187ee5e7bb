"""The algorithm of the saturation runs: hand over the next message as soon as the link layer is done with the last."""

from netsim.api import NodeHandle, Op
from netsim.parameters import NonNegativeInt, parameters
from netsim.trace.events import AlgorithmRecord


class Saturated:
    """Node 0 receives; the others always have something to send to it."""

    @parameters
    class Parameters:
        """Settings."""

        payload_byte: NonNegativeInt
        """Size of a message."""

    def __init__(self, settings: Parameters) -> None:
        self._payload = bytes(settings.payload_byte)

    def run(self, node: NodeHandle) -> Op[None]:
        """Send, wait for the outcome, record it, again."""
        if node.id == 0:
            while True:
                yield from node.receive()
        yield from node.pause(1_000_000 + 37_000 * node.id)
        while True:
            delivery = yield from node.send(0, "load", self._payload).wait()
            node.record(AlgorithmRecord(node.id, "sent", delivery.reason or "acknowledged"))
