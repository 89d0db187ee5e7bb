"""What is to be exported, and what writes it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from netsim.export.selection import Selection
from netsim.trace.events import Event
from netsim.trace.recorder import Handler


class ExportWarning(UserWarning):
    """Something in an export is not what one may take it for."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """What to export.

    Attributes:
        trace: The trace.
        selection: Which part of it.
        pcap_node: Capture only what this node sent or decoded; None for a sniffer that hears every frame.
    """

    trace: Path
    selection: Selection = field(default_factory=Selection)
    pcap_node: int | None = None


class Sink(Protocol):
    """Writes one output from the events of a trace, given in their order. Any of it may raise `OSError`."""

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What to call for each kind of event it reads."""
        ...

    def close(self) -> None:
        """The trace has ended: write what is left and close the files."""
        ...

    def abort(self) -> None:
        """Something failed: close the files as they are."""
        ...
