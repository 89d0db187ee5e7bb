"""The whole scene: everything that is shown, in one file."""

from collections.abc import Mapping
from pathlib import Path

from netsim.export.foxglove.beliefs import Beliefs
from netsim.export.foxglove.figures import Figures
from netsim.export.foxglove.flights import Flights
from netsim.export.foxglove.nodes import Nodes
from netsim.export.foxglove.stage import Stage, load_stage
from netsim.export.foxglove.targets import Targets
from netsim.export.foxglove.text import Lines
from netsim.export.foxglove.writer import SceneFile
from netsim.export.job import Job
from netsim.export.selection import TOLD_AT_START
from netsim.trace.events import Event
from netsim.trace.reader import read_trace, trace_metadata
from netsim.trace.recorder import Handler


class FoxgloveScene:
    """Writes a scene.

    Args:
        path: File to write.
        job: What is exported.

    Raises:
        OSError: If the file cannot be written.
        TraceError: If the trace cannot be read.
    """

    def __init__(self, path: Path, job: Job) -> None:
        run = trace_metadata(job.trace)
        self._file = SceneFile(path, run)
        stage = load_stage(self._file, job)
        self._figures = Figures(stage)
        nodes, targets = Nodes(stage), Targets(stage)
        if job.selection.start_ns:
            _catch_up(stage, {**nodes.handlers(), **targets.handlers()})
        parts = (nodes, Flights(stage), targets, Beliefs(stage), Lines(stage), self._figures)
        self._handlers: dict[type[Event], list[Handler]] = {}
        for part in parts:
            for event_type, handler in part.handlers().items():
                self._handlers.setdefault(event_type, []).append(handler)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What any of its parts reads."""
        return {event_type: _all_of(handlers) for event_type, handlers in self._handlers.items()}

    def close(self) -> None:
        """Tell the last figures, and close the file."""
        self._figures.close()
        self._file.close()

    def abort(self) -> None:
        """Close the file as it is."""
        self._file.abort()


def _catch_up(stage: Stage, handlers: Mapping[type[Event], Handler]) -> None:
    """Bring the scene to the beginning of the window, without showing anything."""
    topics = {event_type.topic for event_type in handlers if event_type not in TOLD_AT_START}
    stage.is_past = True
    for time_ns, event in read_trace(stage.job.trace, topics, 0, stage.job.selection.start_ns):
        handlers[type(event)](event, time_ns)
    stage.is_past = False


def _all_of(handlers: list[Handler]) -> Handler:
    def handle(event: Event, time_ns: int) -> None:
        for handler in handlers:
            handler(event, time_ns)

    return handle
