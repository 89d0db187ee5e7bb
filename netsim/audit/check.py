"""One pass over a trace, past every rule."""

import warnings
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from netsim.audit.energy import AirtimeIsBooked, BatteryCloses, LedgerCloses
from netsim.audit.file import Reading, attachments_tally, format_tally, scenario_of
from netsim.audit.frames import AwakeNodes, FrameTimes
from netsim.audit.listeners import EveryListener, Outcomes
from netsim.audit.messages import Messages
from netsim.audit.nodes import KnownNodes, Lives
from netsim.audit.rule import End, Rule, Run
from netsim.audit.tally import Finding, Tally
from netsim.audit.values import Columns, Probabilities, Values
from netsim.errors import TraceError
from netsim.trace.events import Event
from netsim.trace.fingerprint import fingerprint
from netsim.trace.reader import TruncatedTraceWarning, decoded, read_raw, trace_metadata
from netsim.trace.recorder import Handler

RULES: Final[Sequence[Callable[[Run], Rule]]] = (
    lambda _: Columns(),
    lambda _: Values(),
    KnownNodes,
    lambda _: Lives(),
    FrameTimes,
    AwakeNodes,
    Outcomes,
    EveryListener,
    Messages,
    lambda _: LedgerCloses(),
    BatteryCloses,
    AirtimeIsBooked,
    lambda _: Probabilities(),
)
"""What every trace must obey, beside being a whole file; in the order in which it is told."""


@dataclass(frozen=True, slots=True)
class Audit:
    """What the rules say of a trace.

    Attributes:
        path: The trace.
        end: How far it was read.
        tallies: Of every rule, in the order of the rules.
        fingerprint: Of a whole trace; None of one that was cut short or is damaged.
    """

    path: Path
    end: End
    tallies: tuple[Tally, ...]
    fingerprint: str | None

    @property
    def findings(self) -> list[Finding]:
        """All findings, rule by rule; where one has too many to keep, the last says how many more there were."""
        found: list[Finding] = []
        for tally in self.tallies:
            more = tally.wrong - len(tally.findings)
            found += [*tally.findings, *([Finding(tally.rule, f"and {more} more")] if more else [])]
        return found


def check_trace(path: Path | str) -> list[Finding]:
    """What is wrong with a trace; nothing for a good one. See `audit_trace`."""
    return audit_trace(path).findings


def audit_trace(path: Path | str) -> Audit:
    """Hold a trace against every rule, in one pass and in bounded memory (see `netsim.audit.messages`).

    A trace that is cut short or damaged is checked as far as it can be read; that it is, is a finding.

    Raises:
        TraceError: If the file cannot be read, is no trace of netsim, or has another format version.
    """
    file = Path(path)
    run = Run(file.parent, trace_metadata(file), scenario_of(file))
    rules = [make(run) for make in RULES]
    reading = Reading(file)
    _pass(file, reading, rules)
    end = End(reading.last_ns, reading.is_whole)
    for rule in rules:
        rule.conclude(end)
    of_file = (*reading.tallies, format_tally(file), attachments_tally(file, run, is_whole=end.is_whole))
    of_rules = [tally for rule in rules for tally in rule.tallies]
    return Audit(file, end, (*of_file, *of_rules), fingerprint(file) if end.is_whole else None)


def _pass(file: Path, reading: Reading, rules: Sequence[Rule]) -> None:
    handlers: defaultdict[type[Event], list[Handler]] = defaultdict(list)
    for rule in rules:
        for event_type, handler in rule.handlers().items():
            handlers[event_type].append(handler)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", TruncatedTraceWarning)  # it becomes a finding
            for message in read_raw(file):
                reading.take(message)
                if message.event_type is not None:
                    event = decoded(file, message)
                    for handler in handlers[message.event_type]:
                        handler(event, message.time_ns)
    except TraceError as error:
        reading.stop(error)
    except TruncatedTraceWarning:
        reading.cut()
    reading.conclude()
