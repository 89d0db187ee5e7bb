"""What an algorithm holds of its node: `netsim.api.NodeHandle` and not a name more."""

import math
import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, SupportsIndex, TypeVar, cast

import numpy as np

from netsim.api import BROADCAST, SERVICE_PREFIX, Message, Neighbour, Observation, Op, Region
from netsim.errors import AlgorithmError
from netsim.rng import Streams
from netsim.sim.budget import EnergyTask, NodeBudget, Policy
from netsim.sim.clock import Clock
from netsim.sim.devices import SensorPort
from netsim.sim.net.flooding import FLOOD_LIMIT
from netsim.sim.net.regions import what_is_wrong
from netsim.sim.node import Node
from netsim.sim.stamps import MOST_STAMPED_BYTE, STAMP_BYTE
from netsim.sim.tasks import Operation, RunningTask, SentMessage, started
from netsim.trace.events import (
    AlgorithmRecord,
    Association,
    Belief,
    Estimate,
    Event,
    GraphMessages,
    Group,
    Handoff,
    Identity,
    Log,
    Marginals,
    PairProbabilities,
    Particles,
    Role,
)
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S

T = TypeVar("T")
INFO = 2
MOST_RATE_PPB = 1_000_000
MOST_HOPS = 255
MOST_TOGETHER = 24
"""Destinations of one multicast frame: their ids take 49 bytes of it."""
RECORDABLE = (
    AlgorithmRecord,
    Association,
    Belief,
    Estimate,
    GraphMessages,
    Group,
    Handoff,
    Identity,
    Marginals,
    PairProbabilities,
    Particles,
    Role,
)
"""What an algorithm may put into the trace besides log lines."""


class Handle:
    """See `netsim.api.NodeHandle`.

    Args:
        clock: Simulated time.
        node: The node it stands for.
        streams: Random streams of the run.
        recorder: Where its events go.
        known_ids: All node ids, to refuse messages to nobody.
    """

    def __init__(
        self, clock: Clock, node: Node, streams: Streams, recorder: Recorder, known_ids: Collection[int]
    ) -> None:
        self._clock = clock
        self._node = node
        self._streams = streams
        self._recorder = recorder
        self._known_ids = known_ids
        self._generators: dict[str, np.random.Generator] = {}

    @property
    def id(self) -> int:
        """See `NodeHandle.id`."""
        return self._node.identity.id

    @property
    def now_ns(self) -> int:
        """See `NodeHandle.now_ns`."""
        return self._node.parts.clock.now_ns

    @property
    def counter_ns(self) -> int:
        """See `NodeHandle.counter_ns`."""
        return self._node.parts.clock.counter_ns

    def adjust_clock(self, step_ns: int, rate_ppb: int = 0) -> None:
        """See `NodeHandle.adjust_clock`."""
        step_ns, rate_ppb = self._whole("adjust_clock", step_ns), self._whole("adjust_clock", rate_ppb)
        if abs(rate_ppb) > MOST_RATE_PPB:
            message = f"adjust_clock takes a rate of at most {MOST_RATE_PPB} ppb, got {rate_ppb}"
            raise AlgorithmError(message)
        self._node.parts.clock.adjust(step_ns, rate_ppb)

    @property
    def knowledge(self) -> Any:
        """See `NodeHandle.knowledge`."""
        return self._node.identity.knowledge

    @property
    def position_m(self) -> tuple[float, float]:
        """See `NodeHandle.position_m`."""
        return self._node.identity.position_m

    @property
    def role(self) -> str:
        """See `NodeHandle.role`."""
        return self._node.identity.role

    @property
    def neighbours(self) -> Sequence[Neighbour]:
        """See `NodeHandle.neighbours`."""
        discovered = self._node.parts.network.discovered
        return self._node.identity.neighbours if discovered is None else discovered

    @property
    def energy_left_j(self) -> float:
        """See `NodeHandle.energy_left_j`."""
        return self._node.parts.battery.left_j

    @property
    def budget(self) -> NodeBudget:
        """See `NodeHandle.budget`."""
        return self._node.parts.budget

    def task(self, name: str, *, allowance_j: float | None = None, policy: str = "warn") -> EnergyTask:
        """See `NodeHandle.task`."""
        if policy not in ("warn", "refuse"):
            message = f"task(policy={policy!r}): the policy of a task is 'warn' or 'refuse'"
            raise AlgorithmError(message)
        if allowance_j is not None and not 0.0 < allowance_j < math.inf:
            message = f"task(allowance_j={allowance_j!r}) takes joules above 0, or None to count only"
            raise AlgorithmError(message)
        return self._node.parts.budget.task(name, allowance_j, cast(Policy, policy))

    def send(
        self, destination: int, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None
    ) -> SentMessage:
        """See `NodeHandle.send`."""
        self._check(destination, kind)
        return self._send(destination, kind, payload, causes)

    def broadcast(self, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> SentMessage:
        """See `NodeHandle.broadcast`."""
        return self._send(BROADCAST, kind, payload, causes)

    def broadcast_stamped(self, kind: str, payload: bytes) -> SentMessage:
        """See `NodeHandle.broadcast_stamped`."""
        if not STAMP_BYTE <= len(payload) <= MOST_STAMPED_BYTE:
            sizes = f"{STAMP_BYTE} to {MOST_STAMPED_BYTE} bytes"
            message = f"broadcast_stamped takes a payload of {sizes}, got {len(payload)}"
            raise AlgorithmError(message)
        stamps = self._node.parts.stamps
        ticket = self._send(BROADCAST, kind, stamps.fill(payload), ())
        if ticket.is_done:  # refused at once
            return ticket
        stamps.expect(ticket.message_id)
        ticket.on_done = lambda: stamps.forget(ticket.message_id)
        return ticket

    def multicast(
        self, destinations: Collection[int], kind: str, payload: bytes, *, causes: Sequence[Message] | None = None
    ) -> Mapping[int, SentMessage]:
        """See `NodeHandle.multicast`."""
        for destination in destinations:
            self._check(destination, kind)
        network = self._node.parts.network
        direct = sorted({node for node in destinations if network.is_direct(node)})
        groups = [direct[start : start + MOST_TOGETHER] for start in range(0, len(direct), MOST_TOGETHER)]
        shared = [group for group in groups if len(group) > 1]
        tickets: dict[int, SentMessage] = {}
        for group in shared:
            ticket = self._hand_over(kind, payload, causes, partial(network.multicast, group))
            tickets.update(dict.fromkeys(group, ticket))
        for destination in sorted(set(destinations) - set(tickets)):
            tickets[destination] = self._send(destination, kind, payload, causes)
        return dict(sorted(tickets.items()))

    def flood(
        self, kind: str, payload: bytes, *, hop_limit: int = FLOOD_LIMIT, causes: Sequence[Message] | None = None
    ) -> SentMessage:
        """See `NodeHandle.flood`."""
        if not 1 <= self._whole("flood(hop_limit=...)", hop_limit) <= MOST_HOPS:
            message = f"flood(hop_limit={hop_limit}): a flood makes 1 to {MOST_HOPS} hops"
            raise AlgorithmError(message)
        return self._hand_over(kind, payload, causes, partial(self._node.parts.network.flood, hop_limit))

    def geocast(
        self, region: Region, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None
    ) -> SentMessage:
        """See `NodeHandle.geocast`."""
        if not isinstance(region, Region):
            message = f"geocast to {region!r}: a region is a Circle, a Rectangle or a Polygon of netsim.api"
            raise AlgorithmError(message)
        if wrong := what_is_wrong(region):
            message = f"geocast to {wrong}"
            raise AlgorithmError(message)
        return self._hand_over(kind, payload, causes, partial(self._node.parts.network.geocast, region))

    def send_to_sink(self, kind: str, payload: bytes, *, causes: Sequence[Message] | None = None) -> SentMessage:
        """See `NodeHandle.send_to_sink`."""
        return self._hand_over(kind, payload, causes, self._node.parts.network.send_to_sink)

    def receive(
        self,
        *,
        kinds: Collection[str] | None = None,
        match: Callable[[Message], bool] | None = None,
        timeout_ns: int | None = None,
    ) -> Op[Message | None]:
        """See `NodeHandle.receive`."""
        if isinstance(kinds, str):
            message = f"receive(kinds={kinds!r}): kinds is a collection of names, such as {{{kinds!r}}}"
            raise AlgorithmError(message)
        whole_ns = None if timeout_ns is None else self._delay_of(self._whole("receive(timeout_ns=...)", timeout_ns))
        return self._operation("receive", self._received(self._node.parts.inbox.receive(kinds, match, whole_ns)))

    def pause(self, duration_ns: int) -> Op[None]:
        """See `NodeHandle.pause`."""
        return self._operation("pause", self._pause(self._not_negative("pause", duration_ns)))

    def pause_until(self, time_ns: int) -> Op[None]:
        """See `NodeHandle.pause_until`."""
        return self._operation("pause_until", self._node.parts.clock.wait_until(self._whole("pause_until", time_ns)))

    def radio_sleep(self) -> None:
        """See `NodeHandle.radio_sleep`."""
        self._node.parts.switch.sleep()

    def radio_wake(self) -> None:
        """See `NodeHandle.radio_wake`."""
        self._node.parts.switch.wake()

    def sense(self) -> Op[Observation]:
        """See `NodeHandle.sense`."""
        if self._node.parts.sensor is None:
            message = "no sensor to read: give its group one, or let another node sense"
            raise AlgorithmError(message)
        return self._operation("sense", self._sense(self._node.parts.sensor))

    def compute(self, operations: int) -> Op[None]:
        """See `NodeHandle.compute`."""
        return self._operation("compute", self._compute(self._not_negative("compute", operations)))

    def spawn(self, op: Op[T]) -> RunningTask[T]:
        """See `NodeHandle.spawn`."""
        return self._node.spawn(started(op))

    def rng(self, purpose: str) -> np.random.Generator:
        """See `NodeHandle.rng`."""
        if purpose not in self._generators:
            self._generators[purpose] = self._streams.generator(f"node/{self.id}/algorithm/{purpose}")
        return self._generators[purpose]

    def record(self, event: Event) -> None:
        """See `NodeHandle.record`."""
        if not isinstance(event, RECORDABLE):
            message = f"an algorithm cannot record a {type(event).__name__}: that is the simulation's to say"
            raise AlgorithmError(message)
        if event.node != self.id:
            message = f"recorded a {type(event).__name__} of node {event.node}: a node speaks for itself"
            raise AlgorithmError(message)
        self._recorder.record(event)

    def log(self, text: str) -> None:
        """See `NodeHandle.log`."""
        seconds, nanoseconds = divmod(self._clock.now_ns, NS_PER_S)
        self._recorder.record(Log(seconds, nanoseconds, INFO, text, f"node {self.id}", "", 0))

    def _operation(self, name: str, op: Op[T]) -> Op[T]:
        """Something to wait for; whoever drops it unused hears of it at the next call of the handle."""
        self._complain()
        return cast(Op[T], Operation(op, lambda: self._node.forget(name)))

    def _complain(self) -> None:
        """Raise if an operation was dropped without waiting for it."""
        if self._node.forgotten:
            message = f"node.{self._node.forgotten}(...) was called before this without `yield from`: nothing happened"
            raise AlgorithmError(message)

    def _delay_of(self, duration_ns: int) -> int:
        """True time that a duration by the node's clock takes from now."""
        return self._node.parts.clock.delay_of(duration_ns)

    def _pause(self, duration_ns: int) -> Op[None]:
        yield self._clock.timeout(self._delay_of(duration_ns))

    def _compute(self, operations: int) -> Op[None]:
        yield from self._node.parts.budget.admit("compute")
        yield from self._node.parts.cpu.compute(operations)

    def _sense(self, sensor: SensorPort) -> Op[Observation]:
        yield from self._node.parts.budget.admit("sense")
        yield from sensor.sample()
        return Observation(self.now_ns, self._node.identity.observe())

    def _received(self, op: Op[Message | None]) -> Op[Message | None]:
        message = yield from op
        if message is not None and not message.kind.startswith(SERVICE_PREFIX):
            self._node.note_received(message.id)
        return message

    def _whole(self, what: str, number: SupportsIndex) -> int:
        """Time is whole nanoseconds: a float among them would spread through the run's clock."""
        try:
            return operator.index(number)
        except TypeError as error:
            message = f"{what} takes a whole number, got {number!r}; round it, or use netsim.units.s_to_ns"
            raise AlgorithmError(message) from error

    def _not_negative(self, what: str, number: SupportsIndex) -> int:
        whole = self._whole(what, number)
        if whole < 0:
            message = f"{what} takes a number from 0, got {whole}"
            raise AlgorithmError(message)
        return whole

    def _check(self, destination: int, kind: str) -> None:
        if destination == self.id:
            message = f"sent a {kind!r} message to itself: co-hosted variables need no air"
            raise AlgorithmError(message)
        if destination not in self._known_ids:
            message = f"sent a {kind!r} message to node {destination}, which does not exist"
            raise AlgorithmError(message)

    def _send(self, destination: int, kind: str, payload: bytes, causes: Sequence[Message] | None) -> SentMessage:
        return self._hand_over(kind, payload, causes, partial(self._node.parts.network.send, destination))

    def _hand_over(
        self, kind: str, payload: bytes, causes: Sequence[Message] | None, send: Callable[..., int]
    ) -> SentMessage:
        """Give a message to the network layer: `send` takes kind, payload, causes and what is to be told of its fate."""
        self._complain()
        if not kind:
            message = "sent a message without a kind: give it a name, such as 'reading'"
            raise AlgorithmError(message)
        if not isinstance(payload, bytes):
            message = f"the payload of a {kind!r} message is {type(payload).__name__}, not bytes"
            raise AlgorithmError(message)
        ids = self._node.causes() if causes is None else [message.id for message in causes]
        ticket = SentMessage(self._clock)
        ticket.message_id = send(kind, payload, ids, ticket.done)
        return ticket
