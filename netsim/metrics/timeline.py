"""The time line of one node: what it did and what befell it, a line each, in the order in which it happened."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from netsim.metrics.tracking_wording import belief_words, handoff_words
from netsim.metrics.traffic import outcome_at, role_of
from netsim.metrics.wording import SHOWN_ENTRIES, counted, fields, listed, words
from netsim.trace.events import (
    BROADCAST,
    RADIO_STATES,
    AlgorithmRecord,
    Association,
    Belief,
    EnergyBudget,
    Estimate,
    Event,
    Fault,
    Frame,
    GraphMessages,
    Handoff,
    Identity,
    Log,
    Marginals,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    Particles,
    RadioState,
    Role,
    RouteChange,
    VariablePlacement,
)
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_MS


@dataclass(frozen=True, slots=True)
class Entry:
    """One line.

    Attributes:
        time_ns: When it happened.
        what: Sort of event, one word.
        text: The details.
    """

    time_ns: int
    what: str
    text: str


@dataclass(frozen=True, kw_only=True)
class Window:
    """What of a node's doings to tell.

    Attributes:
        start_ns: From here on.
        end_ns: Before this; None for up to the end.
        kinds: Messages and frames of these kinds only; None for all.
        frames: Whether to tell frames too.
        most: How many lines; those after them are only counted.
    """

    start_ns: int = 0
    end_ns: int | None = None
    kinds: Collection[str] | None = None
    frames: bool = False
    most: int = 100


class TimeLine:
    """Puts together the time line of a node; a reducer over the events of a run.

    Args:
        node: The node.
        label: Name of a node.
        window: What to tell.
    """

    def __init__(self, node: int, label: Callable[[int], str], window: Window) -> None:
        self._node = node
        self._label = label
        self._window = window
        self._variables: dict[int, str] = {}
        self._decided: list[int] | None = None
        self._entries: list[Entry] = []
        self._left_out = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        handlers: dict[type[Any], Handler] = {
            VariablePlacement: self._on_placement,
            MessageSent: self._on_sent,
            MessageDelivered: self._on_delivered,
            MessageDropped: self._on_dropped,
            NodeLife: self._on_life,
            RadioState: self._on_radio,
            EnergyBudget: self._on_budget,
            Fault: self._on_fault,
            RouteChange: self._on_route,
            Role: self._on_role,
            GraphMessages: self._on_graph_messages,
            Association: self._on_association,
            Marginals: self._on_marginals,
            Estimate: self._on_estimate,
            Identity: self._on_identity,
            Particles: self._on_particles,
            Belief: self._on_belief,
            Handoff: self._on_handoff,
            AlgorithmRecord: self._on_algorithm,
            Log: self._on_log,
        }
        return handlers | ({Frame: self._on_frame} if self._window.frames else {})

    @property
    def entries(self) -> list[Entry]:
        """The lines, in order."""
        return self._entries

    @property
    def left_out(self) -> int:
        """How many lines would follow."""
        return self._left_out

    def _add(self, time_ns: int, what: str, text: str) -> None:
        end_ns = self._window.end_ns
        if time_ns < self._window.start_ns or (end_ns is not None and time_ns >= end_ns):
            return
        if len(self._entries) < self._window.most:
            self._entries.append(Entry(time_ns, what, text))
        else:
            self._left_out += 1

    def _is_of_kind(self, kind: str) -> bool:
        return self._window.kinds is None or kind in self._window.kinds

    def _name(self, node: int) -> str:
        return "all" if node == BROADCAST else self._label(node)

    def _message(self, kind: str, message_id: int) -> str:
        return f"{kind} #{message_id}" if message_id else f"{kind or 'something'} of no message"

    def _on_placement(self, event: VariablePlacement, _: int) -> None:
        self._variables = dict(zip(map(int, event.variable), event.name, strict=True))

    def _on_sent(self, event: MessageSent, now_ns: int) -> None:
        if event.source != self._node or not self._is_of_kind(event.kind):
            return
        parts = f" in {event.fragments} fragments" if event.fragments > 1 else ""
        causes = ", ".join(f"#{cause}" for cause in list(event.causes)[:SHOWN_ENTRIES])
        more = f" and {len(event.causes) - SHOWN_ENTRIES} more" if len(event.causes) > SHOWN_ENTRIES else ""
        after = f", after {causes}{more}" if causes else ""
        head = f"{self._message(event.kind, event.message_id)} to {self._name(event.destination)}"
        self._add(now_ns, "sends", f"{head}: {event.size_byte} byte{parts}{after}")

    def _on_delivered(self, event: MessageDelivered, now_ns: int) -> None:
        if not self._is_of_kind(event.kind):
            return
        cost = f"{event.latency_ns / NS_PER_MS:.4g} ms, {counted(event.hops, 'hop')}"
        message = self._message(event.kind, event.message_id)
        if event.node == self._node:
            self._add(now_ns, "receives", f"{message} from {self._name(event.source)}: {event.size_byte} byte, {cost}")
        elif event.source == self._node:
            self._add(now_ns, "delivered", f"{message} reached {self._name(event.node)}: {cost}")

    def _on_dropped(self, event: MessageDropped, now_ns: int) -> None:
        if self._node not in (event.node, event.source) or not self._is_of_kind(event.kind):
            return
        way = f"from {self._name(event.source)} to {self._name(event.destination)}"
        where = "" if event.node == self._node else f" at {self._name(event.node)}"
        text = f"{self._message(event.kind, event.message_id)} {way}{where}: {words(event.reason)}"
        self._add(now_ns, "dropped", text)

    def _on_frame(self, event: Frame, now_ns: int) -> None:
        if not self._is_of_kind(event.kind):
            return
        role = role_of(event)
        frame = f"{role} frame of {self._message(event.kind, event.message_id)}"
        way = f"{self._name(event.source)} to {self._name(event.destination)}"
        if event.source == self._node:
            attempt = f", attempt {event.attempt + 1}" if event.attempt else ""
            outcome = "" if event.destination == BROADCAST else f": {words(outcome_at(event, event.destination))}"
            self._add(now_ns, "transmits", f"{frame}, {way}, {event.size_byte} byte{attempt}{outcome}")
        elif (outcome := outcome_at(event, self._node)) != "out_of_reach":
            self._add(now_ns, "hears", f"{frame}, {way}: {words(outcome)}")

    def _on_life(self, event: NodeLife, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "life", event.event + (f": {event.reason}" if event.reason else ""))

    def _on_radio(self, event: RadioState, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "radio", RADIO_STATES[event.state])

    def _on_budget(self, event: EnergyBudget, now_ns: int) -> None:
        if event.node != self._node:
            return
        whose = f" of {event.task}" if event.task else ""
        limit = f" of {event.allowance_j:.4g}" if math.isfinite(event.allowance_j) else ""
        action = f" ({event.action})" if event.action else ""
        self._add(now_ns, "budget", f"allowance{whose} {event.event}{action}: {event.spent_j:.4g}{limit} J spent")

    def _on_fault(self, event: Fault, now_ns: int) -> None:
        if self._node in map(int, event.node):
            detail = f": {event.detail}" if event.detail else ""
            self._add(now_ns, "fault", f"rule {event.rule} ({event.kind}) {event.event}{detail}")

    def _on_route(self, event: RouteChange, now_ns: int) -> None:
        if event.node != self._node:
            return
        to = "a sink" if event.destination == BROADCAST else self._label(event.destination)
        if event.next_hop == BROADCAST:
            self._add(now_ns, "route", f"none to {to} any more")
        else:
            self._add(now_ns, "route", f"to {to} by {self._label(event.next_hop)}, cost {event.cost:.4g}")

    def _on_role(self, event: Role, now_ns: int) -> None:
        if event.node == self._node:
            role = event.role.replace("leader ", "leader of track ")
            self._add(now_ns, "role", f"{'becomes' if event.holds else 'is no longer'} {role}")

    def _on_graph_messages(self, event: GraphMessages, now_ns: int) -> None:
        if event.node != self._node:
            return
        sent = len(event.source)
        told = f"sends {sent} of {counted(event.computed, 'graph message')}" if sent else "sends no graph message"
        air = f", {int(sum(event.remote))} over the air" if sent else f" of {event.computed} computed"
        late = f", begun {event.late_ns / NS_PER_MS:.4g} ms late" if event.late_ns > 0 else ""
        text = f"{event.round} {told}{air}, largest change {event.largest_change:.4g}{late}"
        self._add(now_ns, "round", text)

    def _on_association(self, event: Association, now_ns: int) -> None:
        if event.node != self._node:
            return
        decided = list(map(int, event.target))
        told = listed("none" if target < 0 else str(target) for target in decided) or "none, without a measurement"
        same = ", as before" if decided == self._decided else ""
        self._decided = decided
        self._add(now_ns, "decides", f"targets {told}{same} (after round {event.round})")

    def _on_marginals(self, event: Marginals, now_ns: int) -> None:
        if event.node != self._node:
            return
        name = self._variables.get(event.variable) or str(event.variable)
        numbers = listed(f"{value:.4g}" for value in event.probability)
        which = "max-marginal" if event.is_max else "marginal"
        self._add(now_ns, "believes", f"{which} of {name}: {numbers} (after round {event.round})")

    def _on_estimate(self, event: Estimate, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "estimates", f"track {event.target} at ({event.x_m:.4g}, {event.y_m:.4g}) m")

    def _on_identity(self, event: Identity, now_ns: int) -> None:
        if event.node == self._node:
            chances = listed(f"target {number} ({value:.4g})" for number, value in enumerate(event.probability))
            self._add(now_ns, "believes", f"track {event.track} follows {chances}")

    def _on_particles(self, event: Particles, now_ns: int) -> None:
        if event.node == self._node:
            tracks = listed(str(track) for track in event.target)
            self._add(now_ns, "believes", f"{counted(len(event.weight), 'particle')} of track {tracks}")

    def _on_belief(self, event: Belief, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "believes", belief_words(event))

    def _on_handoff(self, event: Handoff, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "chooses", handoff_words(event, self._label))

    def _on_algorithm(self, event: AlgorithmRecord, now_ns: int) -> None:
        if event.node == self._node:
            self._add(now_ns, "notes", f"{event.kind}: {fields(event.fields_json)}")

    def _on_log(self, event: Log, now_ns: int) -> None:
        if event.name == f"node {self._node}":
            self._add(now_ns, "logs", event.message)


def event_words(event: Event, label: Callable[[int], str]) -> str:
    """An event in words, as in the time line of the node it is about; of events about no single node, the topic."""
    node = getattr(event, "source", None) if isinstance(event, Frame | MessageSent) else getattr(event, "node", None)
    if not isinstance(node, int):
        return event.topic
    line = TimeLine(node, label, Window(frames=True))
    handler = line.handlers().get(type(event))
    if handler is None:
        return f"{event.topic} of {label(node)}"
    handler(event, 0)
    return " ".join(f"{label(node)} {entry.what} {entry.text}" for entry in line.entries) or event.topic
