"""A whole trace of one that was cut short.

Of a trace without its end Rerun's reader loses all messages of some topics, so that it is given a copy of what our own
reader finds.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from netsim.errors import InvariantError, TraceError
from netsim.replay.check import node_table
from netsim.trace.reader import is_complete, read_trace, trace_metadata
from netsim.trace.writer import TraceWriter

_OWN = ("format_version", "netsim_version")
"""What the writer adds to the metadata by itself."""


@contextmanager
def whole(trace: Path) -> Iterator[Path]:
    """The trace itself, or for as long as this lasts a copy of what there is of one that was cut short.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
    """
    if is_complete(trace):
        yield trace
        return
    node_table(trace)
    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        copy = Path(folder) / trace.name
        _copy(trace, copy)
        yield copy


def _copy(trace: Path, copy: Path) -> None:
    metadata = {name: text for name, text in trace_metadata(trace).items() if name not in _OWN}
    try:
        with TraceWriter(copy, metadata) as writer:
            for time_ns, event in read_trace(trace):
                writer.write(event, time_ns)
    except InvariantError as error:
        message = f"{trace}: cannot read the trace: its events are not in the order of time"
        raise TraceError(message) from error
