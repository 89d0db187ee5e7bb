"""What each round of message passing brought: senders, messages, vertices that fell silent, vertices that woke."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from netsim.trace.events import GraphMessages
from netsim.trace.recorder import Handler

Edge = tuple[int, int]
State = Literal["silent", "fell silent", "sends", "wakes"]


@dataclass(frozen=True, slots=True)
class Round:
    """One synchronous round.

    Attributes:
        number: From 0, the round of the start messages; the paper counts that one as its first iteration.
        time_ns: When the first node recorded it; for a round that no node recorded, that of the round before.
        messages: Sender and receiver of each graph message, sorted; a pair that got several is there several times.
        over_air: How many of them went from one node to another.
        fell_silent: Vertices that sent in the round before but not in this one.
        woken: Vertices that send again after at least one round of silence, each with those that sent to it in the round
            before (on a lossy link not all of that need have arrived).
    """

    number: int
    time_ns: int
    messages: tuple[Edge, ...]
    over_air: int
    fell_silent: frozenset[int]
    woken: Mapping[int, tuple[int, ...]]

    @property
    def senders(self) -> frozenset[int]:
        """Vertices that sent in this round."""
        return frozenset(source for source, _ in self.messages)

    def state_of(self, vertex: int) -> State:
        """What a vertex does in this round."""
        if vertex in self.woken:
            return "wakes"
        if vertex in self.senders:
            return "sends"
        return "fell silent" if vertex in self.fell_silent else "silent"


def waking(this: Round, following: Round | None) -> set[Edge]:
    """The messages of a round whose receivers wake in the next one."""
    woken = following.woken if following is not None else {}
    return {edge for edge in this.messages if edge[1] in woken}


class RoundLog:
    """Follows the graph messages of a run."""

    def __init__(self) -> None:
        self._messages: defaultdict[int, list[Edge]] = defaultdict(list)
        self._over_air: defaultdict[int, int] = defaultdict(int)
        self._time_ns: dict[int, int] = {}
        self._synchronous = True

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {GraphMessages: self.add}

    def add(self, event: GraphMessages, now_ns: int) -> None:
        """Take what one node's variables sent in one round."""
        edges = zip(map(int, event.source), map(int, event.destination), strict=True)
        self.note(int(event.round), now_ns, edges, int(sum(event.remote)), bool(event.is_synchronous))

    def note(self, number: int, now_ns: int, edges: Iterable[Edge], over_air: int, is_synchronous: bool) -> None:
        """The same from the parts of the event that count here."""
        self._synchronous = self._synchronous and is_synchronous
        self._messages[number] += edges
        self._over_air[number] += over_air
        self._time_ns[number] = min(now_ns, self._time_ns.get(number, now_ns))

    @property
    def is_synchronous(self) -> bool:
        """Whether a round is the same instant on all nodes; otherwise there are no rounds to speak of."""
        return self._synchronous

    def rounds(self) -> tuple[Round, ...]:
        """All rounds from 0 to the last that was recorded; empty where no node recorded graph messages."""
        found: list[Round] = []
        before: tuple[Edge, ...] = ()
        known: frozenset[int] = frozenset()
        time_ns = 0
        for number in range(max(self._messages, default=-1) + 1):
            messages = tuple(sorted(self._messages.get(number, ())))
            time_ns = self._time_ns.get(number, time_ns)
            found.append(_round(number, time_ns, messages, self._over_air.get(number, 0), before, known))
            before, known = messages, known | found[-1].senders
        return tuple(found)


def _round(
    number: int, time_ns: int, messages: tuple[Edge, ...], over_air: int, before: Sequence[Edge], known: frozenset[int]
) -> Round:
    """A round after `before`, when the vertices `known` had sent at some time."""
    last, now = {source for source, _ in before}, {source for source, _ in messages}
    woken = {
        vertex: tuple(sorted({source for source, to in before if to == vertex}))
        for vertex in sorted((now & known) - last)
    }
    return Round(number, time_ns, messages, over_air, frozenset(last - now), woken)
