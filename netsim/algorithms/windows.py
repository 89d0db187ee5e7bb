"""Radios that sleep between rounds, and quiet nodes that sleep longer.

All listen in a window at the start of every round; `scheduled` is no more than that. With `when_quiet` a node leaves out
windows once no message has come to it or gone from it for some rounds. That two nodes have had nothing to say to each
other is known to both, and a node is quiet only if it is so with all its partners: so who has exchanged a message with a
node in the last `quiet_rounds` rounds knows that it listens. Who has not keeps its message for the next common round, in
which all listen. On links without acknowledgements a lost message makes its sender take a sleeper for awake, and what it
then sends is lost as well: the next common round mends that only if something is sent in it.
"""

from collections.abc import Mapping

from netsim.algorithms.entries import EdgeMessage
from netsim.algorithms.message_passing_parameters import MessagePassingParameters
from netsim.kernels.semiring import FloatArray

Entries = Mapping[int, list[EdgeMessage]]
"""Messages by the node they are for."""


class Quietness:
    """What a node knows of its own and its partners' silence.

    Args:
        parameters: Of the algorithm.
        begun: Round in which the node begins: as if all had spoken then.
    """

    def __init__(self, parameters: MessagePassingParameters, begun: int = 0) -> None:
        self._every = parameters.common_every
        self._after = parameters.quiet_rounds
        self._begun = self._active = begun
        self._spoken: dict[int, int] = {}
        self._kept: dict[int, dict[tuple[int, int], FloatArray]] = {}

    def exchanged(self, partner: int, number: int) -> None:
        """A message of this round certainly went between here and there: it came, or was acknowledged."""
        self._active = max(number, self._active)
        self._spoken[partner] = max(number, self._spoken.get(partner, self._begun))

    def _is_common(self, number: int) -> bool:
        return number % self._every == 0

    def listens(self, number: int) -> bool:
        """Whether this node listens in a round."""
        return self._is_common(number) or number - self._active <= self._after

    def is_reached(self, partner: int, number: int) -> bool:
        """Whether a partner is known to listen in a round."""
        return self._is_common(number) or number - self._spoken.get(partner, self._begun) <= self._after

    def passed(self, number: int, entries: Entries) -> dict[int, list[EdgeMessage]]:
        """What goes out in a round: new messages and those kept for its receivers, the newest of each edge."""
        for partner, messages in entries.items():
            kept = self._kept.setdefault(partner, {})
            kept.update({(source, destination): message for source, destination, message in messages})
        ready = [partner for partner in sorted(self._kept) if self.is_reached(partner, number)]
        if ready:
            self._active = number  # a receiver may answer, even if nothing tells that it received
        return {
            partner: [(*edge, message) for edge, message in sorted(self._kept.pop(partner).items())]
            for partner in ready
        }
