"""The story of one message: its frames on the air, and where it was delivered or given up."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from netsim.trace.events import Frame, MessageDelivered, MessageDropped
from netsim.trace.recorder import Handler


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that befell a message.

    Attributes:
        time_ns: When it was recorded; of a frame, its end.
        event: What it was.
    """

    time_ns: int
    event: Frame | MessageDelivered | MessageDropped


class Story:
    """Collects what became of one message; a reducer over the events of a run.

    Args:
        message_id: The message.
    """

    def __init__(self, message_id: int) -> None:
        self._message_id = message_id
        self._happenings: list[Happening] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Frame: self._take, MessageDelivered: self._take, MessageDropped: self._take}

    @property
    def happenings(self) -> list[Happening]:
        """What became of it, in order; acknowledgements and wake-up frames are among the frames."""
        return self._happenings

    def _take(self, event: Frame | MessageDelivered | MessageDropped, now_ns: int) -> None:
        if event.message_id == self._message_id:
            self._happenings.append(Happening(now_ns, event))
