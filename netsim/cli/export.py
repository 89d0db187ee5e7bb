"""`netsim export`."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.progress import BarColumn, TaskID, TextColumn, TimeRemainingColumn

from netsim.cli.console import say
from netsim.cli.movie import Movies, movie_command
from netsim.cli.names import one_node
from netsim.cli.replay import trace_file
from netsim.cli.watching import progress_bar
from netsim.errors import ScenarioError
from netsim.export import FORMATS, Format, Job, Progress, Selection, check_outputs, export
from netsim.replay import ReplayOptions, check_window, node_ids
from netsim.units import NS_PER_S, s_to_ns


@dataclass(frozen=True, slots=True)
class Wanted:
    """The part of a trace that was asked for, as it was typed.

    Attributes:
        start_s: From here.
        end_s: Up to here.
        kinds: Message kinds, separated by commas.
        nodes: Node ids or names, separated by commas.
        pcap_node: Node at which the capture is made.
    """

    start_s: float
    end_s: float | None
    kinds: str | None
    nodes: str | None
    pcap_node: str | None


def export_command(
    given: Path, outputs: Mapping[str, Path | None], wanted: Wanted, movies: Movies, *, force: bool
) -> None:
    """Check, export, say where it is."""
    chosen = {name: path for name, path in outputs.items() if path is not None}
    _check(chosen, wanted, movies)
    check_outputs(chosen, force=force)
    movies.check(force=force)
    trace = trace_file(given)
    part = _part(trace, wanted)
    if chosen:
        with _shown() as progress:
            export(_job(trace, wanted, part), chosen, force=force, progress=progress)
    for name, path in chosen.items():
        say(f"wrote {path}; {_opening(FORMATS[name], path)}")
    movie_command(trace, movies, part, force=force)


def _opening(form: Format, path: Path) -> str:
    """How to open an output, with a table that is there for example: of a part without frames there is none of them."""
    has_frames = not form.is_folder or (path / f"frames{form.ending}").exists()
    return form.opening.format(path=path, table="frames" if has_frames else "nodes")


def _check(chosen: Mapping[str, Path], wanted: Wanted, movies: Movies) -> None:
    if not chosen and not movies.paths:
        options = ", ".join(f"--{name}" for name in (*FORMATS, "gif", "mp4"))
        message = (
            f"expected at least one output ({options}), got none, as in: netsim export TRACE --{next(iter(FORMATS))} F"
        )
        raise ScenarioError(message)
    if wanted.pcap_node is not None and "pcap" not in chosen:
        message = "--pcap-node: expected --pcap as well, got none: it says at which node a capture is made"
        raise ScenarioError(message)
    places = [path.absolute() for path in chosen.values()]
    for option, path in chosen.items():
        if places.count(path.absolute()) > 1:
            message = f"--{option} {path}: expected a place of its own for each output, got the same one twice"
            raise ScenarioError(message)


def _part(trace: Path, wanted: Wanted) -> ReplayOptions:
    kinds = None if wanted.kinds is None else frozenset(part.strip() for part in wanted.kinds.split(","))
    nodes = None if wanted.nodes is None else node_ids(trace, wanted.nodes.split(","))
    part = ReplayOptions(start_s=wanted.start_s, end_s=wanted.end_s, kinds=kinds, nodes=nodes)
    check_window(trace, part)
    return part


def _job(trace: Path, wanted: Wanted, part: ReplayOptions) -> Job:
    end_ns = None if wanted.end_s is None else s_to_ns(wanted.end_s)
    selection = Selection(start_ns=s_to_ns(wanted.start_s), end_ns=end_ns, kinds=part.kinds, nodes=part.nodes)
    node = None if wanted.pcap_node is None else one_node(trace, "--pcap-node", wanted.pcap_node)
    return Job(trace=trace, selection=selection, pcap_node=node)


@contextmanager
def _shown() -> Iterator[Progress]:
    columns = (
        TextColumn("exporting"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:g} s"),
        TimeRemainingColumn(),
    )
    with progress_bar(*columns) as bar:
        tasks: list[TaskID] = []

        def progress(now_ns: int, end_ns: int) -> None:
            if bar is None:
                return
            if not tasks:
                tasks.append(bar.add_task("export", total=end_ns / NS_PER_S))
            bar.update(tasks[0], completed=now_ns / NS_PER_S)

        yield progress
