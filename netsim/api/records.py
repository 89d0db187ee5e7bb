"""What passes between an algorithm and its node: messages, observations, neighbours, regions."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from netsim.errors import NetsimError

SERVICE_PREFIX = "service/"
"""Messages of a kind that begins so are received only by who names their kind: by services that run beside an algorithm."""

T = TypeVar("T")
Op = Generator[Any, Any, T]
"""An operation that takes simulated time: use it with `yield from`."""


class NoEnergyError(NetsimError):
    """Sensing or computing was refused: the node's energy allowance is used up, and its policy is to refuse.

    Catch it where the algorithm can do without; uncaught it ends the algorithm on this node.
    """


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
        frame_began_ns: When the frame that completed it began to arrive, by this node's counter and with the error of the
            radio's capture; None where the link layer cannot tell.
    """

    id: int
    source: int
    destination: int
    kind: str
    payload: bytes
    received_ns: int
    hops: int
    frame_began_ns: int | None = None


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
