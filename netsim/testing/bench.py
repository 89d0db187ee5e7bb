"""Runs an algorithm on nodes without physics and tells what happened."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from netsim.api import Algorithm, Message, Neighbour
from netsim.errors import AlgorithmError, NetsimError
from netsim.models.devices import CpuDevice
from netsim.rng import Streams
from netsim.sim.budget import NodeBudget
from netsim.sim.clock import Clock
from netsim.sim.devices import Cpu, SensorPort
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.handle import Handle
from netsim.sim.inbox import Inbox
from netsim.sim.local_clock import LocalClock
from netsim.sim.node import Identity, Node
from netsim.sim.parts import Parts
from netsim.sim.radio_switch import RadioSwitch
from netsim.sim.simulation import Member, Simulation
from netsim.sim.stamps import Stamps
from netsim.testing.media import MessageMedium, PerfectMedium
from netsim.testing.post import Post, Station
from netsim.trace.events import EVENT_TYPES, Event
from netsim.trace.recorder import Handler, Recorder
from netsim.units import s_to_ns

E = TypeVar("E")
BENCH_CPU: Final = CpuDevice(name="bench", active_mw=1.0, sleep_mw=0.0, operations_per_s=1e6)
SENSOR_MW: Final = 1.0
SENSOR_SAMPLE_NS: Final = 1_000_000


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
            AlgorithmError: What the algorithm of the lowest failed node raised.
            NetsimError: Which nodes had not ended.
        """
        if self.failures:
            first = min(self.failures)
            message = f"node {first}: {self.failures[first]}"
            raise AlgorithmError(message) from self.failures[first]
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
    sinks: Collection[int] = (),
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
        sinks: Nodes of the role `sink`; a message to a sink goes to the one with the fewest hops, then the lowest number.

    Returns:
        What happened. What an algorithm raised is in `failures`; `require_success` raises it.
    """
    ids = list(range(nodes)) if isinstance(nodes, int) else list(nodes)
    near = {node: [other for other in ids if other != node] for node in ids} if neighbours is None else neighbours
    run = TestRun(delivered={node: [] for node in ids})
    bench = _Bench(run, ids, near, medium or PerfectMedium(), Streams(seed), s_to_ns(duration_s), sinks)
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
        sinks: Collection[int],
    ) -> None:
        self._sinks = sinks
        self._run = run
        self._ids = ids
        self._neighbours = neighbours
        self._streams = streams
        self._clock = clock = Clock()
        self._recorder = Recorder(lambda: clock.now_ns, [run])
        self._delay_ns = s_to_ns(medium.delay_s)
        self._post = Post(clock, self._recorder, medium, neighbours, sinks)
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
        self._simulation.abandon()

    def _identity(self, node: int, knowledge: Any, observe: Callable[[int], ArrayLike] | None) -> Identity:
        near = self._neighbours.get(node, ())
        return Identity(
            id=node,
            name=f"n{node}",
            group="test",
            role="sink" if node in self._sinks else "sensor",
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
        local = LocalClock(clock)
        stamps = Stamps(clock, local)

        def note(message: Message) -> None:
            stamps.came_in(self._delay_ns)
            self._run.delivered[node].append(message)
            deliver(message)

        station = self._post.stations[node] = Station(node, self._post, note)
        station.position_m = _position_m(node)
        switch = RadioSwitch(station)
        account = Account()
        battery = Battery(clock, battery_j, on_empty)
        meters = tuple(Meter(clock, battery, account, device) for device in ("cpu", "sensor"))
        budget = NodeBudget(clock, local, node, battery, None, switch, station, self._recorder)
        station.refuses = lambda: budget.refuses("send")
        sensor = SensorPort(clock, SENSOR_MW, SENSOR_SAMPLE_NS, meters[1]) if senses else None
        cpu = Cpu(clock, BENCH_CPU, meters[0])
        return Parts(
            account,
            battery,
            station,
            cpu,
            sensor,
            station,
            station,
            Inbox(clock),
            meters,
            local,
            stamps,
            switch,
            budget,
        )


def _position_m(node: int) -> tuple[float, float]:
    """Nodes stand in a row, a metre apart."""
    return (float(node), 0.0)


def _neighbours(node: int, near: Iterable[int]) -> Iterable[Neighbour]:
    return (Neighbour(other, float(abs(other - node)), 1.0) for other in sorted(near))
