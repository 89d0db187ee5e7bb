"""`netsim trace`."""

from collections import Counter
from pathlib import Path

from rich import box
from rich.table import Table

from netsim.cli.console import say, show
from netsim.cli.replay import trace_file
from netsim.trace.fingerprint import fingerprint
from netsim.trace.reader import is_complete, read_raw, trace_metadata
from netsim.units import NS_PER_S


def info_command(given: Path) -> None:
    """Describe a trace."""
    trace = trace_file(given, with_events=False)
    counts: Counter[str] = Counter()
    end_ns = 0
    for message in read_raw(trace):
        counts[message.topic] += 1
        end_ns = message.time_ns
    table = Table(box=box.SIMPLE_HEAD, title=str(trace), title_justify="left")
    table.add_column("topic")
    table.add_column("events", justify="right")
    for topic, count in sorted(counts.items()):
        table.add_row(topic, f"{count:,}")
    show(table)
    for key, value in sorted(trace_metadata(trace).items()):
        say(f"{key}: {value}")
    say(f"last event: {end_ns / NS_PER_S:g} s")
    whole = is_complete(trace)
    say(f"complete: {'yes' if whole else 'no, the end is missing'}")
    say(f"fingerprint: {fingerprint(trace) if whole else 'none, for want of the end'}")
