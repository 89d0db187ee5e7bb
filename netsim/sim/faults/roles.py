"""Crashes that strike whoever holds a role, as the nodes' algorithms tell it."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from netsim.sim.clock import Clock
from netsim.sim.faults.announce import Announcer
from netsim.sim.faults.schedule import Crash, bring_down
from netsim.trace.events import NodeLife, Role
from netsim.trace.recorder import Handler

ENDS_OF_LIFE = frozenset({"crashed", "died", "finished", "failed"})
Taken = Callable[[str, int], None]
"""Called with a role and the node that takes it."""


class RoleHolders:
    """Follows a run: who holds which role.

    Attributes:
        on_taken: Whom to tell when a node takes a role.
    """

    def __init__(self) -> None:
        self._nodes: defaultdict[str, set[int]] = defaultdict(set)
        self.on_taken: list[Taken] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Role: self._on_role, NodeLife: self._on_life}

    def of(self, role: str) -> list[int]:
        """The nodes that hold a role, ascending."""
        return sorted(self._nodes.get(role, ()))

    def _on_role(self, event: Role, _: int) -> None:
        if not event.holds:
            self._nodes[event.role].discard(event.node)
            return
        self._nodes[event.role].add(event.node)
        for tell in list(self.on_taken):
            tell(event.role, event.node)

    def _on_life(self, event: NodeLife, _: int) -> None:
        if event.event in ENDS_OF_LIFE:
            for nodes in self._nodes.values():
                nodes.discard(event.node)


@dataclass(frozen=True, slots=True)
class RoleStrike:
    """What befalls whoever holds a role.

    Attributes:
        role: The role.
        at_ns: When.
        down_ns: How long a node stays down; None for ever.
        most: At most so many nodes; None for all.
    """

    role: str
    at_ns: int
    down_ns: int | None
    most: int | None


class RoleCrash:
    """Lets whoever holds a role crash, once.

    Args:
        clock: Simulated time.
        holders: Who holds which role.
        strike: Which role, when and for how long.
        crash: Brings a node down.
        announcer: Tells the trace.
    """

    def __init__(
        self,
        clock: Clock,
        holders: RoleHolders,
        strike: RoleStrike,
        crash: Crash,
        announcer: Announcer,
    ) -> None:
        self._clock = clock
        self._holders = holders
        self._what = strike
        self._crash = crash
        self._announcer = announcer
        clock.call_first(max(1, strike.at_ns - clock.now_ns), lambda _: self._strike())

    def _strike(self) -> None:
        nodes = self._holders.of(self._what.role)[: self._what.most]
        for node in nodes:
            self._bring_down(node)
        if not nodes:
            self._holders.on_taken.append(self._on_taken)

    def _on_taken(self, role: str, node: int) -> None:
        """Somebody takes the role that nobody held: it crashes once it has done what it is about."""
        if role == self._what.role:
            self._holders.on_taken.remove(self._on_taken)
            self._clock.call_first(1, lambda _: self._bring_down(node))

    def _bring_down(self, node: int) -> None:
        bring_down(node, self._what.down_ns, self._crash, self._announcer)
