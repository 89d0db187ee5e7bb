"""All that an algorithm may do on its node, and what an algorithm is."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np

from netsim.api.records import Message, Neighbour, Observation, Op, Region
from netsim.api.waiting import Budget, EnergyTask, Task, Ticket
from netsim.trace.events import Event

T = TypeVar("T")


class NodeHandle(Protocol):
    """All that an algorithm may do on its node."""

    @property
    def id(self) -> int:
        """This node's number."""
        ...

    @property
    def now_ns(self) -> int:
        """This node's clock: it may start off and drift, and somebody may set it (`adjust_clock`)."""
        ...

    @property
    def counter_ns(self) -> int:
        """The counter below the node's clock, which nobody sets: for measuring, and for protocols that set the clock."""
        ...

    def adjust_clock(self, step_ns: int, rate_ppb: int = 0) -> None:
        """Set the node's clock; the counter below it runs on.

        Args:
            step_ns: Added to what the clock shows now.
            rate_ppb: How much faster than the counter the clock runs from now on, in parts per 10^9, replacing what was
                set before; at most 1,000,000 either way.

        Raises:
            AlgorithmError: For numbers that are not whole, or a rate out of range.
        """
        ...

    @property
    def knowledge(self) -> Any:
        """What the node legitimately knows at the start: a frozen record given by the problem, or None."""
        ...

    @property
    def position_m(self) -> tuple[float, float]:
        """Where this node believes it is: where it is, also if it moves."""
        ...

    @property
    def role(self) -> str:
        """`sensor` or `sink`."""
        ...

    @property
    def neighbours(self) -> Sequence[Neighbour]:
        """Nodes within direct radio reach, by id: given, or those discovered so far (see the scenario's network).

        Those that were given follow nodes that move.
        """
        ...

    @property
    def energy_left_j(self) -> float:
        """Energy left in the battery; infinity on mains power."""
        ...

    @property
    def budget(self) -> Budget:
        """The node's energy allowance; what happens when it is used up is the scenario's policy.

        `refuse`: messages end at once with `Delivery(False, "no_energy", 0)`, forwarded ones too; `sense` and `compute`
        raise `NoEnergyError`. `sleep`: the radio powers down once it has sent what its MAC has already; up to 64 packets
        wait and others are dropped as `queue_full`; `sense` and `compute` wait. `warn`: nothing happens. What has begun is
        finished, acknowledgements are always sent, and merely waiting is free to go on.
        """
        ...

    def task(self, name: str, *, allowance_j: float | None = None, policy: str = "warn") -> EnergyTask:
        """A task whose energy is counted: `with node.task("round", allowance_j=0.01) as task: ...`.

        Args:
            name: For the trace.
            allowance_j: What it may draw; None to count only.
            policy: `warn`: look at `task.is_short`; `refuse`: while the task is open and its allowance used up, the node
                refuses as in `budget`, whoever on it asks.

        Raises:
            AlgorithmError: For an allowance that is not above 0 or another policy.
        """
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

    def broadcast_stamped(self, kind: str, payload: bytes) -> Ticket:
        """As `broadcast`, with a time stamp that the link layer writes as the frame begins.

        It is what the clock then shows (`now_ns`), over the last eight bytes of the payload, little-endian and signed.
        Every transmission of the frame has its own. The message names no causes.

        Raises:
            AlgorithmError: For a payload of under 8 or over 32 bytes: it must fit into one frame.
        """
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
        """Wait for the next message that fits; None after `timeout_ns` of the node's clock, measured as in `pause`.

        Messages that do not fit stay for others. Without `kinds` any message fits but those of services.
        """
        ...

    def pause(self, duration_ns: int) -> Op[None]:
        """Do nothing for a while, by the node's clock; the radio keeps listening unless put to sleep.

        A duration is measured as the clock runs when it begins: setting the clock meanwhile changes nothing.
        """
        ...

    def pause_until(self, time_ns: int) -> Op[None]:
        """Do nothing until the node's clock shows `time_ns`; returns at once if that has passed.

        Where the clock is set meanwhile, it returns at the instant at which the clock, as set then, shows the time.
        """
        ...

    def radio_sleep(self) -> None:
        """Turn the radio off as soon as its queue is empty; nothing is received while it sleeps.

        With a MAC that sleeps by itself this ends its schedule too: low-power listening samples no more, TDMA leaves out
        the slots of neighbours. What is sent is still sent.
        """
        ...

    def radio_wake(self) -> None:
        """Turn the radio on again; it can receive after its start-up time.

        With a MAC that sleeps by itself this goes back to its schedule, not to a radio that is always on.
        """
        ...

    def sense(self) -> Op[Observation]:
        """Read the node's sensor: takes its time and energy. May raise `NoEnergyError` (see `budget`)."""
        ...

    def compute(self, operations: int) -> Op[None]:
        """Occupy the CPU for a number of elementary operations: takes its time and energy.

        Only what is given here is charged: whatever else the algorithm computes takes no simulated time and no energy.
        May raise `NoEnergyError` (see `budget`).
        """
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
                Association, Marginals, PairProbabilities, Estimate, Belief, Particles, Group, Handoff, Identity,
                GraphMessages, Role and AlgorithmRecord.
        """
        ...


class Algorithm(Protocol):
    """What a node runs. State belongs into the locals of `run`: after a reboot it starts anew."""

    def run(self, node: NodeHandle) -> Op[None]:
        """The algorithm's life on one node, as a SimPy process."""
        ...
