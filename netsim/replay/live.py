"""Watching a run that is still going: again and again what its trace has got is converted, from where it ended last.

A trace grows by chunks of some 4 MiB, about 25,000 frames; what is not in the file yet cannot be shown.
"""

import math
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import rerun as rr

from netsim.errors import TraceError
from netsim.replay.blueprint import Contents, make_blueprint
from netsim.replay.convert import Conversion
from netsim.replay.options import Pace, ReplayOptions, decide
from netsim.replay.track import Kinds
from netsim.replay.viewer import listening
from netsim.trace.mending import mended
from netsim.trace.reader import TruncatedTraceWarning, has_events, last_time_ns, trace_metadata
from netsim.trace.writer import partial_path
from netsim.units import s_to_ns

_LOOK_S = 0.5
_HEAD_BYTE = 8  # the magic of MCAP
_REST = 3.0  # of the time, at most a quarter is spent on converting: the run goes on beside it


class Follower:
    """A trace that grows, on its way into one recording.

    Args:
        trace: Where the finished trace will be; it is read under its partial name before.
        recording: Where it goes.
        options: What to show.
    """

    def __init__(self, trace: Path, recording: rr.RecordingStream, options: ReplayOptions) -> None:
        self._trace = trace
        self._recording = recording
        self._options = options
        self._kinds = Kinds(options.kinds)
        self._pace: Pace | None = None
        self.shown_ns = 0
        """Up to where it is shown."""
        self._contents: Contents | None = None

    def advance(self) -> bool:
        """Show what has been added; returns whether the trace is finished and all of it shown.

        Raises:
            TraceError: If the trace cannot be read or is damaged.
        """
        is_finished = self._trace.exists()
        path = self._trace if is_finished else partial_path(self._trace)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TruncatedTraceWarning)
            try:
                if not has_begun(path):
                    return False
                return self._show(path, is_finished)
            except (OSError, TraceError):
                if is_finished or path.exists():
                    raise
                return False  # it was given its own name meanwhile

    def _show(self, path: Path, is_finished: bool) -> bool:
        last_ns = last_time_ns(path)
        pace = self._pace = self._pace or decide(self._options, _horizon_ns(path, last_ns))
        so_far_ns = min(pace.end_ns, last_ns) - pace.first_bar_ns
        whole_ns = pace.first_bar_ns + so_far_ns // pace.bin_ns * pace.bin_ns  # bars of a rate are whole
        end_ns = min(pace.end_ns, last_ns + 1) if is_finished else whole_ns
        begin_ns = max(pace.start_ns, self.shown_ns)
        if end_ns > begin_ns:
            self._convert(path, replace(pace, start_ns=begin_ns, end_ns=end_ns))
            self.shown_ns = end_ns
        return is_finished or end_ns >= pace.end_ns

    def _convert(self, path: Path, window: Pace) -> None:
        before = self._contents
        with mended(path) as complete:
            conversion = Conversion(complete, self._options, window, self._kinds)
            contents = conversion.send(self._recording, before.present if before else ())
        if before is not None:
            contents = _merged(before, contents)
        if before is None or _differ(before, contents):
            self._recording.send_blueprint(make_blueprint(contents, self._pace or window, follow=True))
        self._contents = contents
        self._recording.flush()


def has_begun(path: Path) -> bool:
    """Whether there is a trace that has events; one just created is empty."""
    return path.exists() and path.stat().st_size >= _HEAD_BYTE and has_events(path)


def follow(
    trace: Path, recording: rr.RecordingStream, options: ReplayOptions, alive: Callable[[], bool] = lambda: True
) -> Iterator[int]:
    """Show a run while it is going, until its trace is finished.

    Args:
        trace: Where its finished trace will be.
        recording: Where it goes.
        options: What to show.
        alive: Asked whether anybody still watches.

    Yields:
        After each look how far it is shown, simulated ns.

    Raises:
        TraceError: If the trace cannot be read or is damaged.
    """
    follower = Follower(trace, recording, options)
    is_over = False
    while alive() and not is_over:
        began_s = time.monotonic()
        is_over = follower.advance()
        yield follower.shown_ns
        if not is_over:
            time.sleep(max(_LOOK_S, _REST * (time.monotonic() - began_s)))


def watch(
    trace: Path, options: ReplayOptions, announce: Callable[[str], None] | None, told: Callable[[int, bool], None]
) -> None:
    """Show a run while it is going, until the viewer is closed; see `netsim.replay.live`."""
    with listening(announce) as viewer:
        recording = rr.RecordingStream("netsim", send_properties=False)
        recording.connect_grpc(viewer.address)
        recording.send_recording_name(trace.parent.name or trace.stem)
        for shown_ns in follow(trace, recording, options, viewer.is_open):
            told(shown_ns, False)
        if viewer.is_open():
            told(shown_ns, True)
            recording.flush()
            viewer.process.wait()


def _horizon_ns(path: Path, last_ns: int) -> int:
    """Up to when the run is to go; up to now if it does not say."""
    told = float(trace_metadata(path).get("horizon_s", "nan"))
    return max(last_ns, s_to_ns(told)) if math.isfinite(told) else last_ns


def _merged(before: Contents, now: Contents) -> Contents:
    """What there is to lay out with what there was."""
    lanes = [*before.lanes, *(lane for lane in now.lanes if lane not in before.lanes)]
    graph = now.left.graph or before.left.graph
    return replace(
        now, lanes=lanes, left=replace(now.left, graph=graph), identities=now.identities or before.identities
    )


def _differ(before: Contents, now: Contents) -> bool:
    """Whether another layout is due: a new one takes back what the user has changed."""
    return replace(before, left=now.left) != now or (before.left.graph is None) != (now.left.graph is None)
