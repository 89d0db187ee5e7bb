"""What a node needs of the layers below its algorithm, so that test doubles can stand in for them."""

from collections.abc import Callable, Sequence
from typing import Protocol

from netsim.api import Delivery, Neighbour, Region


class Transceiver(Protocol):
    """The radio, as its node sees it."""

    @property
    def state(self) -> str:
        """One of `netsim.trace.events.RADIO_STATES`."""
        ...

    @property
    def is_sending(self) -> bool:
        """Whether a frame is going out, or is about to."""
        ...

    def start(self) -> None:
        """Power up, at the start of the run or after a crash."""
        ...

    def settle(self) -> None:
        """Book what was drawn until now."""
        ...

    def die(self) -> None:
        """The battery is empty."""
        ...

    def power_off(self) -> None:
        """The node crashed: off until `start`."""
        ...


class LinkLayer(Protocol):
    """Medium access, as its node sees it (see `netsim.sim.mac.link.Mac`)."""

    @property
    def pending(self) -> int:
        """Jobs accepted and not yet done."""
        ...

    def sleep(self) -> None:
        """Let the radio sleep whenever nothing is to be sent."""
        ...

    def wake(self) -> None:
        """Keep the radio awake."""
        ...

    def give_up(self, reason: str) -> None:
        """The node is about to stop: end every job, also the one under way, with this reason."""
        ...

    def stop(self) -> None:
        """The node died or crashed: forget everything. When its radio is powered up again it begins anew."""
        ...


class NetworkLayer(Protocol):
    """What takes messages from the node's algorithm (see `netsim.sim.net.network.Network`)."""

    @property
    def discovered(self) -> Sequence[Neighbour] | None:
        """Neighbours found so far; None where they were given."""
        ...

    @property
    def pending(self) -> int:
        """Packets of messages that wait in this layer, beacons and the like not counted."""
        ...

    def start(self) -> None:
        """The node begins to live, or lives again after `stop`."""
        ...

    def stop(self) -> None:
        """The node died or lost its memory: drop and forget everything."""
        ...

    def is_direct(self, destination: int) -> bool:
        """Whether a message to this node would go straight to it."""
        ...

    def multicast(
        self,
        destinations: Sequence[int],
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Callable[[Delivery], None],
    ) -> int:
        """Send once to several direct neighbours."""
        ...

    def flood(
        self, hop_limit: int, kind: str, payload: bytes, causes: Sequence[int], done: Callable[[Delivery], None]
    ) -> int:
        """Send to every node within so many hops."""
        ...

    def geocast(
        self, region: Region, kind: str, payload: bytes, causes: Sequence[int], done: Callable[[Delivery], None]
    ) -> int:
        """Send to every node in a region."""
        ...

    def send_to_sink(self, kind: str, payload: bytes, causes: Sequence[int], done: Callable[[Delivery], None]) -> int:
        """Send to a sink."""
        ...

    def send(
        self,
        destination: int,
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Callable[[Delivery], None],
    ) -> int:
        """Take a message, call `done` once with what became of it at this node, return its number in the trace."""
        ...

    def give_up(self, reason: str) -> None:
        """The node is about to stop: say what is lost with it, for this reason, and try nothing again."""
        ...
