"""From a trace to what other programs read: captures for Wireshark, tables, scenes for Foxglove."""

import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from netsim.errors import NetsimError, ScenarioError, TraceError
from netsim.export.formats import FORMATS, Format
from netsim.export.job import ExportWarning, Job, Sink
from netsim.export.metric_table import NAME as METRIC_TABLE
from netsim.export.places import Place
from netsim.export.selection import TOLD_AT_START, Selection
from netsim.export.sheet_list import SHEETS
from netsim.trace.events import Event
from netsim.trace.reader import TruncatedTraceWarning, last_time_ns, read_trace, trace_metadata
from netsim.trace.recorder import Handler

__all__ = ["FORMATS", "ExportWarning", "Format", "Job", "Selection", "check_outputs", "export"]

Progress = Callable[[int, int], None]
"""Called now and then with the time of the event at hand, and of the last one, in nanoseconds."""

TRACE_ENDING = ".mcap"
_LOOK_EVERY = 1024


def check_outputs(outputs: Mapping[str, Path], *, force: bool = False) -> None:
    """Make sure that outputs can be written, without writing anything.

    Args:
        outputs: Where each output goes, by format (see `FORMATS`).
        force: Whether earlier exports may be replaced.

    Raises:
        ScenarioError: If a name, or what is there already, does not allow it.
        NetsimError: If a library is missing that a format needs.
    """
    for name, place in _places(outputs).items():
        place.check(force=force)
        _spare_traces(place)
        FORMATS[name].load()


def export(
    job: Job, outputs: Mapping[str, Path], *, force: bool = False, progress: Progress = lambda now_ns, end_ns: None
) -> None:
    """Export a trace; it is read once, whatever the number of outputs.

    Outputs get their names when all of them are whole; if anything fails, none is left.

    Args:
        job: What is to be exported.
        outputs: Where each output goes, by format (see `FORMATS`).
        force: Whether earlier exports may be replaced.
        progress: Told how far it is.

    Warns:
        TruncatedTraceWarning: If the trace was cut short; what is there is exported.
        ExportWarning: If something in an output is not what one may take it for.

    Raises:
        ScenarioError: If an output's name, or what is there already, does not allow it.
        TraceError: If the trace cannot be read or is damaged.
        NetsimError: If an output cannot be written, or a library is missing that a format needs.
    """
    check_outputs(outputs, force=force)
    places = _places(outputs)
    with ExitStack() as stack:
        writers = [stack.enter_context(_writer(name, place, job)) for name, place in places.items()]
        _feed(job, writers, progress)
        for writer in writers:
            with _blame(writer.place):
                writer.sink.close()
        for writer in writers:
            with _blame(writer.place):
                writer.place.commit()


def _spare_traces(place: Place) -> None:
    """An export may be replaced, a trace never."""
    if place.path.is_file() and place.ending == TRACE_ENDING:
        with suppress(TraceError):
            trace_metadata(place.path)
            msg = f"{place.option} {place.path}: expected the name of an export, got a trace, which would be lost"
            raise ScenarioError(msg)


@dataclass(frozen=True, slots=True)
class _Writer:
    place: Place
    sink: Sink


def _places(outputs: Mapping[str, Path]) -> dict[str, Place]:
    tables = {sheet.name for sheet in SHEETS} | {METRIC_TABLE}
    formats = {name: FORMATS[name] for name in outputs}
    return {
        name: Place(f"--{name}", outputs[name], each.ending, each.is_folder, tables) for name, each in formats.items()
    }


@contextmanager
def _writer(name: str, place: Place, job: Job) -> Iterator[_Writer]:
    """An output that is being written; what is not committed by the end is taken back."""
    make = FORMATS[name].load()
    try:
        with _blame(place), _told_later():
            sink = make(place.begin(), job)
        try:
            yield _Writer(place, sink)
        except BaseException:
            with suppress(Exception):  # what failed first is what is told
                sink.abort()
            raise
    finally:
        place.discard()


@contextmanager
def _blame(place: Place) -> Iterator[None]:
    """Say which output could not be written."""
    try:
        yield
    except OSError as error:
        msg = f"{place.path}: cannot write the export: {error.strerror or error}"
        raise NetsimError(msg) from error


def _feed(job: Job, writers: Sequence[_Writer], progress: Progress) -> None:
    """Give the events of the part to be exported to all who write."""
    handlers: defaultdict[type[Event], list[tuple[_Writer, Handler]]] = defaultdict(list)
    for writer in writers:
        for event_type, handler in writer.sink.handlers().items():
            handlers[event_type].append((writer, handler))
    last_ns = min(last_time_ns(job.trace), job.selection.end_ns or 1 << 63)
    for count, (time_ns, event) in enumerate(_events(job, {each.topic for each in handlers})):
        if count % _LOOK_EVERY == 0:
            progress(time_ns, last_ns)
        for writer, handler in handlers[type(event)]:
            try:
                handler(event, time_ns)
            except OSError as error:
                with _blame(writer.place):
                    raise error


def _events(job: Job, topics: set[str]) -> Iterator[tuple[int, Event]]:
    """The events of the window, and before them what is told at the start."""
    window = read_trace(job.trace, topics, job.selection.start_ns, job.selection.end_ns)
    if job.selection.start_ns == 0:
        return window
    with _told_later():
        start = list(read_trace(job.trace, topics & {each.topic for each in TOLD_AT_START}, 0, 1))
    return chain(start, window)


@contextmanager
def _told_later() -> Iterator[None]:
    """That a trace was cut short is told once, when all of it is read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncatedTraceWarning)
        yield
