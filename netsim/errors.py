"""The errors netsim raises on purpose. Anything else is a defect."""

from collections.abc import Sequence
from dataclasses import dataclass


class NetsimError(Exception):
    """Base of every error that netsim raises on purpose; its text is fit for a user."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing wrong with an input file: where, what was expected, what was found, what to do.

    Without `got`, `expected` is a whole sentence.
    """

    file: str
    line: int
    path: str
    expected: str
    got: str
    remedy: str = ""

    def __str__(self) -> str:
        """The finding on one line: `file:line: path: expected ..., got ...; remedy`."""
        place = f"{self.file}:{self.line}: {self.path}" if self.path else f"{self.file}:{self.line}"
        remedy = f"; {self.remedy}" if self.remedy else ""
        what = f"expected {self.expected}, got {self.got}" if self.got else self.expected
        return f"{place}: {what}{remedy}"


class ScenarioError(NetsimError):
    """An input that cannot be run. Carries every finding, not only the first."""

    def __init__(self, findings: Sequence[Finding] | str) -> None:
        self.findings: tuple[Finding, ...] = () if isinstance(findings, str) else tuple(findings)
        super().__init__(findings if isinstance(findings, str) else "\n".join(map(str, findings)))


class TraceError(NetsimError):
    """A trace that cannot be read or written."""


class InvariantError(NetsimError):
    """The simulation broke one of its own laws: a defect of netsim, with the place and instant."""


class AlgorithmError(NetsimError):
    """An algorithm misused its node handle or raised."""
