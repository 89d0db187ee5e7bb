"""`netsim inspect --timeline`."""

from pathlib import Path

from rich import box
from rich.table import Table

from netsim.cli.console import say, show
from netsim.cli.names import follow, instant, labels, one_node
from netsim.errors import ScenarioError
from netsim.metrics.timeline import TimeLine, Window


def timeline_command(trace: Path, given: str, window: Window) -> None:
    """The time line of a node."""
    if window.end_ns is not None and window.end_ns <= window.start_ns:
        message = f"--end: expected a time after --start ({instant(window.start_ns)} s), got {instant(window.end_ns)} s"
        raise ScenarioError(message)
    label = labels(trace)
    node = one_node(trace, "--timeline", given)
    line = TimeLine(node, label, window)
    follow(trace, line, window.end_ns)
    table = Table(box=box.SIMPLE_HEAD, title=f"Time line of {label(node)}", title_justify="left")
    table.add_column("s", justify="right", no_wrap=True)
    table.add_column("what", no_wrap=True)
    table.add_column("details")
    for entry in line.entries:
        table.add_row(instant(entry.time_ns), entry.what, entry.text)
    show(table)
    if line.left_out:
        say(
            f"and {line.left_out:,} more from {instant(line.entries[-1].time_ns)} s on: see --top, --start, --end, --kinds"
        )
    elif not line.entries:
        say("nothing of it in the time asked for")
