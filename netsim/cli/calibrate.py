"""`netsim calibrate`."""

from pathlib import Path

from rich import box
from rich.table import Table as RichTable

from netsim.calibrate import Calibration, Options, calibrate, medium_yaml, read_log, tables
from netsim.cli.console import say, show, tell
from netsim.errors import ScenarioError
from netsim.models.node_files import read_nodes


def calibrate_command(
    log: Path,
    positions: Path | None,
    out: Path | None,
    plot: Path | None,
    options: Options,
    *,
    force: bool = False,
) -> None:
    """Fit, print tables, write the medium and the picture; an existing medium only if forced."""
    if out is not None and out.exists() and not force:
        message = f"{out}: this file exists; give another name, or --force to overwrite it"
        raise ScenarioError(message)
    nodes = read_nodes(positions) if positions is not None else ()
    found = calibrate(read_log(log), Options(tuple(nodes), options.channel, options.frame_byte, options.tx_power_dbm))
    _print(found)
    text = medium_yaml(found, None if out is None else out.parent)
    if out is None:
        say(text)
    else:
        _write(out, text)
        tell(f"wrote {out}: take it up in a scenario with `extends: {out.name}`")
    if plot is not None:
        from netsim.calibrate.plot import plot_calibration

        plot_calibration(found, plot)
        tell(f"wrote {plot}")


def _print(found: Calibration) -> None:
    for table in tables(found):
        shown = RichTable(title=table.title, box=box.SIMPLE_HEAD, title_justify="left", show_header=bool(table.header))
        for place in range(len(table.rows[0])):
            name = table.header[place] if table.header else ""
            shown.add_column(name, justify="left" if place == 0 else "right")
        for row in table.rows:
            shown.add_row(*row)
        show(shown)
    for note in found.notes:
        tell(f"note: {note}")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        message = f"cannot write {path}: {error.strerror}"
        raise ScenarioError(message) from error
