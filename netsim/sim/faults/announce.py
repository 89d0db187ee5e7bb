"""How faults get into the trace: as events for machines, and as log lines for people."""

from collections.abc import Sequence
from dataclasses import dataclass

from netsim.sim.clock import Clock
from netsim.trace.events import Fault, Log
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S

WARNING = 3
MOST_NAMED = 6


@dataclass(frozen=True, slots=True)
class Span:
    """A half-open interval of time; no end if `to_ns` is None."""

    from_ns: int
    to_ns: int | None

    def holds(self, now_ns: int) -> bool:
        """Whether a time is inside."""
        return self.from_ns <= now_ns and (self.to_ns is None or now_ns < self.to_ns)


ALWAYS = Span(0, None)


class Announcer:
    """Says of one rule when it begins, ends and strikes.

    Args:
        clock: Simulated time.
        recorder: Where its events go.
        rule: Position of the rule in the scenario.
        kind: Type of the rule.
    """

    def __init__(self, clock: Clock, recorder: Recorder, rule: int, kind: str) -> None:
        self._clock = clock
        self._recorder = recorder
        self._rule = rule
        self._kind = kind

    def begins(self, nodes: Sequence[int], detail: str) -> None:
        """The rule holds from now on."""
        self._say("begins", nodes, detail)

    def ends(self, nodes: Sequence[int], detail: str) -> None:
        """It holds no more."""
        self._say("ends", nodes, detail)

    def crashes(self, node: int, detail: str) -> None:
        """It has struck a whole node: worth a line."""
        self._say("strikes", [node], detail)

    def strikes(self, nodes: Sequence[int], detail: str) -> None:
        """It has struck a frame, a packet or a reading at some nodes: an event without a line."""
        if self._recorder.wants(Fault):
            self._recorder.record(Fault(self._rule, self._kind, "strikes", nodes, detail))

    def _say(self, event: str, nodes: Sequence[int], detail: str) -> None:
        self._recorder.record(Fault(self._rule, self._kind, event, nodes, detail))
        if self._recorder.wants(Log):
            seconds, nanoseconds = divmod(self._clock.now_ns, NS_PER_S)
            text = f"{self._kind} {event}: {detail}"
            self._recorder.record(Log(seconds, nanoseconds, WARNING, text, f"faults[{self._rule}]", "", 0))


def named(nodes: Sequence[int]) -> str:
    """Nodes in words, the first few of many."""
    if len(nodes) == 1:
        return f"node {nodes[0]}"
    shown = ", ".join(str(node) for node in nodes[:MOST_NAMED])
    return f"nodes {shown}" + (f" and {len(nodes) - MOST_NAMED} more" if len(nodes) > MOST_NAMED else "")
