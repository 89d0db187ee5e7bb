'''Test doubles for authors of algorithms: some nodes, a perfect or a scripted medium, no physics.

Nodes, handles, inboxes, CPUs and batteries are those of a simulation, so an algorithm sees no difference; only what lies
below a message is replaced. A run takes milliseconds and is the same every time.

    >>> from netsim.trace.events import Log
    >>> class Roll:
    ...     """Tell everybody one's number and log the numbers of the others."""
    ...
    ...     def run(self, node):
    ...         node.broadcast("number", bytes([node.id]))
    ...         for _ in node.neighbours:
    ...             message = yield from node.receive(kinds={"number"}, timeout_ns=10_000_000)
    ...             node.log("missing" if message is None else f"heard {message.payload[0]}")
    >>> run = run_algorithm(Roll(), nodes=3).require_success()
    >>> [message.source for message in run.delivered[0]]
    [1, 2]

What goes wrong on the way is a rule outside the code under test:

    >>> lossy = ScriptedMedium([rule(DROP, kind="number", source=1, destination=0)])
    >>> run = run_algorithm(Roll(), nodes=3, medium=lossy)
    >>> [event.message for _, event in run.of(Log) if event.name == "node 0"]
    ['heard 2', 'missing']

The devices are made for mental arithmetic: an operation of the CPU takes 1 us and 1 nJ, a reading of the sensor 1 ms and
1 uJ; the radio draws nothing, wakes at once, and queues nothing.
'''

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Protocol, TypeVar

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike

from netsim.api import Algorithm, Delivery, Message, Neighbour
from netsim.errors import NetsimError
from netsim.models.devices import CpuDevice
from netsim.rng import Streams
from netsim.sim.clock import Clock
from netsim.sim.devices import Cpu, SensorPort
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.handle import Handle
from netsim.sim.inbox import Inbox
from netsim.sim.node import Identity, Node, Parts
from netsim.sim.simulation import Member, Simulation
from netsim.trace.events import (
    BROADCAST,
    EVENT_TYPES,
    RADIO_STATE_CODE,
    Event,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    RadioState,
)
from netsim.trace.recorder import Handler, Recorder
from netsim.units import s_to_ns

__all__ = [
    "DROP",
    "PASS",
    "MessageMedium",
    "Passage",
    "PerfectMedium",
    "Rule",
    "ScriptedMedium",
    "TestRun",
    "Verdict",
    "delay",
    "duplicate",
    "rule",
    "run_algorithm",
]

E = TypeVar("E")
BENCH_CPU: Final = CpuDevice(name="bench", active_mw=1.0, sleep_mw=0.0, operations_per_s=1e6)
SENSOR_MW: Final = 1.0
SENSOR_SAMPLE_NS: Final = 1_000_000

Verdict = tuple[int, ...]
"""What becomes of a message at one receiver: the extra delay in ns of every copy that arrives; none if it is lost."""
PASS: Final[Verdict] = (0,)
DROP: Final[Verdict] = ()


def delay(extra_s: float) -> Verdict:
    """It arrives later than usual."""
    return (s_to_ns(extra_s),)


def duplicate(after_s: float) -> Verdict:
    """It arrives as usual and once more, `after_s` later."""
    return (0, s_to_ns(after_s))


@dataclass(frozen=True, slots=True)
class Passage:
    """A message on its way to one receiver, as rules see it.

    Attributes:
        source: Who sent it.
        destination: Who is to receive it: one passage for each receiver of a broadcast.
        kind: Its kind.
        payload: Its bytes.
        time_ns: When it was sent.
        count: How many messages of this kind went from source to destination before it.
        is_broadcast: Whether it was sent to all.
    """

    source: int
    destination: int
    kind: str
    payload: bytes
    time_ns: int
    count: int
    is_broadcast: bool


Rule = Callable[[Passage], Verdict | None]
"""Decides about a passage; None leaves it to the next rule."""


def rule(
    verdict: Verdict,
    *,
    source: int | None = None,
    destination: int | None = None,
    kind: str | None = None,
    counts: Collection[int] | None = None,
    from_s: float = 0.0,
    until_s: float = math.inf,
    when: Callable[[Passage], bool] | None = None,
) -> Rule:
    """A rule that gives `verdict` where everything named holds.

    Args:
        verdict: `PASS`, `DROP`, `delay(...)` or `duplicate(...)`.
        source: Only messages of this node.
        destination: Only messages to this node.
        kind: Only messages of this kind.
        counts: Only these of the kind's messages on the edge, counted from 0: `{0}` is the first.
        from_s: Only messages sent at this time or later.
        until_s: Only messages sent before this time.
        when: Only where this holds.
    """

    def decide(passage: Passage) -> Verdict | None:
        fits = (
            source in (None, passage.source)
            and destination in (None, passage.destination)
            and kind in (None, passage.kind)
            and (counts is None or passage.count in counts)
            and from_s * 1e9 <= passage.time_ns < until_s * 1e9
            and (when is None or when(passage))
        )
        return verdict if fits else None

    return decide


class MessageMedium(Protocol):
    """What carries messages in a test."""

    @property
    def delay_s(self) -> float:
        """Usual time from sending to reception."""
        ...

    def verdict(self, passage: Passage) -> Verdict:
        """What becomes of a message."""
        ...


@dataclass(frozen=True, slots=True)
class PerfectMedium:
    """Everything arrives, `delay_s` after it was sent."""

    delay_s: float = 1e-3

    def verdict(self, passage: Passage) -> Verdict:
        """See `MessageMedium.verdict`."""
        return PASS


@dataclass(frozen=True, slots=True)
class ScriptedMedium:
    """Rules decide; the first that has an opinion counts, and without one the message passes."""

    rules: Sequence[Rule]
    delay_s: float = 1e-3

    def verdict(self, passage: Passage) -> Verdict:
        """See `MessageMedium.verdict`."""
        verdicts = (decide(passage) for decide in self.rules)
        return next((verdict for verdict in verdicts if verdict is not None), PASS)


@dataclass(slots=True)
class TestRun:
    """What happened.

    Attributes:
        events: Every event with its time in ns, in order.
        delivered: For each node the messages that reached its inbox, in order, whether or not they were read.
        failures: What the algorithm raised, for the nodes where it did.
        unfinished: Nodes whose algorithm was still running at the end.
        energy_j: What each node drew.
        end_ns: When the run ended.
    """

    __test__: ClassVar[bool] = False  # not a test, whatever pytest reads into the name

    events: list[tuple[int, Event]] = field(default_factory=list)
    delivered: dict[int, list[Message]] = field(default_factory=dict)
    failures: dict[int, NetsimError] = field(default_factory=dict)
    unfinished: tuple[int, ...] = ()
    energy_j: dict[int, float] = field(default_factory=dict)
    end_ns: int = 0

    def of(self, event_type: type[E]) -> list[tuple[int, E]]:
        """The events of one kind, with their times in ns."""
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, event_type)]

    def require_success(self) -> "TestRun":
        """This run, if every algorithm ended without raising.

        Raises:
            NetsimError: What the algorithm of the lowest failed node raised, or which nodes had not ended.
        """
        if self.failures:
            raise self.failures[min(self.failures)]
        if self.unfinished:
            message = f"the algorithm had not ended after {self.end_ns} ns on nodes {list(self.unfinished)}"
            raise NetsimError(message)
        return self

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `netsim.trace.recorder.Observer`."""
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))


def run_algorithm(
    algorithm: Algorithm | Callable[..., Algorithm],
    nodes: int | Sequence[int] = 2,
    *,
    knowledge: Callable[[int], Any] | None = None,
    observe: Callable[[int], ArrayLike] | None = None,
    neighbours: Mapping[int, Collection[int]] | None = None,
    medium: MessageMedium | None = None,
    duration_s: float = 3600.0,
    seed: int = 1,
    battery_j: float = math.inf,
    parameters: Any = None,
) -> TestRun:
    """Run an algorithm on some nodes until it has ended everywhere and nothing is on its way.

    Deliveries at the same instant happen in the order of receiver, sender, message number and copy. A broadcast reaches
    the neighbours; a message to a node further away takes the fewest hops but no longer, and is dropped as `no_route`
    where there is no way. A unicast message that is lost, or that finds its receiver asleep or dead, is `no_ack`.

    Args:
        algorithm: An algorithm, or a function or class that makes a new one for every node.
        nodes: How many, numbered from 0, or their numbers.
        knowledge: From a node's number to what it knows at the start; a table's `__getitem__` will do.
        observe: From a node's number to its next reading; without it the nodes have no sensor.
        neighbours: Who hears whom, such as `networkx.path_graph(5).adj`; by default everybody everybody.
        medium: By default `PerfectMedium()`.
        duration_s: The latest end.
        seed: Of the nodes' random streams.
        battery_j: What each node has.
        parameters: Given to `algorithm` to make an algorithm of, if not None.

    Returns:
        What happened. What an algorithm raised is in `failures`; `require_success` raises it.
    """
    ids = list(range(nodes)) if isinstance(nodes, int) else list(nodes)
    near = {node: [other for other in ids if other != node] for node in ids} if neighbours is None else neighbours
    run = TestRun(delivered={node: [] for node in ids})
    bench = _Bench(run, ids, near, medium or PerfectMedium(), Streams(seed), s_to_ns(duration_s))
    make = _factory(algorithm, parameters)
    for node in ids:
        known = None if knowledge is None else knowledge(node)
        bench.add(node, make(), known, observe, battery_j)
    bench.run()
    return run


def _factory(algorithm: Any, parameters: Any) -> Callable[[], Algorithm]:
    if not isinstance(algorithm, type) and hasattr(algorithm, "run"):
        return lambda: algorithm
    return algorithm if parameters is None else lambda: algorithm(parameters)


class _Station:
    """Radio, MAC and network layer of one node in one: a letter box."""

    def __init__(self, node: int, post: "_Post", deliver: Callable[[Message], None]) -> None:
        self._node = node
        self._post = post
        self.deliver = deliver
        self.state = "off"
        self.pending = 0

    def start(self) -> None:
        self.state = "listen"

    def die(self) -> None:
        self._turn("dead")

    def settle(self) -> None:
        """It draws nothing."""

    def stop(self) -> None:
        """What is on its way already arrives."""

    def sleep(self) -> None:
        if self.state == "listen":
            self._turn("sleep")

    def wake(self) -> None:
        if self.state == "sleep":
            self._turn("listen")

    def send(
        self, destination: int, kind: str, payload: bytes, causes: Sequence[int], done: Callable[[Delivery], None]
    ) -> int:
        return self._post.accept(self._node, destination, kind, payload, causes, done)

    def _turn(self, state: str) -> None:
        self.state = state
        self._post.recorder.record(RadioState(self._node, RADIO_STATE_CODE[state]))


@dataclass(frozen=True, slots=True)
class _Letter:
    """A sent message and whom to tell what became of it."""

    id: int
    source: int
    destination: int
    kind: str
    payload: bytes
    sent_ns: int
    done: Callable[[Delivery], None]


class _Post:
    """Carries letters between stations as the medium decides."""

    def __init__(
        self, clock: Clock, recorder: Recorder, medium: MessageMedium, neighbours: Mapping[int, Collection[int]]
    ) -> None:
        self._clock = clock
        self.recorder = recorder
        self._medium = medium
        self._neighbours = neighbours
        self._graph = nx.DiGraph((node, other) for node, others in neighbours.items() for other in others)
        self.stations: dict[int, _Station] = {}
        self._sent = 0
        self._counts: defaultdict[tuple[int, int, str], int] = defaultdict(int)
        self._due: dict[int, list[tuple[tuple[int, ...], Callable[[], None]]]] = {}

    def accept(
        self,
        source: int,
        destination: int,
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Callable[[Delivery], None],
    ) -> int:
        self._sent += 1
        self.recorder.record(MessageSent(self._sent, source, destination, kind, len(payload), 1, causes))
        letter = _Letter(self._sent, source, destination, kind, payload, self._clock.now_ns, done)
        if destination == BROADCAST:
            self._spread(letter)
        elif (hops := self._hops(source, destination)) is None:
            self._lose(letter, "no_route", 0)
        else:
            self._carry(letter, destination, hops)
        return letter.id

    def _spread(self, letter: _Letter) -> None:
        for receiver in sorted(self._neighbours.get(letter.source, ())):
            self._carry(letter, receiver, 1)
        self._after(self._usual_ns, letter, letter.source, 0, lambda: letter.done(Delivery(True, "", 1)))

    def _carry(self, letter: _Letter, receiver: int, hops: int) -> None:
        edge = (letter.source, receiver, letter.kind)
        passage = Passage(*edge, letter.payload, letter.sent_ns, self._counts[edge], letter.destination == BROADCAST)
        self._counts[edge] += 1
        extras_ns = self._medium.verdict(passage)
        for copy, extra_ns in enumerate(extras_ns):
            self._post_copy(letter, receiver, hops, copy, self._usual_ns + extra_ns)
        if not extras_ns and letter.destination != BROADCAST:
            self._after(self._usual_ns, letter, receiver, 0, lambda: self._lose(letter, "no_ack", 1))

    def _post_copy(self, letter: _Letter, receiver: int, hops: int, copy: int, delay_ns: int) -> None:
        tell = copy == 0 and letter.destination != BROADCAST
        self._after(delay_ns, letter, receiver, copy, lambda: self._arrive(letter, receiver, hops, tell))

    def _arrive(self, letter: _Letter, receiver: int, hops: int, tell: bool) -> None:
        heard = self.stations[receiver].state == "listen"
        if heard:
            self._hand_over(letter, receiver, hops)
        if tell and heard:
            letter.done(Delivery(True, "", 1))
        elif tell:
            self._lose(letter, "no_ack", 1)

    def _hand_over(self, letter: _Letter, receiver: int, hops: int) -> None:
        now_ns = self._clock.now_ns
        latency_ns = now_ns - letter.sent_ns
        size_byte = len(letter.payload)
        self.recorder.record(
            MessageDelivered(letter.id, letter.source, receiver, letter.kind, size_byte, hops, latency_ns)
        )
        self.stations[receiver].deliver(
            Message(letter.id, letter.source, letter.destination, letter.kind, letter.payload, now_ns, hops)
        )

    def _lose(self, letter: _Letter, reason: str, attempts: int) -> None:
        if self.stations[letter.source].state != "dead":
            source = letter.source
            self.recorder.record(MessageDropped(letter.id, source, letter.destination, source, letter.kind, reason))
        letter.done(Delivery(False, reason, attempts))

    def _hops(self, source: int, destination: int) -> int | None:
        if destination in self._neighbours.get(source, ()):
            return 1
        try:
            return int(nx.shortest_path_length(self._graph, source, destination))
        except (nx.NetworkXNoPath, nx.NodeNotFound):
            return None

    @property
    def _usual_ns(self) -> int:
        return s_to_ns(self._medium.delay_s)

    def _after(self, delay_ns: int, letter: _Letter, receiver: int, copy: int, action: Callable[[], None]) -> None:
        """Do something later; what falls on the same instant is sorted, so that no order of sending shows."""
        station = self.stations[letter.source]
        station.pending += 1

        def act() -> None:
            station.pending -= 1
            action()

        at_ns = self._clock.now_ns + delay_ns
        if at_ns not in self._due:
            self._due[at_ns] = []
            self._clock.call_after(delay_ns, self._act_on_due)
        self._due[at_ns].append(((receiver, letter.source, letter.id, copy), act))

    def _act_on_due(self, _: object) -> None:
        for _key, action in sorted(self._due.pop(self._clock.now_ns), key=lambda entry: entry[0]):
            action()


class _Bench:
    """The simulation that a test runs in."""

    def __init__(
        self,
        run: TestRun,
        ids: Sequence[int],
        neighbours: Mapping[int, Collection[int]],
        medium: MessageMedium,
        streams: Streams,
        horizon_ns: int,
    ) -> None:
        self._run = run
        self._ids = ids
        self._neighbours = neighbours
        self._streams = streams
        self._clock = clock = Clock()
        self._recorder = Recorder(lambda: clock.now_ns, [run])
        self._post = _Post(clock, self._recorder, medium, neighbours)
        self._simulation = Simulation(clock, self._recorder, horizon_ns, (), horizon_ns)

    def add(
        self,
        node: int,
        algorithm: Algorithm,
        knowledge: Any,
        observe: Callable[[int], ArrayLike] | None,
        battery_j: float,
    ) -> None:
        made: list[Node] = []
        parts = self._parts(node, observe is not None, battery_j, lambda: made[0].die(), lambda m: made[0].deliver(m))
        identity = self._identity(node, knowledge, observe)
        made.append(Node(self._clock, identity, parts, self._recorder, self._simulation.node_ended))
        handle = Handle(self._clock, made[0], self._streams, self._recorder, frozenset(self._ids))
        self._simulation.add(Member(made[0], handle, algorithm))

    def run(self) -> None:
        self._simulation.run()
        self._simulation.conclude()
        run, nodes = self._run, self._simulation.nodes
        run.end_ns = self._simulation.now_ns
        run.energy_j = {number: node.parts.battery.used_j for number, node in nodes.items()}
        run.failures = {number: node.failure for number, node in nodes.items() if node.failure is not None}
        run.unfinished = tuple(number for number, node in nodes.items() if node.is_running)

    def _identity(self, node: int, knowledge: Any, observe: Callable[[int], ArrayLike] | None) -> Identity:
        near = self._neighbours.get(node, ())
        return Identity(
            id=node,
            name=f"n{node}",
            group="test",
            role="sensor",
            position_m=_position_m(node),
            neighbours=tuple(_neighbours(node, near)),
            knowledge=knowledge,
            observe=lambda: np.asarray(() if observe is None else observe(node), dtype=float),
        )

    def _parts(
        self,
        node: int,
        senses: bool,
        battery_j: float,
        on_empty: Callable[[], None],
        deliver: Callable[[Message], None],
    ) -> Parts:
        clock = self._clock

        def note(message: Message) -> None:
            self._run.delivered[node].append(message)
            deliver(message)

        station = self._post.stations[node] = _Station(node, self._post, note)
        account = Account()
        battery = Battery(clock, battery_j, on_empty)
        meters = tuple(Meter(clock, battery, account, device) for device in ("cpu", "sensor"))
        sensor = SensorPort(clock, SENSOR_MW, SENSOR_SAMPLE_NS, meters[1]) if senses else None
        cpu = Cpu(clock, BENCH_CPU, meters[0])
        return Parts(account, battery, station, cpu, sensor, station, station, Inbox(clock), meters)


def _position_m(node: int) -> tuple[float, float]:
    """Nodes stand in a row, a metre apart."""
    return (float(node), 0.0)


def _neighbours(node: int, near: Iterable[int]) -> Iterable[Neighbour]:
    return (Neighbour(other, float(abs(other - node)), 1.0) for other in sorted(near))
