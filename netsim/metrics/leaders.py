"""Who leads when a track's belief wanders: outages, tracks with two leaders, and beliefs that go astray.

A node leads while it holds the role `leader`; one that dies, crashes or ends its algorithm holds no role any more, although
it cannot say so. Which track it leads, and which of its redundant threads, is told by the last event that names both:
`Handoff` (to it or by it), `Belief` or `Estimate`. It may lead several threads: then it leads one that it hands over until
it has chosen to whom, for the role does not tell when it has given one of them away.
"""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any, Final

from netsim.trace.events import (
    Belief,
    EnergyLedger,
    Estimate,
    Handoff,
    MessageSent,
    NodeLife,
    Role,
    TruthTargets,
)
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

LEADER: Final = "leader"
BELIEF_KIND: Final = "handoff"
"""Kind of the messages that carry a belief."""
_Thread = tuple[int, int]  # track and thread
_UNKNOWN: _Thread = (-1, -1)  # of a leader of which nothing else is said

_Choice = tuple[tuple[_Thread, int], frozenset[int]]  # thread and step, and to whom the belief is to go
_NO_CHOICE: _Choice = (_UNKNOWN, -1), frozenset()


Span = tuple[int, int]
"""From here to there, ns."""


class _Spans:
    """When something was so; what began and ended at the same instant was not."""

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self.found_ns: list[Span] = []

    def begin(self, now_ns: int) -> None:
        """It is so from now on, if it was not already."""
        if self._since_ns is None:
            self._since_ns = now_ns

    def end(self, now_ns: int) -> None:
        """It is so no more, if it was."""
        if self._since_ns is not None and now_ns > self._since_ns:
            self.found_ns.append((self._since_ns, now_ns))
        self._since_ns = None

    def forget(self) -> None:
        """It did not count, as it turned out."""
        self._since_ns = None

    def lengths_s(self) -> list[float]:
        """How long it was so each time."""
        return [(end_ns - begin_ns) / NS_PER_S for begin_ns, end_ns in self.found_ns]


class Leaders:
    """Follows the role `leader` from node to node."""

    def __init__(self) -> None:
        self._threads: defaultdict[int, set[_Thread]] = defaultdict(set)  # that a node leads, if it leads
        self._given: defaultdict[int, set[_Thread]] = defaultdict(set)  # of these, those with a next leader chosen
        self._holders: set[int] = set()
        self._last_leader: dict[_Thread, int] = {}
        self._led: set[int] = set()
        self._first_ns = 0
        self._changes = 0
        self._target_is_there = False
        self._outages = _Spans()
        self._left_by: int | None = None  # who led last when the outage began
        self._doubled: defaultdict[_Thread, _Spans] = defaultdict(_Spans)
        self._chosen: dict[int, _Choice] = {}  # by leader
        self._beliefs_sent = self._beliefs_astray = 0
        self._now_ns = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            Role: self._on_role,
            NodeLife: self._on_life,
            TruthTargets: self._on_truth,
            Handoff: self._on_handoff,
            Belief: self._on_told,
            Estimate: self._on_told,
            MessageSent: self._on_sent,
            EnergyLedger: self._on_end,
        }

    def outages_ns(self) -> list[Span]:
        """When nobody led though a target was there; one that still goes on ends with the last event."""
        self._close()
        return self._outages.found_ns

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where nobody ever led."""
        if not self._led:
            return {}
        self._close()
        outages_s = self._outages.lengths_s()
        doubled_s = [length_s for spans in self._doubled.values() for length_s in spans.lengths_s()]
        return {
            "leader_first_s": self._first_ns / NS_PER_S,
            "leader_nodes": len(self._led),
            "leader_changes": self._changes,
            "outages": len(outages_s),
            "outage_total_s": sum(outages_s),
            "outage_longest_s": max(outages_s, default=0.0),
            "outage_first_s": outages_s[0] if outages_s else None,
            "two_leaders_s": sum(doubled_s),
            "two_leaders_longest_s": max(doubled_s, default=0.0),
            "belief_messages": self._beliefs_sent,
            "belief_messages_astray": self._beliefs_astray,
        }

    def _close(self) -> None:
        """What still goes on ends with the run."""
        self._outages.end(self._now_ns)
        for spans in self._doubled.values():
            spans.end(self._now_ns)

    def _on_end(self, _: EnergyLedger, now_ns: int) -> None:
        self._now_ns = now_ns

    def _on_role(self, event: Role, now_ns: int) -> None:
        self._now_ns = now_ns
        if event.role != LEADER:
            return
        if event.holds:
            self._take_over(event.node, now_ns)
        else:
            self._step_down(event.node, now_ns)

    def _on_life(self, event: NodeLife, now_ns: int) -> None:
        self._now_ns = now_ns
        if event.event not in ("started", "rebooted"):
            self._step_down(event.node, now_ns)

    def _take_over(self, node: int, now_ns: int) -> None:
        if not self._led:
            self._first_ns = now_ns
        self._led.add(node)
        self._holders.add(node)
        self._end_outage(node, now_ns)
        self._chosen.pop(node, None)
        self._note_leader(node)
        self._count(now_ns)

    def _step_down(self, node: int, now_ns: int) -> None:
        if node in self._holders:
            self._holders.discard(node)
            self._count(now_ns)
            self._given.pop(node, None)
            if not self._holders and self._target_is_there:
                self._outages.begin(now_ns)
                self._left_by = node

    def _end_outage(self, node: int, now_ns: int) -> None:
        """The way of a belief from leader to next leader is no outage; that the next one begins a track of its own is."""
        (thread, _), chosen = self._chosen.get(self._left_by, _NO_CHOICE) if self._left_by is not None else _NO_CHOICE
        if node in chosen and thread in self._threads[node]:
            self._outages.forget()
        self._outages.end(now_ns)

    def _note_leader(self, node: int) -> None:
        for thread in sorted(self._threads[node]) or [_UNKNOWN]:
            self._changes += self._last_leader.get(thread, node) != node
            self._last_leader[thread] = node

    def _count(self, now_ns: int) -> None:
        """Begin and end the times in which a thread has several leaders."""
        threads = [thread for node in self._holders for thread in self._threads[node] or {_UNKNOWN}]
        for thread in {*threads, *self._doubled}:
            if threads.count(thread) > 1:
                self._doubled[thread].begin(now_ns)
            elif thread in self._doubled:
                self._doubled[thread].end(now_ns)

    def _on_truth(self, event: TruthTargets, now_ns: int) -> None:
        self._now_ns = now_ns
        self._target_is_there = len(event.target) > 0
        if not self._target_is_there:
            self._outages.end(now_ns)

    def _on_told(self, event: Belief | Estimate, now_ns: int) -> None:
        thread = event.target, event.thread
        self._given[event.node].discard(thread)
        self._name(event.node, thread, now_ns)

    def _on_handoff(self, event: Handoff, now_ns: int) -> None:
        thread, turn = (event.target, event.thread), ((event.target, event.thread), event.step)
        self._name(event.node, thread, now_ns)
        self._given[event.node].add(thread)
        if self._threads[event.node] - self._given[event.node]:
            self._threads[event.node] -= self._given[event.node]
        known, before = self._chosen.get(event.node, _NO_CHOICE)
        chosen = before if known == turn else frozenset()
        for other in chosen & self._holders:
            self._threads[other].discard(thread)
        self._threads[event.destination] = {thread, *self._kept(event.destination)}
        self._chosen[event.node] = turn, chosen | {event.destination}
        self._count(now_ns)

    def _kept(self, node: int) -> set[_Thread]:
        """What a node leads and has not given away."""
        return self._threads[node] - self._given[node] if node in self._holders else set()

    def _name(self, node: int, thread: _Thread, now_ns: int) -> None:
        """Learn that a node is at a thread, besides those that it leads and has not given away."""
        if thread in self._threads[node]:
            return
        self._threads[node] = {thread, *self._kept(node)}
        if node in self._holders:
            self._last_leader.setdefault(thread, node)
            self._count(now_ns)

    def _on_sent(self, event: MessageSent, now_ns: int) -> None:
        self._now_ns = now_ns
        if event.kind == BELIEF_KIND:
            _, chosen = self._chosen.get(event.source, _NO_CHOICE)
            self._beliefs_sent += 1
            self._beliefs_astray += event.source not in self._holders or event.destination not in chosen
