"""Which part of a trace is exported: a time window, message kinds, nodes."""

from collections.abc import Collection, Iterator, Set
from dataclasses import dataclass

from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    Event,
    FieldInfo,
    Frame,
    LinkTable,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeTable,
    Problem,
    VariablePlacement,
)

_RECEIVED = OUTCOME_CODE["received"]
TOLD_AT_START: tuple[type[Event], ...] = (NodeTable, LinkTable, FieldInfo, Problem, VariablePlacement)
"""What is told at time 0 and needed to understand the rest: exported whatever the window is."""


@dataclass(frozen=True, kw_only=True)
class Selection:
    """What to export.

    Attributes:
        start_ns: What was recorded from here on; a frame is recorded at its end.
        end_ns: What was recorded before this instant; None for all up to the end.
        kinds: Frames and messages of these message kinds only; None for all.
        nodes: What these nodes did and what befell them only, and frames and messages from and to them, with the
            broadcasts that they received; None for all.
    """

    start_ns: int = 0
    end_ns: int | None = None
    kinds: Collection[str] | None = None
    nodes: Set[int] | None = None

    def has_frame(self, frame: Frame) -> bool:
        """Whether a frame is to be exported."""
        if self.kinds is not None and frame.kind not in self.kinds:
            return False
        return self.nodes is None or not self.nodes.isdisjoint(_ends(frame))

    def has_message(self, event: MessageSent | MessageDelivered | MessageDropped) -> bool:
        """Whether what befell a message is to be exported."""
        if self.kinds is not None and event.kind not in self.kinds:
            return False
        ends = (event.source, event.node if isinstance(event, MessageDelivered) else event.destination)
        return self.nodes is None or any(end in self.nodes for end in ends)

    def has_node(self, node: int) -> bool:
        """Whether what a node did is to be exported."""
        return self.nodes is None or node in self.nodes


def _ends(frame: Frame) -> Iterator[int]:
    """The sender of a frame and those it was for: of a broadcast those who received it."""
    yield frame.source
    if frame.destination != BROADCAST:
        yield frame.destination
        return
    for node, outcome in zip(frame.rx_node, frame.rx_outcome, strict=True):
        if outcome == _RECEIVED:
            yield int(node)
