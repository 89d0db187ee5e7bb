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
    """Show how a target is tracked: the belief of where it is, who leads, among whom the next leader was chosen.

    Prints a line for every belief; with --at or --out one for those of the instants shown. The picture has a map of each
    instant, three in all unless --at says which, after Liu, Reich, Zhao 2002, Fig. 8, and the error over time below.
    """
    from netsim.cli.track import track_command

    track_command(trace, out, at, as_json=as_json)
