"""The command `netsim export` and its options."""

from pathlib import Path
from typing import Annotated

import typer

from netsim.cli.options import Debug, Trace

_OUTPUTS = "Outputs"
_PART = "Which part"
_MOVIE = "Movies (--gif, --mp4)"


def export(
    trace: Trace,
    pcap: Annotated[
        Path | None,
        typer.Option(
            metavar="F.pcap",
            help="Capture for Wireshark: every frame as IEEE 802.15.4 with its received power.",
            rich_help_panel=_OUTPUTS,
        ),
    ] = None,
    pcap_node: Annotated[
        str | None,
        typer.Option(
            metavar="NODE",
            help="Capture at this node (id or name): what it sent or decoded, with the power it received.",
            show_default="a sniffer that hears every frame once",
            rich_help_panel=_OUTPUTS,
        ),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Tables as CSV: frames, receptions, messages, energy, ...", rich_help_panel=_OUTPUTS
        ),
    ] = None,
    parquet: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="The same tables as Parquet: smaller, with types and meanings.",
            rich_help_panel=_OUTPUTS,
        ),
    ] = None,
    foxglove: Annotated[
        Path | None,
        typer.Option(
            metavar="F.mcap",
            help="Scene for Foxglove or Lichtblick: map, messages, beliefs, log, figures; needs the extra `foxglove`.",
            rich_help_panel=_OUTPUTS,
        ),
    ] = None,
    gif: Annotated[
        Path | None,
        typer.Option(metavar="F.gif", help="Animated map for a talk.", rich_help_panel=_OUTPUTS),
    ] = None,
    mp4: Annotated[
        Path | None,
        typer.Option(
            metavar="F.mp4",
            help="The same as a film, larger and smoother; needs the extra `movie`.",
            rich_help_panel=_OUTPUTS,
        ),
    ] = None,
    start: Annotated[
        float, typer.Option(help="Export from here (simulated seconds).", min=0, rich_help_panel=_PART)
    ] = 0.0,
    end: Annotated[
        float | None, typer.Option(help="Export what is before this (simulated seconds).", rich_help_panel=_PART)
    ] = None,
    kinds: Annotated[
        str | None,
        typer.Option(help="Only frames and messages of these kinds, separated by commas.", rich_help_panel=_PART),
    ] = None,
    nodes: Annotated[
        str | None,
        typer.Option(
            help="Only these nodes (ids or names, separated by commas) and their traffic.", rich_help_panel=_PART
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Simulated seconds a second of the movie.",
            show_default="as the replay, but at most 20 s of movie",
            rich_help_panel=_MOVIE,
        ),
    ] = None,
    hold: Annotated[
        float | None,
        typer.Option(
            help="How long an arrow takes, in simulated seconds.",
            show_default="0.4 s of the movie",
            rich_help_panel=_MOVIE,
        ),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Length of the movie, instead of --speed.", rich_help_panel=_MOVIE)
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(help="Pictures a second.", show_default="GIF: 12, MP4: 25", rich_help_panel=_MOVIE),
    ] = None,
    width: Annotated[
        int | None,
        typer.Option(
            help="Width in pixels; the height follows.", show_default="GIF: 800, MP4: 1280", rich_help_panel=_MOVIE
        ),
    ] = None,
    light: Annotated[bool, typer.Option("--light", help="Dark on white.", rich_help_panel=_MOVIE)] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace earlier exports of these names.")] = False,
    debug: Debug = False,
) -> None:
    """Export a run for other programs: several outputs in one call, if you like.

    netsim export runs/quickstart --pcap q.pcap --csv tables

    netsim export runs/quickstart --foxglove q.mcap --start 2 --end 8 --nodes n04

    An output appears under its name when it is whole; what exists is replaced only with --force.

    Of a trace that was cut short the part that is there is exported, after a warning.

    What each output holds, and how to open it: docs/export.md.
    """
    from netsim.cli.export import Wanted, export_command
    from netsim.cli.movie import Movies
    from netsim.movie import MovieOptions

    outputs = {"pcap": pcap, "csv": csv, "parquet": parquet, "foxglove": foxglove}
    wanted = Wanted(start, end, kinds, nodes, pcap_node)
    movies = Movies(gif, mp4, speed, hold, MovieOptions(width_px=width, fps=fps, seconds=seconds, light=light))
    export_command(trace, outputs, wanted, movies, force=force)
