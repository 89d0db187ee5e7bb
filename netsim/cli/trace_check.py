"""`netsim trace check`."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import typer

from netsim.audit import Audit, Tally, audit_trace
from netsim.cli import EXIT_BAD_INPUT, EXIT_FAILURE
from netsim.cli.console import counted, say, tell
from netsim.cli.replay import trace_file
from netsim.errors import NetsimError


def trace_check_command(given: Sequence[Path]) -> None:
    """Check each trace; exit status 1 if a rule is broken, 2 if a file cannot be read at all."""
    results = [_check(each) for each in given]
    if None in results:
        raise typer.Exit(EXIT_BAD_INPUT)
    if any(results):
        raise typer.Exit(EXIT_FAILURE)


def _check(given: Path) -> int | None:
    """Check one trace and say what came out; the number of broken rules, None where it cannot be read."""
    try:
        audit = audit_trace(trace_file(given, with_events=False))
    except NetsimError as error:
        tell(f"error: {error}")
        return None
    for line in report(audit):
        say(line)
    return sum(tally.wrong > 0 for tally in audit.tallies)


def report(audit: Audit) -> Iterator[str]:
    """The lines about a trace: one a rule, and one a finding."""
    width = max(len(tally.rule) for tally in audit.tallies)
    yield str(audit.path)
    for tally in audit.tallies:
        yield from _lines(tally, width)
    broken = sum(tally.wrong > 0 for tally in audit.tallies)
    held = sum(tally.looked > 0 and not tally.wrong for tally in audit.tallies)
    yield f"  fingerprint: {audit.fingerprint or 'none, for want of the end'}"
    if broken:
        yield f"  {counted(broken, 'rule')} of {len(audit.tallies)} broken"
    else:
        yield f"  ok: {counted(held, 'rule')} hold"


def _lines(tally: Tally, width: int) -> Iterator[str]:
    verdict = "broken" if tally.wrong else ("ok" if tally.looked else "-")
    wrong = f", {tally.wrong:,} wrong" if tally.wrong else ""
    note = f" ({tally.note})" if tally.note else ""
    yield f"  {verdict:<6}  {tally.rule:<{width}}  {tally.looked:,} {tally.noun}{wrong}{note}"
    for finding in tally.findings:
        yield f"            {': '.join(part for part in (finding.place, finding.what) if part)}"
    if tally.wrong > len(tally.findings):
        yield f"            and {tally.wrong - len(tally.findings):,} more"
