"""What a node remembers of the vertices it hosts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from netsim.algorithms.entries import EdgeMessage
from netsim.algorithms.hosting import Hosting
from netsim.algorithms.message_passing_parameters import LAST_ROUND
from netsim.api import Message
from netsim.kernels.communication import CommunicationRule, VertexSender
from netsim.kernels.semiring import FloatArray


@dataclass(slots=True)
class Hosted:
    """What a node keeps of the vertices it hosts: the vertices, their memory, the last messages received.

    `fresh` are the messages taken since the last send: what is sent next answers them, and so does what of it is sent again.
    `taken` counts all messages taken; `sent` is the last message on each edge to another node, with its round.
    `resting` vertices compute nothing in this round.
    """

    hosting: Hosting
    senders: dict[int, VertexSender]
    incoming: dict[int, dict[int, FloatArray]]
    newest: dict[tuple[int, int], int]
    fresh: list[Message]
    taken: int = 0
    sent: dict[tuple[int, int], tuple[int, FloatArray]] = field(default_factory=dict)
    resting: set[int] = field(default_factory=set)

    @classmethod
    def of(cls, hosting: Hosting, rule: CommunicationRule) -> "Hosted":
        """At the start nothing has been received."""
        senders = {vertex.id: VertexSender(vertex, rule) for vertex in hosting.vertices}
        return cls(hosting, senders, {vertex: {} for vertex in senders}, {}, [])

    def accept(self, entry: tuple[int, int, int, FloatArray]) -> bool:
        """Take a received message, unless a newer one came first; False for one that does not fit.

        It does not fit where its sender lacked our measurements.
        """
        number, source, destination, message = entry
        sender = self.senders.get(destination)
        if sender is None or source not in sender.vertex.neighbours:
            return False
        if len(message) != sender.vertex.incoming_size(source):
            return False
        last = self.newest.get((source, destination))
        if last is None or (number - last) & LAST_ROUND <= LAST_ROUND // 2:
            self.newest[source, destination] = number
            self.incoming[destination][source] = message
        return True

    def causes_again(self, answered: Sequence[Message] | None) -> Sequence[Message] | None:
        """What a message names as its causes when it is sent again: those of the first time, not what came meanwhile.

        Args:
            answered: The messages taken before it was sent; None for a start message, which answers the measurements. The
                node knows these itself until something else is taken; then such a message names none.
        """
        return () if answered is None and self.taken else answered

    @property
    def operations(self) -> int:
        """Cost of one round of computing."""
        return sum(sender.vertex.operations() for sender in self.senders.values())

    @property
    def partners(self) -> list[int]:
        """The nodes that host neighbours of what is hosted here, ascending."""
        hosts = self.hosting.hosts
        here = self.senders.keys()
        others = {other for sender in self.senders.values() for other in sender.vertex.neighbours}
        return sorted({hosts[other] for other in others - here})

    def edges_to(self, host: int) -> list[tuple[int, int]]:
        """(Source, destination) of every edge from a vertex hosted here to one on another node, ascending."""
        hosts = self.hosting.hosts
        return [
            (vertex, other)
            for vertex, sender in sorted(self.senders.items())
            for other in sender.vertex.neighbours
            if other not in self.senders and hosts[other] == host
        ]

    def gain(self, sender: VertexSender, here: int) -> None:
        """Host one vertex more, from the next round on; `here` is this node."""
        vertex = sender.vertex.id
        self.senders[vertex], self.incoming[vertex] = sender, {}
        self.hosting.hosts[vertex] = here
        self.resting.add(vertex)

    def lose(self, vertex: int) -> None:
        """Host a vertex no more."""
        del self.senders[vertex], self.incoming[vertex]
        self.resting.discard(vertex)

    def remember(self, number: int, entries: Iterable[EdgeMessage]) -> None:
        """These messages were handed over for other nodes in a round."""
        for source, destination, message in entries:
            self.sent[source, destination] = number, message

    def take_back(self, number: int, entries: Iterable[EdgeMessage]) -> None:
        """These messages of a round did not arrive: unless a newer one went out, the rule forgets them.

        Start messages are left alone: who has not received one goes on as if it had.
        """
        for source, destination, _ in entries:
            if number > 0 and self.sent[source, destination][0] == number:
                self.senders[source].take_back(destination)
