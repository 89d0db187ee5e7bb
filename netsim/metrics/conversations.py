"""Who talked to whom: data frames by sender and addressee, with what became of them there."""

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from netsim.metrics.traffic import DATA_ROLES, outcome_at_addressee, role_of
from netsim.trace.events import BROADCAST, Frame
from netsim.trace.recorder import Handler


@dataclass(slots=True)
class Conversation:
    """The data frames from one node to another, or from one to all.

    Attributes:
        frames: How many, retries included.
        retries: How many of them were sent again.
        frame_byte: Bytes in them (PSDU).
        outcomes: What became of them at the addressee; of broadcasts nothing is said.
    """

    frames: int = 0
    retries: int = 0
    frame_byte: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)


class Conversations:
    """Adds up the frames of each pair of nodes; a reducer over the events of a run."""

    def __init__(self) -> None:
        self._found: defaultdict[tuple[int, int], Conversation] = defaultdict(Conversation)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Frame: self._on_frame}

    @property
    def found(self) -> Mapping[tuple[int, int], Conversation]:
        """By sender and addressee (`BROADCAST` for all)."""
        return self._found

    def _on_frame(self, event: Frame, _: int) -> None:
        if role_of(event) not in DATA_ROLES:
            return
        conversation = self._found[event.source, event.destination]
        conversation.frames += 1
        conversation.retries += event.attempt > 0
        conversation.frame_byte += event.size_byte
        if event.destination != BROADCAST:
            conversation.outcomes[outcome_at_addressee(event)] += 1
