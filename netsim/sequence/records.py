"""What a sequence chart shows, as read from a trace."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from netsim.metrics.causes import Sending
from netsim.replay import style
from netsim.trace.events import AlgorithmRecord, GraphMessages, MessageDelivered, MessageDropped, NodeLife, Role

RECEIVED = "received"
CARRYING_NOTHING = ("ack", "strobe")
"""Roles of frames that carry nothing of the message that they are for."""


@dataclass(frozen=True, slots=True)
class Arm:
    """What became of a transmission at one node it was meant for.

    Attributes:
        node: The node.
        outcome: One of `netsim.trace.events.OUTCOMES`, or `out_of_reach`.
        rssi_dbm: Received power; NaN where the medium did not decide.
        sinr_db: Lowest signal to interference and noise; infinity on the ideal medium.
    """

    node: int
    outcome: str
    rssi_dbm: float
    sinr_db: float

    @property
    def is_received(self) -> bool:
        """Whether it arrived."""
        return self.outcome == RECEIVED

    @property
    def is_interfered(self) -> bool:
        """Whether it was lost to another signal."""
        return self.outcome in style.INTERFERENCE


@dataclass(frozen=True, slots=True)
class Transmission:
    """A frame on the air, or a train of wake-up frames that nothing interrupts.

    Attributes:
        frame_id: Number of the frame, of a train that of the first.
        start_ns: When it began.
        end_ns: When it ended.
        source: Who sent it.
        destination: Next hop, or `BROADCAST`.
        kind: Kind of the message it is for.
        role: `data`, `retry`, `ack` or `strobe`.
        size_byte: Physical-layer payload of a frame.
        attempt: 0 for the first transmission.
        message_id: Message it is for; 0 for none.
        arms: Those it was meant for.
        aired: From when to when each frame was on the air.
        spent_j: What the sender's radio drew while it sent; None if the trace does not tell.
        part: Which part of its message it carries, counted at its sender; 0 where that is not known.
        heard: Which radios took it in, and what came of that: `receive`, or the outcome that failed it.
    """

    frame_id: int
    start_ns: int
    end_ns: int
    source: int
    destination: int
    kind: str
    role: str
    size_byte: int
    attempt: int
    message_id: int
    arms: tuple[Arm, ...]
    aired: tuple[tuple[int, int], ...]
    spent_j: float | None = None
    part: int = 0
    heard: tuple["Span", ...] = ()

    @property
    def count(self) -> int:
        """How many frames."""
        return len(self.aired)

    @property
    def airtime_ns(self) -> int:
        """How long the sender's radio sent."""
        return sum(end_ns - start_ns for start_ns, end_ns in self.aired)

    @property
    def carries_message(self) -> bool:
        """Whether it carries a message or a part of one."""
        return self.role not in CARRYING_NOTHING


@dataclass(frozen=True, slots=True)
class Span:
    """What a node's radio did, or was, for a while: a state of radios, or an outcome that failed a reception."""

    node: int
    state: str
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class Change:
    """A node's radio entered a state, or it came down or up."""

    time_ns: int
    node: int
    state: str


E = TypeVar("E")


@dataclass(frozen=True, slots=True)
class Noted(Generic[E]):
    """An event with its instant."""

    time_ns: int
    event: E


@dataclass(slots=True)
class Exchange:
    """A window of a trace.

    Attributes:
        title: Name of the scenario.
        start_ns: From when.
        end_ns: Up to when.
        names: Of the nodes.
        kinds: Message kinds in the order of their colours.
        transmissions: In the order in which they began.
        sendings: The messages handed over in the window, by number.
        delivered: The first delivery of each message at each node.
        dropped: What was given up.
        rounds: Graph messages computed.
        notes: What algorithms noted.
        lives: Deaths, crashes and the like.
        roles: Roles taken and left, before the window too.
        radio: What each node's radio announced, with its last word before the window.
    """

    title: str
    start_ns: int
    end_ns: int
    names: Mapping[int, str] = field(default_factory=dict)
    kinds: Sequence[str] = ()
    transmissions: Sequence[Transmission] = ()
    sendings: Mapping[int, Sending] = field(default_factory=dict)
    delivered: dict[int, dict[int, Noted[MessageDelivered]]] = field(default_factory=dict)
    dropped: list[Noted[MessageDropped]] = field(default_factory=list)
    rounds: list[Noted[GraphMessages]] = field(default_factory=list)
    notes: list[Noted[AlgorithmRecord]] = field(default_factory=list)
    lives: list[Noted[NodeLife]] = field(default_factory=list)
    roles: list[Noted[Role]] = field(default_factory=list)
    radio: dict[int, list[Change]] = field(default_factory=dict)

    def name(self, node: int) -> str:
        """How to call a node."""
        return self.names.get(node, str(node))
