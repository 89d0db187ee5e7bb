"""The algorithm of the packet error runs: node 0 broadcasts, the others listen."""

from netsim.api import NodeHandle, Op
from netsim.parameters import NonNegativeInt, parameters


class Beacon:
    """Node 0 broadcasts one message after the other."""

    @parameters
    class Parameters:
        """Settings."""

        payload_byte: NonNegativeInt
        """Size of a message."""
        count: NonNegativeInt
        """How many."""

    def __init__(self, settings: Parameters) -> None:
        self._settings = settings

    def run(self, node: NodeHandle) -> Op[None]:
        """Broadcast, wait until it was sent, again."""
        for _ in range(self._settings.count if node.id == 0 else 0):
            yield from node.broadcast("beacon", bytes(self._settings.payload_byte)).wait()
