"""A message on its way out, fragment by fragment."""

from collections.abc import Callable, Sequence

from netsim.api import Delivery
from netsim.sim.net.packet import Packet


class Outgoing:
    """Sends a message's fragments one after the other and sums up what became of them.

    The next fragment enters the MAC's queue when the one before has left it: a long message does not fill the queue, and
    after a fragment is lost the rest is not sent, for without it the message cannot be whole.
    """

    def __init__(
        self,
        packets: Sequence[Packet],
        submit: Callable[[Packet, Callable[[Delivery], None]], None],
        done: Callable[[Delivery], None],
    ) -> None:
        self._packets = packets
        self._submit = submit
        self._done = done
        self._next = 0
        self._attempts = 0

    def proceed(self) -> None:
        """Send the next fragment."""
        packet = self._packets[self._next]
        self._next += 1
        self._submit(packet, self._fragment_done)

    def _fragment_done(self, delivery: Delivery) -> None:
        self._attempts += delivery.attempts
        if delivery.acknowledged and self._next < len(self._packets):
            self.proceed()
        else:
            self._done(Delivery(delivery.acknowledged, delivery.reason, self._attempts))
