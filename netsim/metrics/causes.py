"""Which receptions led to a message, which messages it led to, and when a node spoke and when it was silent.

A message names its causes: the messages its sender received since its sends before (see `NodeHandle.send`). A sender that
was silent for some rounds therefore names everything it received while it was, and following the causes back answers the
question of Chen, Wainwright, Cetin, Willsky, "Data association based on optimization in graphical models with application
to sensor networks", Mathematical and Computer Modelling 43 (2006), fig 10: why did a sensor speak again in that iteration?
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from netsim.trace.events import BROADCAST, GraphMessages, MessageDelivered, MessageSent, VariablePlacement
from netsim.trace.recorder import Handler

SERVICE_PREFIX = "service/"
"""Kinds of the messages of services that run beside an algorithm; these are nobody's turn to speak."""


@dataclass(frozen=True, slots=True)
class Sending:
    """A message as it was handed to the network layer.

    Attributes:
        message_id: Its number in the trace.
        sent_ns: When.
        source: Node that sent it.
        destination: Node it is for, or `BROADCAST`.
        kind: What it is.
        size_byte: Application payload.
        fragments: Packets it went out in.
        causes: Messages whose reception led to it.
        round: Round of the graphical model's messages that it belongs to; None where it belongs to none.
    """

    message_id: int
    sent_ns: int
    source: int
    destination: int
    kind: str
    size_byte: int
    fragments: int
    causes: tuple[int, ...]
    round: int | None


@dataclass(slots=True)
class Turn:
    """A node's turn to speak: a round of the graphical model's messages, or an instant at which it sent something else.

    Attributes:
        begun_ns: When.
        round: Number of the round; None outside of rounds.
        graph: What the round's graph messages were; None outside of rounds.
        messages: What the node sent over the air; empty if it was silent.
    """

    begun_ns: int
    round: int | None
    graph: GraphMessages | None
    messages: list[Sending] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Cause:
    """One reception in a causal chain.

    Attributes:
        message_id: The message received.
        sending: When and by whom it was sent; None if the trace does not hold that.
        received_ns: When it reached the node on whose message it had its effect; None if the trace does not say.
        causes: What led to it, in turn.
        told_at: Where that is told, if not here: at this message, which has the same causes, under that one (0 for the top).
        unfollowed: How many causes it has that are told nowhere, being too deep or too many.
    """

    message_id: int
    sending: Sending | None
    received_ns: int | None
    causes: tuple["Cause", ...] = ()
    told_at: tuple[int, int] | None = None
    unfollowed: int = 0


_Homes = Mapping[tuple[int, tuple[int, ...]], tuple[int, int]]
"""Of causes that messages of a node share: the message at which they are told, and that under which it stands."""


class Causes:
    """Keeps who sent what when, and because of what; a reducer over the events of a run.

    Which round a message belongs to is told by when it was sent and for whom. Where nodes step on their own, a message that
    is sent again after its sender's next step therefore counts to that step.
    """

    def __init__(self) -> None:
        self._sent: dict[int, Sending] = {}
        self._arrived: dict[tuple[int, int], int] = {}
        self._turns: defaultdict[int, list[Turn]] = defaultdict(list)
        self._hosts: dict[int, int] = {}

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            VariablePlacement: self._on_placement,
            GraphMessages: self._on_graph_messages,
            MessageSent: self._on_sent,
            MessageDelivered: self._on_delivered,
        }

    @property
    def sendings(self) -> Mapping[int, Sending]:
        """Every message, by its number."""
        return self._sent

    def turns(self, node: int) -> Sequence[Turn]:
        """The turns of a node, in order; those of a round are there also if it was silent in it."""
        return self._turns.get(node, [])

    def arrived_ns(self, message_id: int, node: int) -> int | None:
        """When a message first reached a node whole; None if it did not."""
        return self._arrived.get((message_id, node))

    def effects(self, message_id: int) -> list[Sending]:
        """The messages that name this one as a cause, in order."""
        return [sending for sending in self._sent.values() if message_id in sending.causes]

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._hosts = dict(zip(map(int, event.variable), map(int, event.host), strict=True))

    def _on_graph_messages(self, event: GraphMessages, now_ns: int) -> None:
        self._turns[event.node].append(Turn(now_ns, event.round, event))

    def _on_sent(self, event: MessageSent, now_ns: int) -> None:
        turn = self._turn_of(event, now_ns)
        sending = Sending(
            message_id=event.message_id,
            sent_ns=now_ns,
            source=event.source,
            destination=event.destination,
            kind=event.kind,
            size_byte=event.size_byte,
            fragments=event.fragments,
            causes=tuple(dict.fromkeys(map(int, event.causes))),
            round=None if turn is None else turn.round,
        )
        self._sent[event.message_id] = sending
        if turn is not None:
            turn.messages.append(sending)

    def _turn_of(self, event: MessageSent, now_ns: int) -> Turn | None:
        """The round under way, if its graph messages are for a variable at the destination; else a turn of its own."""
        if event.kind.startswith(SERVICE_PREFIX):
            return None
        turns = self._turns[event.source]
        for turn in reversed(turns):
            if turn.graph is not None:
                if event.destination in self._hosts_served(turn.graph):
                    return turn
                break
        if not turns or turns[-1].graph is not None or turns[-1].begun_ns != now_ns:
            turns.append(Turn(now_ns, None, None))
        return turns[-1]

    def _hosts_served(self, graph: GraphMessages) -> set[int]:
        served = [
            self._hosts.get(int(to), BROADCAST)
            for to, remote in zip(graph.destination, graph.remote, strict=True)
            if remote
        ]
        return {*served, BROADCAST} if served else set()

    def _on_delivered(self, event: MessageDelivered, now_ns: int) -> None:
        self._arrived.setdefault((event.message_id, event.node), now_ns)


def causal_chain(told: Causes, causes: Iterable[int], reader: int, depth: int, most: int) -> tuple[Cause, ...]:
    """What led to what a node did, as a tree.

    Causes are told once, nearest to the top, of messages that a node sent in a row: they share theirs. Other places refer
    to that one.

    Args:
        told: The messages of the run.
        causes: The messages the node had received.
        reader: The node.
        depth: How many receptions to follow back; at least 1.
        most: How many lines there may be below the first level: what would be more is not followed.
    """
    first = list(dict.fromkeys(causes))
    return _branches(told, first, 0, reader, _homes(told, first, depth, most))


def _homes(told: Causes, first: Sequence[int], depth: int, most: int) -> _Homes:
    """Find, level by level, where causes are told."""
    homes: dict[tuple[int, tuple[int, ...]], tuple[int, int]] = {}
    lines = 0
    level = [(message, 0) for message in first]
    for _ in range(depth - 1):
        below: list[tuple[int, int]] = []
        for message, above in level:
            sending = told.sendings.get(message)
            if sending is None or _shared(sending) in homes or lines + len(sending.causes) > most:
                continue
            homes[_shared(sending)] = message, above
            lines += len(sending.causes)
            below += [(cause, message) for cause in sending.causes]
        level = below
    return homes


def _shared(sending: Sending) -> tuple[int, tuple[int, ...]]:
    """What messages have in common that have the same causes, as received by the same node."""
    return sending.source, sending.causes


def _branches(told: Causes, messages: Iterable[int], above: int, reader: int, homes: _Homes) -> tuple[Cause, ...]:
    return tuple(_branch(told, message, above, reader, homes) for message in messages)


def _branch(told: Causes, message: int, above: int, reader: int, homes: _Homes) -> Cause:
    sending, received_ns = told.sendings.get(message), told.arrived_ns(message, reader)
    if sending is None or not sending.causes:
        return Cause(message, sending, received_ns)
    home = homes.get(_shared(sending))
    if home is None:
        return Cause(message, sending, received_ns, unfollowed=len(sending.causes))
    if home != (message, above):
        return Cause(message, sending, received_ns, told_at=home)
    return Cause(message, sending, received_ns, _branches(told, sending.causes, message, sending.source, homes))


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a node spoke in a turn.

    Attributes:
        turn: The turn.
        silent: In how many rounds before it the node was silent.
        last_spoken: The turn before in which it spoke; None if there was none.
        causes: What it had received, of all its messages of the turn.
    """

    turn: Turn
    silent: int
    last_spoken: Turn | None
    causes: tuple[int, ...]


def reason_of(turns: Sequence[Turn], index: int) -> Reason:
    """Why a node spoke in one of its turns.

    Args:
        turns: Its turns, in order.
        index: Which one.
    """
    before = turns[:index]
    last = next((number for number in reversed(range(index)) if before[number].messages), None)
    silent = before if last is None else before[last + 1 :]
    turn = turns[index]
    causes = dict.fromkeys(cause for sending in turn.messages for cause in sending.causes)
    return Reason(turn, len(silent), None if last is None else before[last], tuple(causes))
