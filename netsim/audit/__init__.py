"""Whether a trace obeys the laws of a run: `check_trace` says what is wrong, `audit_trace` what was looked at besides."""

from netsim.audit.check import Audit, audit_trace, check_trace
from netsim.audit.rule import End, Rule, Run
from netsim.audit.tally import Finding, Tally

__all__ = ["Audit", "End", "Finding", "Rule", "Run", "Tally", "audit_trace", "check_trace"]
