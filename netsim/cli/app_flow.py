"""The command `netsim flow` and its options."""

from pathlib import Path
from typing import Annotated

import typer

from netsim.cli.options import Debug, Trace


def flow(
    trace: Trace,
    out: Annotated[
        Path | None, typer.Option(help="Write a picture (.png or .svg): one panel a round, at most 24 of them.")
    ] = None,
    rounds: Annotated[
        str | None,
        typer.Option(
            help="Rounds to show, such as 0-8 or 0,2,5-7; by default all up to the last in which something was sent; in the "
            "picture the first 12 of them in which that was something, and not what the round before sent."
        ),
    ] = None,
    columns: Annotated[int, typer.Option(help="Panels side by side in the picture.", min=1, max=8)] = 4,
    as_json: Annotated[bool, typer.Option("--json", help="Print the rounds as JSON.")] = False,
    debug: Debug = False,
) -> None:
    """Show the information flow of message passing: who sends in which round, who falls silent, who wakes whom.

    A vertex of the graphical model wakes when it sends again after a round or more of silence. Round 0 are the start
    messages. The picture has the graph with each round's messages as arrows, and crosses on vertices whose node is down.
    Tree-reweighted max-product has no rounds that all nodes share: its spanning trees are shown, and what each component of
    the model proved.
    """
    from netsim.cli.flow import flow_command

    flow_command(trace, out, rounds, columns, as_json=as_json)
