"""`netsim inspect --sequence`."""

from pathlib import Path

from netsim.cli.console import say
from netsim.sequence import Asked, write_chart
from netsim.sequence.chart import summary


def sequence_command(trace: Path, out: Path, asked: Asked, *, force: bool) -> None:
    """Write the sequence chart of a window."""
    shown = write_chart(trace, out, asked, force=force)
    say(summary(shown))
    hint = "open it in a browser" if out.suffix.lower() == ".html" else "point at an arrow in a browser for its details"
    say(f"wrote {out}; {hint}")
