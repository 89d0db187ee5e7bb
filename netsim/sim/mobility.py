"""Nodes that move: positions and radio links change in steps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from netsim.api import Neighbour
from netsim.models.waypoints import Path
from netsim.sim.air import Link
from netsim.sim.clock import Clock
from netsim.sim.node import Node
from netsim.trace.events import NodePositions
from netsim.trace.recorder import Recorder

Positions = Mapping[int, tuple[float, float]]


class MovingAir(Protocol):
    """Every path between nodes, kept up where nodes move (see `netsim.scenario.links.Air`)."""

    @property
    def neighbours(self) -> Mapping[int, tuple[Neighbour, ...]]:
        """For each node its neighbours, as of the last `relocate`."""
        ...

    def relocate(self, moved: Positions) -> Mapping[int, Sequence[Link]]:
        """Nodes moved: the new links of every sender whose links changed."""
        ...


@dataclass(frozen=True, slots=True)
class Mover:
    """A node that moves.

    Attributes:
        path: Its way.
        update_ns: Time between two positions.
    """

    path: Path
    update_ns: int

    def next_ns(self, now_ns: int) -> int | None:
        """When its position changes next; None once it has arrived."""
        earlier_ns = now_ns // self.update_ns * self.update_ns
        return None if earlier_ns >= self.path.end_ns else earlier_ns + self.update_ns


class Mobility:
    """Moves nodes on: one change of the links an instant, before everything else that happens then.

    A node knows its own position at once and without error, as by satellite, and the neighbours that it was given follow.

    Args:
        clock: Simulated time.
        recorder: Where `NodePositions` events go.
        movers: The nodes that move, by id.
        nodes: All nodes.
        air: Where links come from.
        replace_links: Tells the medium a sender's new links.
    """

    def __init__(
        self,
        clock: Clock,
        recorder: Recorder,
        movers: Mapping[int, Mover],
        nodes: Mapping[int, Node],
        air: MovingAir,
        replace_links: Callable[[int, Sequence[Link]], None],
    ) -> None:
        self._clock = clock
        self._recorder = recorder
        self._movers = dict(sorted(movers.items()))
        self._nodes = nodes
        self._air = air
        self._replace_links = replace_links
        self._await_next()

    def _await_next(self) -> None:
        now_ns = self._clock.now_ns
        times_ns = [due_ns for mover in self._movers.values() if (due_ns := mover.next_ns(now_ns)) is not None]
        if times_ns:
            self._clock.call_first(min(times_ns) - now_ns, self._update)

    def _update(self, _: object) -> None:
        now_ns = self._clock.now_ns
        moved = {}
        for number, mover in self._movers.items():
            position_m = mover.path.at(now_ns)
            if now_ns % mover.update_ns == 0 and position_m != self._nodes[number].identity.position_m:
                moved[number] = position_m
        if moved:
            self._move(moved)
        self._await_next()

    def _move(self, moved: Positions) -> None:
        for source, links in self._air.relocate(moved).items():
            self._replace_links(source, links)
        for number, node in self._nodes.items():
            identity, neighbours = node.identity, self._air.neighbours[number]
            position_m = moved.get(number, identity.position_m)
            if position_m != identity.position_m or neighbours != identity.neighbours:
                node.identity = replace(identity, position_m=position_m, neighbours=neighbours)
        x_m, y_m = [x for x, _ in moved.values()], [y for _, y in moved.values()]
        self._recorder.record(NodePositions(list(moved), x_m, y_m))
