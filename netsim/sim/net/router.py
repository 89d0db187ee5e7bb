"""What decides over next hops, whatever it decides by."""

from typing import NamedTuple, Protocol

from netsim.sim.net.packet import Packet
from netsim.sim.net.routes import Routes


class Way(NamedTuple):
    """A packet as it is to be sent on, and to whom; `hop` is None where there is no way."""

    hop: int | None
    packet: Packet


class Router(Protocol):
    """Next hops of one node.

    Attributes:
        fields_byte: Most bytes that it adds to a packet.
    """

    fields_byte: int

    def route(self, packet: Packet, previous: int | None) -> Way:
        """The next hop of a packet that came from a neighbour, or begins here (None). It never raises."""
        ...

    def is_direct(self, destination: int) -> bool:
        """Whether a packet for this node would go straight to it."""
        ...


class TableRouter:
    """Next hops from a table that depends on the destination alone.

    Args:
        node: This node's id.
        routes: The table.
    """

    fields_byte = 0

    def __init__(self, node: int, routes: Routes) -> None:
        self._node = node
        self._routes = routes

    def route(self, packet: Packet, previous: int | None) -> Way:
        """See `Router.route`."""
        return Way(self._routes.next_hop(self._node, packet.destination), packet)

    def is_direct(self, destination: int) -> bool:
        """See `Router.is_direct`."""
        return self._routes.next_hop(self._node, destination) == destination
