"""Where the vertices live while a run goes on: which nodes are down, and who took a vertex over from whom."""

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field

from netsim.trace.events import AlgorithmRecord, NodeLife

REHOSTED = "rehosted"
_DOWN, _UP = ("died", "crashed"), ("started", "rebooted")


@dataclass(frozen=True, slots=True)
class Takeover:
    """A vertex whose host was believed dead, and which another node hosts from the next round on.

    Attributes:
        vertex: Which one.
        host: The node that took it over.
        before: The node that had it.
        round: The round at whose end it did so.
        time_ns: When.
    """

    vertex: int
    host: int
    before: int
    round: int
    time_ns: int


@dataclass(slots=True)
class HostLog:
    """Follows what befalls the hosts.

    Attributes:
        changes: Of each node that was ever down: when it went down (True) or came up (False), in order.
        takeovers: In order.
    """

    changes: defaultdict[int, list[tuple[int, bool]]] = field(default_factory=lambda: defaultdict(list))
    takeovers: list[Takeover] = field(default_factory=list)

    def add_life(self, event: NodeLife, now_ns: int) -> None:
        """Take a death, a crash or a return."""
        if event.event in _DOWN:
            self.changes[int(event.node)].append((now_ns, True))
        elif event.event in _UP and int(event.node) in self.changes:
            self.changes[int(event.node)].append((now_ns, False))

    def add_record(self, event: AlgorithmRecord, now_ns: int) -> None:
        """Take a note of an algorithm, if it is one of a takeover."""
        if event.kind == REHOSTED:
            told = json.loads(event.fields_json)
            self.takeovers.append(
                Takeover(told["variable"], int(event.node), told["other"], int(told["round"]), now_ns)
            )

    def down_at(self, hosts: Mapping[int, int], time_ns: int) -> frozenset[int]:
        """The vertices whose host is down.

        Args:
            hosts: The node of each vertex at the start.
            time_ns: When.
        """
        now = dict(hosts) | {each.vertex: each.host for each in self.takeovers if each.time_ns <= time_ns}
        down = {node for node, changes in self.changes.items() if _is_down(changes, time_ns)}
        return frozenset(vertex for vertex, node in now.items() if node in down)

    def taken_over_for(self, number: int) -> tuple[Takeover, ...]:
        """The takeovers whose new hosts compute in a round for the first time."""
        return tuple(each for each in self.takeovers if each.round + 1 == number)


def _is_down(changes: list[tuple[int, bool]], time_ns: int) -> bool:
    past = [is_down for when_ns, is_down in changes if when_ns <= time_ns]
    return bool(past) and past[-1]
