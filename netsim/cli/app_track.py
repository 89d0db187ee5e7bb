"""The command `netsim track` and its options."""

from pathlib import Path
from typing import Annotated

import typer

from netsim.cli.options import Debug, Trace


def track(
    trace: Trace,
    out: Annotated[
        Path | None,
        typer.Option(help="Write a picture (.png or .svg) into a folder that exists."),
    ] = None,
    at: Annotated[
        list[float] | None,
        typer.Option(help="An instant to show (simulated seconds); may be given several times."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the steps as JSON.")] = False,
    debug: Debug = False,
) -> None:
    """Show how targets are tracked: the beliefs of where they are, who leads, among whom the next leader was chosen.

    Prints a line for every belief; with --at or --out one for those of the instants shown. The picture has a map of each
    instant (some are chosen unless --at says which) and the error over time below. Where one leader holds the belief, it
    is after Liu, Reich, Zhao 2002, Fig. 8; where groups do, after Liu, Chu, Liu, Reich, Zhao 2004, Fig. 6: particles,
    regions of the groups, and for each track a bar of how probable it is to be each target.
    """
    from netsim.cli.track import track_command

    track_command(trace, out, at, as_json=as_json)
