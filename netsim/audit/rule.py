"""What a rule is, and what it may know of the run before it looks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from netsim.audit.tally import Tally
from netsim.trace.events import Event
from netsim.trace.recorder import Handler
from netsim.units import s_to_ns


@dataclass(frozen=True, slots=True)
class Run:
    """A trace's own account of its run.

    Attributes:
        folder: Where the trace lies: relative names in the scenario start there.
        metadata: Its record `netsim.run`.
        scenario: The scenario it carries, as plain values; empty where there is none that can be read.
    """

    folder: Path
    metadata: Mapping[str, str]
    scenario: Mapping[str, Any]

    @property
    def detail(self) -> str:
        """`summary`, `frames` or `full`; `frames` where the trace does not say."""
        return self.metadata.get("detail", "frames")

    @property
    def medium(self) -> Mapping[str, Any]:
        """The scenario's section `medium`."""
        medium = self.scenario.get("medium")
        return medium if isinstance(medium, dict) else {}

    @property
    def delay_ns(self) -> int:
        """How long after its end a frame is recorded: the delay of the ideal medium, 0 on others."""
        delay_s = self.medium.get("delay_s", 0.0)
        return s_to_ns(delay_s) if isinstance(delay_s, int | float) else 0

    @property
    def has_jammers(self) -> bool:
        """Whether a fault rule is a jammer."""
        return any(rule.get("type") == "jammer" for rule in self._faults)

    @property
    def _faults(self) -> list[dict[str, Any]]:
        faults = self.scenario.get("faults")
        return [rule for rule in faults if isinstance(rule, dict)] if isinstance(faults, list) else []

    @property
    def garbles(self) -> bool:
        """Whether a fault rule lets corrupted frames pass the checksum.

        Their wrong bytes may name nodes and messages that there are not, or others than were meant.
        """
        return any(rule.get("undetected_share", 0.0) > 0.0 for rule in self._faults)


@dataclass(frozen=True, slots=True)
class End:
    """How far the trace was read.

    Attributes:
        time_ns: The last event.
        is_whole: Whether that was its end, not where it was cut short or damaged.
    """

    time_ns: int
    is_whole: bool


class Rule(Protocol):
    """One law of a trace, or a few that need the same memory: an observer of its events with a tally a law."""

    @property
    def tallies(self) -> Sequence[Tally]:
        """What it has found so far."""
        ...

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What to call for each kind of event it looks at."""
        ...

    def conclude(self, end: End) -> None:
        """The last event has been seen."""
        ...


GARBLED = "not checked of deliveries and drops: a fault rule lets corrupted frames pass, which may name anything"
"""The note of a rule that says less where `Run.garbles`."""
