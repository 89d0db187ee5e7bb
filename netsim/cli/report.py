"""`netsim report`."""

import webbrowser
from pathlib import Path

from netsim.cli.console import say, tell


def report_command(folder: Path, *, open_page: bool) -> None:
    """Write the report of a study, its tables first, and say where it lies."""
    from netsim.study.report import PLOTS, REPORT_FILE, write_report
    from netsim.study.tabulate import refresh_tables

    refresh_tables(folder)
    page = write_report(folder)
    say(f"Report: {page}")
    say(f"The same as Markdown: {folder / REPORT_FILE}; plots as PNG and SVG: {folder / PLOTS}")
    if open_page and not webbrowser.open(page.resolve().as_uri()):
        tell(f"no browser to open: look at {page} yourself")
