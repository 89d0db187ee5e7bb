"""The commands of studies and their options; `netsim.cli.app` puts them among the others."""

from pathlib import Path
from typing import Annotated

import typer

from netsim.cli.options import Debug, NoPlugins


def study(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (YAML).", show_default=False)],
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", help="Worker processes; 1 runs in this one.", min=1, show_default="one a core"),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on the workers of this Dask scheduler, such as tcp://host:8786."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results; by default the first free of runs/NAME, runs/NAME-2, ..."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the study in --out, by default the last runs/NAME: run what is missing."
        ),
    ] = False,
    allow_changed: Annotated[
        bool,
        typer.Option("--allow-changed", help="Resume though the study has changed; keep the trials that are the same."),
    ] = False,
    override: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="PATH=VALUE",
            help="Override a field of the study, or a value of all its scenarios, as in --set duration_s=10. May be "
            "repeated.",
        ),
    ] = None,
    repetitions: Annotated[int | None, typer.Option(help="Repetitions instead of the study's.", min=1)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier study in --out.")] = False,
    no_report: Annotated[bool, typer.Option("--no-report", help="Write the tables only.")] = False,
    no_plugins: NoPlugins = False,
    debug: Debug = False,
) -> None:
    """Run a study: every combination of its sweep, repetition by repetition; then tables and a report.

    Each finished trial is on disk at once: after Ctrl-C, a crash or a failed trial, the same command with --resume runs only
    what is missing. More repetitions are added by --repetitions N --resume. The tables do not depend on who ran the trials.

    On several machines: `dask scheduler` on one, `dask worker tcp://HOST:8786 --nthreads 1` on each, then --scheduler.
    """
    from netsim.study.worker import one_thread_each

    one_thread_each()
    from netsim.cli.study import Orders, study_command

    overrides = list(override or []) + ([f"repetitions={repetitions}"] if repetitions is not None else [])
    orders = Orders(
        out=out,
        jobs=jobs,
        scheduler=scheduler,
        resume=resume,
        allow_changed=allow_changed,
        force=force,
        report=not no_report,
        plugins=not no_plugins,
    )
    study_command(study_file, overrides, orders)


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(help="Folders of runs, or their traces; or folders of studies.", show_default=False),
    ],
    everything: Annotated[bool, typer.Option("--all", help="Show every metric, not only the headline ones.")] = False,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-if",
            metavar="EXPRESSION",
            help="End with status 1 if this holds, as in --fail-if 'error_rel > 0.02'. May be repeated.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole comparison as JSON.")] = False,
    debug: Debug = False,
) -> None:
    """Put runs side by side, each against the first: figures, scenarios, versions, and where their traces part.

    Of studies: variants of the same levels, with the paired difference and its 95 % interval where the studies share seed
    and repetitions.

    In --fail-if a metric's name (see metrics.json) is its value in the later run, NAME_first that in the first run,
    NAME_diff the difference and NAME_rel the relative one; `error` stands for the error of the problem. Join comparisons
    by and, or, not. Of studies, names are means over all variants; a gate also ends with status 1 if it could not be judged
    on all that the first study was: if a trial that ended well there failed or is missing in the later study, or only one of
    the two has a figure that the gate needs. Trials that failed or are missing in the first study do not count.
    """
    from netsim.cli.compare import compare_command

    compare_command(runs, list(fail_if or []), everything=everything, as_json=as_json)


def report(
    folder: Annotated[Path, typer.Argument(help="Folder that `netsim study` wrote.", show_default=False)],
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    debug: Debug = False,
) -> None:
    """Write the report of a study anew from its results: Markdown, one HTML page, plots, tables of means and differences.

    An interrupted study is reported as far as it got.
    """
    from netsim.cli.report import report_command

    report_command(folder, open_page=open_page)
