"""What a rule has looked at and what it found wrong, in bounded memory."""

from dataclasses import dataclass

from netsim.units import NS_PER_S

MOST_KEPT = 20
"""Findings of one rule that are kept; those beyond are counted."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing wrong with a trace.

    Attributes:
        rule: Name of the rule that is broken.
        what: What was expected and what was found.
        time_ns: When; None where it is of no instant.
        node: At which node; None where it is of none.
    """

    rule: str
    what: str
    time_ns: int | None = None
    node: int | None = None

    @property
    def place(self) -> str:
        """The instant and the node, such as `at 1.5 s, node 7`; empty where there is neither."""
        when = [] if self.time_ns is None else [f"at {seconds(self.time_ns)} s"]
        return ", ".join([*when, *([] if self.node is None else [f"node {self.node}"])])

    def __str__(self) -> str:
        """The finding on one line."""
        return ": ".join(part for part in (self.rule, self.place, self.what) if part)


class Tally:
    """How often a rule was applied, and where it was broken.

    Args:
        rule: Its name.
        noun: What it looks at, in the plural, such as `frames`.

    Attributes:
        looked: How many of those it has looked at.
        wrong: How many findings there are.
        findings: The first `MOST_KEPT` of them.
        note: What the reader must know: a tolerance, what was left out and why. Empty for nothing.
    """

    def __init__(self, rule: str, noun: str, note: str = "") -> None:
        self.rule = rule
        self.noun = noun
        self.note = note
        self.looked = 0
        self.wrong = 0
        self.findings: list[Finding] = []

    def found(self, what: str, time_ns: int | None = None, node: int | None = None) -> None:
        """Something is wrong."""
        self.wrong += 1
        if len(self.findings) < MOST_KEPT:
            self.findings.append(Finding(self.rule, what, time_ns, node))


def seconds(time_ns: int) -> str:
    """Nanoseconds as seconds, every digit kept and no more: `12.0005`."""
    whole, rest = divmod(time_ns, NS_PER_S)
    return f"{whole}.{rest:09d}".rstrip("0").rstrip(".")
