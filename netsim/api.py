"""What an algorithm imports: everything a node may do, and nothing else.

An algorithm is a class with one generator method, `run(node)`. It keeps its state in local variables and waits with
`yield from`. It learns about the world only through its `NodeHandle`: its knowledge, its own sensor, the messages it
receives. Payloads are bytes (see `netsim.codec`); nothing is passed between nodes by reference.
"""

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

from netsim.trace.events import BROADCAST, Event

__all__ = [
    "BROADCAST",
    "Algorithm",
    "Circle",
    "Delivery",
    "Message",
    "Neighbour",
    "NodeHandle",
    "Observation",
    "Op",
    "Polygon",
    "Rectangle",
    "Region",
    "Task",
    "Ticket",
]

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
Op = Generator[Any, Any, T]
"""An operation that takes simulated time: use it with `yield from`."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message as its receiver sees it.

    Attributes:
        id: Number of the message in the trace, for `causes`. It is not in the packet: decide nothing by it.
        source: Node whose algorithm sent it, perhaps several hops away.
        destination: This node, or `BROADCAST`.
        kind: What it is, a short name such as `belief`.
        payload: The bytes that came over the air.
        received_ns: When it was complete, by this node's clock.
        hops: How many transmissions it took.
    """

    id: int
    source: int
    destination: int
    kind: str
    payload: bytes
    received_ns: int
    hops: int


@dataclass(frozen=True, slots=True)
class Delivery:
    """What the sender learned of a message it sent.

    Attributes:
        acknowledged: Every frame was acknowledged by the next hop. Where the MAC asks for no acknowledgement (broadcasts,
            the ideal MAC) it is true once the message was sent, whatever became of it.
        reason: Why it was given up (`no_ack`, `channel_busy`, ...), empty when acknowledged.
        attempts: Transmissions it took at this node, retries included.
    """

    acknowledged: bool
    reason: str
    attempts: int


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A node within direct radio reach.

    Attributes:
        id: Its node id.
        distance_m: How far away it is; infinite where a discovered neighbour did not tell its position.
        prr: Packet reception ratio from here to there: of a full-size frame without interference where neighbours are
            given, of beacons as the neighbour reports it where they are discovered.
    """

    id: int
    distance_m: float
    prr: float


@dataclass(frozen=True, slots=True)
class Circle:
    """A disk, for `NodeHandle.geocast`.

    Attributes:
        centre_m: Its centre.
        radius_m: Its radius.
    """

    centre_m: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle along the axes, for `NodeHandle.geocast`.

    Attributes:
        low_m: Lower left corner.
        high_m: Upper right corner.
    """

    low_m: tuple[float, float]
    high_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Polygon:
    """A simple polygon of three to eight vertices, for `NodeHandle.geocast`.

    Messages head for the mean of its vertices, so that had better lie inside.

    Attributes:
        vertices_m: Its corners in order, not repeated at the end.
    """

    vertices_m: tuple[tuple[float, float], ...]


Region = Circle | Rectangle | Polygon


@dataclass(frozen=True, slots=True)
class Observation:
    """One reading of a node's own sensor.

    Attributes:
        time_ns: When it was taken, by the node's clock.
        values: What was measured, shape and meaning given by the problem (association: positions in metres, shape
            (measurements, 2)).
    """

    time_ns: int
    values: np.ndarray[Any, np.dtype[np.float64]]


class Ticket(Protocol):
    """A receipt for a message that was handed over; it is on its way whether or not one waits."""

    message_id: int

    def wait(self) -> Op[Delivery]:
        """Wait until this node's link layer has finished with the message."""
        ...


class Task(Protocol[T_co]):
    """An operation running beside the caller on the same node."""

    def join(self) -> Op[T_co]:
        """Wait for the end and return the result."""
        ...

    def cancel(self) -> None:
        """End it where it waits."""
        ...


class NodeHandle(Protocol):
    """All that an algorithm may do on its node."""

    @property
    def id(self) -> int:
        """This node's number."""
        ...

    @property
    def now_ns(self) -> int:
        """This node's clock."""
        ...

    @property
    def knowledge(self) -> Any:
        """What the node legitimately knows at the start: a frozen record given by the problem, or None."""
        ...

    @property
    def position_m(self) -> tuple[float, float]:
        """Where this node believes it is."""
        ...

    @property
    def role(self) -> str:
        """`sensor` or `sink`."""
        ...

    @property
    def neighbours(self) -> Sequence[Neighbour]:
        """Nodes within direct radio reach, by id: given, or those discovered so far (see the scenario's network)."""
        ...

    @property
    def energy_left_j(self) -> float:
        """Energy left in the battery; infinity on mains power."""
        ...

    def send(self, destination: int, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> Ticket:
        """Send to one node, over as many hops as routing gives. Acts at once; wait on the ticket only if one cares.

        Args:
            destination: Node id; sending to oneself is an error (co-hosted variables need no air).
            kind: Short name of the message's meaning; it names the message in trace, ledger and replay.
            payload: The bytes to carry.
            causes: Messages that led to this one, for the causal chain; by default those received since the sends before,
                so that several messages sent in a row share theirs.

        Raises:
            AlgorithmError: For an unknown destination, a destination that is this node, or a payload that is not bytes.
        """
        ...

    def broadcast(self, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> Ticket:
        """Send once to every node in direct reach; not acknowledged."""
        ...

    def multicast(
        self, destinations: Collection[int], kind: str, payload: bytes, *, causes: Sequence[Message] | None = None
    ) -> Mapping[int, Ticket]:
        """Send the same bytes to several nodes, with one transmission for those that are direct neighbours.

        Where two destinations or more are one hop away, one frame for all carries their ids (2 bytes each) and is not
        acknowledged; the others are sent to one by one.

        Args:
            destinations: Node ids.
            kind: As for `send`.
            payload: As for `send`.
            causes: As for `send`.

        Returns:
            The ticket of each destination; those served by one transmission share theirs.

        Raises:
            AlgorithmError: As for `send`.
        """
        ...

    def flood(
        self, kind: str, payload: bytes, *, hop_limit: int = 16, causes: Sequence[Message] | None = None
    ) -> Ticket:
        """Send to every node within `hop_limit` hops (1 to 255): each passes it on once; not acknowledged."""
        ...

    def geocast(self, region: Region, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> Ticket:
        """Send to every node in a region: by position until one of its nodes is reached, then flooded inside.

        Nodes in a part of the region that cannot be reached through the region itself are missed. The ticket tells of
        the first hop only.
        """
        ...

    def send_to_sink(self, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> Ticket:
        """Send to a sink: the one the collection tree leads to, under other networks the nearest.

        Raises:
            AlgorithmError: If there is no sink, or this node is one.
        """
        ...

    def receive(
        self,
        *,
        kinds: Collection[str] | None = None,
        match: Callable[[Message], bool] | None = None,
        timeout_ns: int | None = None,
    ) -> Op[Message | None]:
        """Wait for the next message that fits; None after `timeout_ns`. Messages that do not fit stay for others."""
        ...

    def pause(self, duration_ns: int) -> Op[None]:
        """Do nothing for a while; the radio keeps listening unless put to sleep."""
        ...

    def pause_until(self, time_ns: int) -> Op[None]:
        """Do nothing until the node's clock shows `time_ns`; returns at once if that has passed."""
        ...

    def radio_sleep(self) -> None:
        """Turn the radio off as soon as its queue is empty; nothing is received while it sleeps."""
        ...

    def radio_wake(self) -> None:
        """Turn the radio on again; it can receive after its start-up time."""
        ...

    def sense(self) -> Op[Observation]:
        """Read the node's sensor: takes its time and energy."""
        ...

    def compute(self, operations: int) -> Op[None]:
        """Occupy the CPU for a number of elementary operations: takes its time and energy."""
        ...

    def spawn(self, op: Op[T]) -> Task[T]:
        """Run an operation beside this one; it dies with the node."""
        ...

    def rng(self, purpose: str) -> np.random.Generator:
        """This node's random stream for a purpose; the same object each time."""
        ...

    def log(self, text: str) -> None:
        """Write a line for people into the trace."""
        ...

    def record(self, event: Event) -> None:
        """Put an event of this node into the trace. It costs the node nothing and reaches no other node.

        Raises:
            AlgorithmError: For an event of another node, or one that is not an algorithm's to record: those are
                Association, Marginals, Estimate, GraphMessages, Role and AlgorithmRecord.
        """
        ...


class Algorithm(Protocol):
    """What a node runs. State belongs into the locals of `run`: after a reboot it starts anew."""

    def run(self, node: NodeHandle) -> Op[None]:
        """The algorithm's life on one node, as a SimPy process."""
        ...
