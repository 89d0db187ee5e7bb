"""What the nodes of the validation runs do."""

from netsim.api import NodeHandle, Op
from netsim.parameters import NonNegative, NonNegativeInt, parameters
from netsim.trace.events import AlgorithmRecord

TRIAL_NS = 100_000_000


@parameters
class Payload:
    """Settings of those that send."""

    payload_byte: NonNegativeInt
    """Size of a message."""
    count: NonNegativeInt = 0
    """How many, where it matters."""


class Saturated:
    """Node 0 receives; the others always have something to send to it."""

    Parameters = Payload

    def __init__(self, settings: Payload) -> None:
        self._payload = bytes(settings.payload_byte)

    def run(self, node: NodeHandle) -> Op[None]:
        """Hand over the next message as soon as the link layer is done with the last, and record what became of it."""
        if node.id == 0:
            while True:
                yield from node.receive()
        yield from node.pause(1_000_000 + 37_000 * node.id)
        while True:
            delivery = yield from node.send(0, "load", self._payload).wait()
            node.record(AlgorithmRecord(node.id, "sent", delivery.reason or "acknowledged"))


class Beacon:
    """Node 0 broadcasts one message after the other, the others listen."""

    Parameters = Payload

    def __init__(self, settings: Payload) -> None:
        self._settings = settings

    def run(self, node: NodeHandle) -> Op[None]:
        """Broadcast, wait until it was sent, again."""
        for _ in range(self._settings.count if node.id == 0 else 0):
            yield from node.broadcast("beacon", bytes(self._settings.payload_byte)).wait()


class Pairs:
    """In trial k, at (k + 1) x 100 ms, node 1 sends to node 0; node 2, if there is one, a gap later."""

    @parameters
    class Parameters:
        """Settings."""

        gaps_us: tuple[NonNegative, ...]
        """A gap for each trial."""
        payload_byte: NonNegativeInt = 50
        """Size of a message."""

    def __init__(self, settings: Parameters) -> None:
        self._settings = settings

    def run(self, node: NodeHandle) -> Op[None]:
        """Send in every trial."""
        for trial, gap_us in enumerate(self._settings.gaps_us, start=1):
            if node.id != 0:
                yield from node.pause_until(trial * TRIAL_NS + (round(gap_us * 1000) if node.id == 2 else 0))
                node.send(0, "pair", bytes(self._settings.payload_byte))


class Listener:
    """It listens for a day."""

    def run(self, node: NodeHandle) -> Op[None]:
        """Wait for a message that does not come."""
        yield from node.receive(timeout_ns=86_400 * 1_000_000_000)
