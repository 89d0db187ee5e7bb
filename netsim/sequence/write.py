"""From a trace to a file with its sequence chart."""

from pathlib import Path

from netsim.errors import ScenarioError
from netsim.files import whole_file
from netsim.sequence.chart import svg_of
from netsim.sequence.gather import Asked, gather
from netsim.sequence.plan import Plan, plan
from netsim.sequence.scale import TIMES

ENDINGS = (".svg", ".html")


def write_chart(trace: Path, out: Path, asked: Asked, *, force: bool = False) -> Plan:
    """Draw the chart of a window of a trace.

    Args:
        trace: The trace.
        out: Where to write it: `.svg` for a picture, `.html` for a page to explore.
        asked: What to show.
        force: Whether a file that exists is replaced.

    Returns:
        The layout, which says what is shown.

    Raises:
        ScenarioError: If the file's name ends otherwise, its folder is missing, it exists, or the window holds nothing or
            too much.
        TraceError: If the trace cannot be read.
        NetsimError: If the file cannot be written.
    """
    _check(out, asked, force)
    layout = plan(gather(trace, asked), asked.time)
    if out.suffix.lower() == ".svg":
        text = svg_of(layout)
    else:
        from netsim.sequence.page import html_of

        text = html_of(layout)
    with whole_file(out, "the chart") as part:
        part.write_text(text, encoding="utf-8")
    return layout


def _check(out: Path, asked: Asked, force: bool) -> None:
    if out.suffix.lower() not in ENDINGS:
        message = f"--sequence {out}: expected a name that ends in .svg (a picture) or .html (a page to explore)"
        raise ScenarioError(message)
    if not out.parent.is_dir():
        message = f"--sequence {out}: expected a folder that exists, got {out.parent}; make it, or name another"
        raise ScenarioError(message)
    if out.exists() and not force:
        message = f"--sequence {out}: this file exists; give another name, or --force to overwrite it"
        raise ScenarioError(message)
    if asked.time not in TIMES:
        message = f"--time: expected {', '.join(TIMES)}, got {asked.time}"
        raise ScenarioError(message)
