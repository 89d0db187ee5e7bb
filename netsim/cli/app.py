"""The commands and their options, in the order in which `netsim --help` shows them; those of studies are in `app_study`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from netsim import __version__
from netsim.cli.app_export import export
from netsim.cli.app_flow import flow
from netsim.cli.app_study import compare, report, study
from netsim.cli.app_track import track
from netsim.cli.options import Debug, NoPlugins, Scenario, Set, Trace
from netsim.cli.sections import Section

app = typer.Typer(
    name="netsim",
    help="Simulate sensor networks that run distributed inference over real messages: what does an algorithm cost in "
    "messages, bytes, joules and error?",
    epilog="Start with: netsim run scenarios/quickstart.yaml, then: netsim replay runs/quickstart/trace.mcap",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
TimeAxis = Literal["nonlinear", "linear", "events"]
Between = Literal["power_down", "idle", "listen", "low_power_listening"]
new_app = typer.Typer(help="Write a working template to start from.", no_args_is_help=True)
app.add_typer(new_app, name="new")
trace_app = typer.Typer(help="Look after trace files.", no_args_is_help=True)
app.add_typer(trace_app, name="trace")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"netsim {__version__}")
        raise typer.Exit


@app.callback()
def top(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before any command."""


@app.command()
def run(
    scenario: Scenario,
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.", min=0)] = None,
    duration: Annotated[
        float | None, typer.Option(help="Horizon in simulated seconds, instead of the scenario's.")
    ] = None,
    override: Set = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results; by default the first free of runs/NAME, runs/NAME-2, ..."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier run in --out.")] = False,
    no_trace: Annotated[bool, typer.Option("--no-trace", help="Write no trace; the metrics are the same.")] = False,
    no_plugins: NoPlugins = False,
    debug: Debug = False,
) -> None:
    """Run a scenario: simulate, write trace and metrics, print a summary.

    The folder gets trace.mcap (watch it with `netsim replay`), metrics.json (equal for equal runs), run.json (wall time,
    versions, machine) and scenario.yaml (the scenario with every default filled in). Ctrl-C ends the run cleanly.
    """
    from netsim.cli.run import run_command

    overrides = list(override or [])
    overrides += [f"seed={seed}"] if seed is not None else []
    overrides += [f"duration_s={duration!r}"] if duration is not None else []
    run_command(scenario, overrides, out, force=force, trace=not no_trace, plugins=not no_plugins)


app.command()(study)


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Scenario, study and device files.", show_default=False)],
    override: Set = None,
    no_plugins: NoPlugins = False,
    debug: Debug = False,
) -> None:
    """Check scenarios, studies and devices without running them, and report everything that is wrong.

    An algorithm of your own (`type: module:Class`) is imported, so its code runs; --no-plugins forbids it.
    """
    from netsim.cli.check import check_command

    check_command(files, list(override or []), plugins=not no_plugins)


@app.command()
def replay(
    trace: Trace,
    start: Annotated[float, typer.Option(help="Show from here (simulated seconds).", min=0)] = 0.0,
    end: Annotated[float | None, typer.Option(help="Show up to here (simulated seconds).")] = None,
    kinds: Annotated[str | None, typer.Option(help="Message kinds to show, separated by commas.")] = None,
    nodes: Annotated[str | None, typer.Option(help="Node ids or names to show, separated by commas.")] = None,
    speed: Annotated[float | None, typer.Option(help="Simulated seconds per second of playback.")] = None,
    hold: Annotated[float | None, typer.Option(help="How long a message's arrow stays (simulated seconds).")] = None,
    save: Annotated[
        Path | None,
        typer.Option(help="Write a Rerun recording (.rrd), in place of an earlier one, instead of opening a viewer."),
    ] = None,
    serve: Annotated[bool, typer.Option("--serve", help="Serve to a browser on this machine (loopback only).")] = False,
    screenshot: Annotated[
        Path | None, typer.Option(help="Write a picture (.png), in place of an earlier one; needs --at, no screen.")
    ] = None,
    at: Annotated[float | None, typer.Option(help="Instant of the picture (simulated seconds).")] = None,
    graph: Annotated[
        bool, typer.Option("--graph", help="Open with the graphical model and its messages in front, not the map.")
    ] = False,
    live: Annotated[
        bool,
        typer.Option("--live", help="Watch a run that is still going (it is shown as its trace grows, by some 4 MB)."),
    ] = False,
    debug: Debug = False,
) -> None:
    """Watch a run in Rerun: the map with its messages, energy, rounds, radio states and log.

    Rerun's anonymous usage statistics are switched off here; where you start `rerun F.rrd` yourself, it collects them unless
    you run `rerun analytics disable` once.
    """
    from netsim.cli.replay import Sinks, replay_command

    replay_command(trace, start, end, kinds, nodes, speed, hold, Sinks(save, serve, screenshot, at, graph, live))


@app.command()
def inspect(
    trace: Trace,
    nodes: Annotated[
        str | None, typer.Option(help="Node ids or names to look at, separated by commas; by default all.")
    ] = None,
    timeline: Annotated[str | None, typer.Option(metavar="NODE", help="The time line of this node instead.")] = None,
    sequence: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write a sequence chart instead: .svg for a picture, .html for a page to explore."
        ),
    ] = None,
    start: Annotated[float | None, typer.Option(help="Time line, chart: from here (simulated seconds).", min=0)] = None,
    end: Annotated[float | None, typer.Option(help="Time line, chart: up to here (simulated seconds).", min=0)] = None,
    kinds: Annotated[
        str | None, typer.Option(help="Time line, chart: messages of these kinds, separated by commas.")
    ] = None,
    time: Annotated[
        TimeAxis | None,
        typer.Option(help="Chart: how time runs down the page.", show_default="nonlinear"),
    ] = None,
    limit: Annotated[
        int | None, typer.Option(help="Chart: refuse more frames than this.", min=1, show_default="3000")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Chart: overwrite the file.")] = False,
    frames: Annotated[bool, typer.Option("--frames", help="Time line: frames too.")] = False,
    message: Annotated[
        int | None, typer.Option(metavar="ID", help="One message instead: its frames, its causal chain.", min=1)
    ] = None,
    why: Annotated[
        str | None, typer.Option(metavar="NODE", help="Why this node spoke, with --round or --at; or that it did not.")
    ] = None,
    round_number: Annotated[int | None, typer.Option("--round", help="Of --why: in this round.", min=0)] = None,
    at: Annotated[float | None, typer.Option(help="Of --why: at this instant (simulated seconds).", min=0)] = None,
    depth: Annotated[int, typer.Option(help="Follow a causal chain back over so many receptions.", min=1)] = 4,
    top: Annotated[
        int | None,
        typer.Option(help="Show so many lines; by default 20 pairs that talked, else 200.", min=1, show_default=False),
    ] = None,
    debug: Debug = False,
) -> None:
    """Say what a run came to, where its energy went, who talked to whom; or why a node spoke; or draw who sent what when.

    With --nodes: where the energy of these nodes went, and with whom they talked. With --timeline: all that one node did
    and that befell it. With --sequence: a chart of a window, with every frame as an arrow between the nodes' life lines and
    with links from receptions to the sendings they led to. With --message: what became of a message, which receptions led
    to it and what it led to. With --why: what a node had received when it spoke in a round after silence. Of a trace that
    was cut short the part that is there is told, after a warning and with exit status 0.
    """
    from netsim.cli.questions import Question, ask

    ask(
        trace,
        Question(
            nodes=nodes,
            timeline=timeline,
            sequence=sequence,
            time=time,
            limit=limit,
            force=force,
            start_s=start,
            end_s=end,
            kinds=kinds,
            frames=frames,
            message=message,
            why=why,
            round=round_number,
            at_s=at,
            depth=depth,
            top=top,
        ),
    )


app.command()(flow)


app.command()(track)


app.command()(export)


app.command()(compare)


@app.command()
def lifetime(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.", show_default=False)],
    per_day: Annotated[
        float | None, typer.Option(help="How often a day the nodes do what the run shows.", min=1e-9)
    ] = None,
    per_run: Annotated[int | None, typer.Option(help="How many of these activities the run holds.", min=1)] = None,
    between: Annotated[
        Between | None, typer.Option(help="What the radio does in between.", show_default="power_down")
    ] = None,
    self_discharge: Annotated[
        float | None, typer.Option(help="Percent of the battery's energy lost a year.", min=0, max=99.9)
    ] = None,
    debug: Debug = False,
) -> None:
    """Extrapolate a run to the nodes' lifetime in days, and say what that takes for granted.

    The plan of the day is the scenario's section `duty_plan`; options replace its values.
    """
    from netsim.cli.lifetime import lifetime_command

    given = {
        "activities_per_day": per_day,
        "activities_per_run": per_run,
        "between": between,
        "self_discharge_percent_per_year": self_discharge,
    }
    lifetime_command(folder, {name: value for name, value in given.items() if value is not None})


app.command()(report)


@app.command()
def calibrate(
    log: Annotated[Path, typer.Argument(help="Log of a testbed: CSV or K7, plain or gzip.", show_default=False)],
    positions: Annotated[
        Path | None, typer.Option(help="Where the nodes stand: CSV with the header id,x_m,y_m[,name].")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the medium to this file (.yaml) instead of printing it.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Write a picture (.png) of the fits; needs matplotlib.")] = None,
    channel: Annotated[int | None, typer.Option(help="Use only rows of this channel.")] = None,
    frame_byte: Annotated[
        int | None, typer.Option(help="Length of the frames (PSDU), if the log does not say; else 100.", min=5, max=127)
    ] = None,
    tx_power_dbm: Annotated[float | None, typer.Option(help="Transmit power, if the log does not say; else 0.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file of --out.")] = False,
    debug: Debug = False,
) -> None:
    """Fit a medium to a testbed's log: path loss, shadowing, asymmetry, reception against received power.

    A CSV log has the columns source, destination, rssi_dbm and either received (1 or 0, a row a frame), or sent and
    received, or pdr and tx_count; distance_m, tx_power_dbm, time_s and channel if you have them. Path loss needs distances
    or --positions. Prints every figure with its standard error, then a `medium:` section for a scenario.
    """
    from netsim.calibrate import Options
    from netsim.cli.calibrate import calibrate_command

    options = Options(channel=channel, frame_byte=frame_byte, tx_power_dbm=tx_power_dbm)
    calibrate_command(log, positions, out, plot, options, force=force)


@app.command(name="list")
def list_all(
    section: Annotated[
        Section | None,
        typer.Argument(metavar="SECTION", help="Only this section, in full.", show_default=False),
    ] = None,
    metrics: Annotated[bool, typer.Option("--metrics", help="The figures of a run with unit and definition.")] = False,
) -> None:
    """List what comes with netsim: algorithms, models and devices with their sources, scenarios, studies; or the metrics."""
    from netsim.cli.listing import list_command

    list_command(section, metrics=metrics)


@app.command()
def schema(
    reference: Annotated[bool, typer.Option("--reference", help="A table of all fields (Markdown) instead.")] = False,
    of_study: Annotated[bool, typer.Option("--study", help="Of study files instead of scenario files.")] = False,
) -> None:
    """Print the JSON Schema of scenario files, for editors; the shipped scenarios refer to it in their first line."""
    from netsim.cli.schema import schema_command

    schema_command(reference, of_study)


@new_app.command("algorithm")
def new_algorithm(
    name: Annotated[str, typer.Argument(help="Name of the algorithm, such as gossip.", show_default=False)],
    folder: Annotated[Path, typer.Option(help="Where to write it.")] = Path(),
    debug: Debug = False,
) -> None:
    """Write an algorithm of under 40 lines, its test and a scenario that runs it."""
    from netsim.cli.new import new_algorithm_command

    new_algorithm_command(name, folder)


@trace_app.command("info")
def trace_info(trace: Trace, debug: Debug = False) -> None:
    """Say what a trace holds: its run, its topics and how many events of each, its fingerprint."""
    from netsim.cli.tracing import info_command

    info_command(trace)


@trace_app.command("check")
def trace_check(
    traces: Annotated[
        list[Path], typer.Argument(help="Trace files (trace.mcap), or the folders of runs.", show_default=False)
    ],
    debug: Debug = False,
) -> None:
    """Check traces against the laws of a run: one line a rule, and each finding with its instant and node.

    The file is whole and in order, its topics are described as documented (docs/trace-format.md); energy closes; nobody
    sends two frames at once, or asleep; each listener has one outcome a frame; messages are sent before they arrive, and
    arrive once; probabilities are some. A trace that was cut short is checked as far as it goes. Exit status 1 if a rule
    is broken, 2 if a file is no trace that this version reads.
    """
    from netsim.cli.trace_check import trace_check_command

    trace_check_command(traces)
