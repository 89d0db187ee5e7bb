"""The report of a study: Markdown, one HTML page that needs nothing else, plots as PNG and SVG.

The same results give the same bytes.
"""

from pathlib import Path

from netsim.errors import TraceError
from netsim.scenario.folder import write_file
from netsim.study.info import STUDY_FILE
from netsim.study.plots.draw import draw
from netsim.study.plots.style import Plot, render
from netsim.study.reporting.blocks import Picture
from netsim.study.reporting.render import html_of, markdown_of
from netsim.study.reporting.sections import page_of
from netsim.study.reporting.view import View, view_of
from netsim.study.results import load_study

REPORT_FILE, PAGE_FILE = "report.md", "report.html"
PLOTS = "plots"
"""Subfolder with the plots."""
SUMMARY_FILE, DIFFERENCES_FILE = "summary.csv", "differences.csv"


def write_report(folder: Path) -> Path:
    """Write the report of a study into its folder, in place of an earlier one.

    Writes `report.md`, `report.html`, `plots/*.png` and `plots/*.svg`, `summary.csv` (means and intervals of what is shown)
    and, where there is an axis to compare along, `differences.csv` (paired differences).

    Args:
        folder: What `netsim study` wrote.

    Returns:
        Where the HTML page lies.

    Raises:
        ScenarioError: If it holds no results.
        TraceError: If a file cannot be written.
    """
    view = view_of(load_study(folder))
    plots = draw(view)
    pages = {topic: [Picture(plot.stem, plot.caption, plot.alt) for plot in found] for topic, found in plots.items()}
    path = folder / STUDY_FILE
    page = page_of(view, pages, path.read_text(encoding="utf-8") if path.is_file() else "")
    shown = _save([plot for found in plots.values() for plot in found], folder / PLOTS)
    _write_tables(view, folder)
    write_file(folder / REPORT_FILE, markdown_of(page))
    write_file(folder / PAGE_FILE, html_of(page, shown))
    return folder / PAGE_FILE


def _save(plots: list[Plot], folder: Path) -> dict[str, bytes]:
    """Write the plots, remove those of an earlier report, and give them as SVG by stem."""
    made = {plot.stem: {kind: render(plot.figure, kind) for kind in ("png", "svg")} for plot in plots}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in (*folder.glob("*.png"), *folder.glob("*.svg")):
            old.unlink()
        for stem, contents in made.items():
            for kind, content in contents.items():
                (folder / f"{stem}.{kind}").write_bytes(content)
    except OSError as error:
        message = f"cannot write {folder}: {error.strerror or error}"
        raise TraceError(message) from error
    return {stem: contents["svg"] for stem, contents in made.items()}


def _write_tables(view: View, folder: Path) -> None:
    write_file(folder / SUMMARY_FILE, view.summary.to_csv(index=False))
    if view.differences is not None:
        write_file(folder / DIFFERENCES_FILE, view.differences.to_csv(index=False))
