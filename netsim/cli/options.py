"""Arguments and options that several commands have."""

from pathlib import Path
from typing import Annotated

import typer

Scenario = Annotated[Path, typer.Argument(help="Scenario file (YAML).", show_default=False)]
Trace = Annotated[Path, typer.Argument(help="Trace file (trace.mcap), or the folder of a run.", show_default=False)]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", help="Override a value, as in --set algorithm.tolerance=1. May be repeated."
    ),
]
NoPlugins = Annotated[bool, typer.Option("--no-plugins", help="Refuse algorithms named module:Class: import no code.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show a traceback when something fails.")]
