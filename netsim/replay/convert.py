"""From a trace to a Rerun recording, in one pass over the file; between batches only what is in the air is kept."""

from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from netsim.replay.asleep import AsleepTrack
from netsim.replay.beliefs import BeliefTrack
from netsim.replay.blueprint import Contents, Left, make_blueprint
from netsim.replay.certainty import EntropyTrack, WidthTrack
from netsim.replay.clocks import ClockTrack
from netsim.replay.energy import EnergyTrack
from netsim.replay.faults import FaultTrack
from netsim.replay.flow import FlowTrack
from netsim.replay.frames import FrameTrack
from netsim.replay.groups import GroupTrack
from netsim.replay.identities import IdentityTrack
from netsim.replay.lanes import LaneTrack
from netsim.replay.leaders import LeaderTrack
from netsim.replay.legend import legend_chunks, marks, rows_of
from netsim.replay.links import LinkTrack
from netsim.replay.lives import DownTrack
from netsim.replay.marks import EstimateTrack, NodeColourTrack, TargetTrack
from netsim.replay.nodes import node_chunks
from netsim.replay.options import Pace, ReplayOptions, decide
from netsim.replay.pairs import PairTrack, pair_chunks, pair_places
from netsim.replay.particles import ParticleTrack
from netsim.replay.plots import AccuracyTrack, RateTrack, RoundTrack
from netsim.replay.routes import RouteTrack
from netsim.replay.scene import Scene, field_chunks, load_scene
from netsim.replay.sensors import sensor_chunks
from netsim.replay.source import Batch, batches
from netsim.replay.text import LogTrack
from netsim.replay.track import Kinds, Setting, Track
from netsim.replay.trails import TrailTrack
from netsim.trace.events import Frame, NodeEnergy
from netsim.trace.reader import last_time_ns, read_trace, trace_metadata

_LAST_SAMPLES_NS = 60_000_000_000  # energy is sampled at the end of a run; in a trace cut short, some time before
_WORTH_A_PLOT = 0.1
_APPLICATION = "netsim"
_LEAD_NS = 1_000_000_000  # frames are recorded at their end, so those of the first ticks may be older than the window


class Conversion:
    """One trace, or a window of it, on its way into a recording.

    Args:
        trace: The trace.
        options: What to show.
        pace: Window and steps; None to decide them by the options and the length of the trace.
        kinds: Message kinds that have their colours already.
    """

    def __init__(
        self, trace: Path, options: ReplayOptions, pace: Pace | None = None, kinds: Kinds | None = None
    ) -> None:
        self.trace = trace
        self.scene: Scene = load_scene(trace)
        last_ns = last_time_ns(trace)
        self.pace: Pace = pace or decide(options, last_ns)
        drained = _drained(trace, self.scene, last_ns)
        kinds = kinds or Kinds(options.kinds)
        kinds.place(trace, self.pace.end_ns)
        self._setting = _setting(self.scene, self.pace, options, drained, kinds)
        self._energy = EnergyTrack(self._setting)
        self._frames = FrameTrack(self._setting)
        self._clocks = ClockTrack(self._setting)
        self._flow = FlowTrack(self._setting)
        self._lanes = LaneTrack(self._setting) if self._setting.shown.sum() <= options.detail_nodes else None
        self._identities = IdentityTrack(self._setting)
        self._pairs = pair_places(trace)
        own: list[Track] = [self._frames, *_tracks(self._setting), PairTrack(self._setting, self._pairs)]
        own += [self._energy, self._clocks, self._flow, self._identities]
        self._tracks = [*own, *([self._lanes] if self._lanes else [])]
        self._present: set[str] = set()

    def run(self, recording: rr.RecordingStream) -> None:
        """Send everything, legend and layout last, when it is known what there is to show."""
        recording.send_blueprint(make_blueprint(self.send(recording), self.pace))

    def send(self, recording: rr.RecordingStream, present: Collection[str] = ()) -> Contents:
        """Send everything but the layout.

        Args:
            recording: Where it goes.
            present: Entities that it has data of already.

        Returns:
            What there is to lay out.
        """
        self._present |= set(present)
        rr.send_chunks(self._noted(), recording=recording)
        legend = rows_of(marks(self.scene, self._frames.met(), self._present))
        rr.send_chunks(legend_chunks(self.scene, legend), recording=recording)
        lanes = self._lanes.busiest() if self._lanes else []
        left = Left(self.scene.bounds(len(legend)), self._flow.bounds, self._setting.options.graph)
        return Contents(self._present, self._energy.plot(), self._clocks.name, lanes, left, self._identities.bounds)

    def _noted(self) -> Iterator[Chunk]:
        for chunk in self._chunks():
            self._present.add("/".join(str(chunk.entity_path).split("/")[:3]))
            yield chunk

    def _chunks(self) -> Iterator[Chunk]:
        yield from field_chunks(self.scene)
        yield from node_chunks(self.scene, self.pace)
        yield from sensor_chunks(self.trace, self.scene)
        yield from pair_chunks(self.scene, self._pairs)
        window_ns, lead_ns = self.pace.start_ns, max(0, self.pace.start_ns - self.pace.hold_ns - _LEAD_NS)
        past = {topic for track in self._tracks if track.past for topic in track.topics} - {Frame.topic}
        if lead_ns:
            for batch in batches(self.trace, sorted(past), 0, lead_ns):
                yield from self._fed(batch, window_ns)
        topics = sorted({topic for track in self._tracks for topic in track.topics})
        for batch in batches(self.trace, topics, lead_ns, self.pace.end_ns):
            yield from self._fed(batch, window_ns)
        for track in self._tracks:
            yield from track.finish()

    def _fed(self, batch: Batch, window_ns: int) -> Iterator[Chunk]:
        """What the tracks make of a batch; what was before the window goes only to those that want it."""
        inside = batch if batch.time_ns[0] >= window_ns else batch.where(batch.time_ns >= window_ns)
        for track in self._tracks:
            given = batch if track.past else inside
            if batch.topic in track.topics and len(given.time_ns):
                yield from track.take(given)


def convert(trace: Path, recording: rr.RecordingStream, options: ReplayOptions) -> None:
    """Convert a trace into a recording.

    Args:
        trace: The trace.
        recording: Where it goes: a file, a viewer or memory, as its owner has set it up.
        options: What to show.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
    """
    Conversion(trace, options).run(recording)


def save_recording(trace: Path, rrd: Path, options: ReplayOptions) -> None:
    """Convert a trace into an `.rrd` file with its layout inside."""
    conversion = Conversion(trace, options)
    recording = rr.RecordingStream(_APPLICATION, send_properties=False)
    recording.save(rrd)
    recording.send_recording_name(trace_metadata(trace).get("scenario", trace.stem))
    conversion.run(recording)
    recording.flush()
    recording.disconnect()


def _drained(trace: Path, scene: Scene, last_ns: int) -> bool:
    """Whether some battery has lost a tenth or more at the end."""
    full_j = np.asarray(scene.nodes.battery_j)
    fraction = 1.0
    for _, event in read_trace(trace, {NodeEnergy.topic}, start_ns=last_ns - _LAST_SAMPLES_NS):
        if isinstance(event, NodeEnergy):
            row = scene.rows(np.asarray(event.node))
            battery = np.isfinite(full_j[row]) & (full_j[row] > 0.0)
            fraction = float((np.asarray(event.left_j)[battery] / full_j[row][battery]).min(initial=1.0))
    return fraction <= 1.0 - _WORTH_A_PLOT


def _setting(scene: Scene, pace: Pace, options: ReplayOptions, drained: bool, kinds: Kinds) -> Setting:
    ids = np.asarray(scene.nodes.node)
    shown = np.ones(len(ids), bool) if options.nodes is None else np.isin(ids, list(options.nodes))
    return Setting(scene, pace, options, kinds, shown, drained)


def _tracks(setting: Setting) -> list[Track]:
    tracks: list[Track] = [make(setting) for make in (LinkTrack, RouteTrack, RateTrack, NodeColourTrack, DownTrack)]
    tracks += [make(setting) for make in (FaultTrack, TargetTrack, EstimateTrack, RoundTrack, AccuracyTrack, LogTrack)]
    tracks += [make(setting) for make in (BeliefTrack, ParticleTrack, GroupTrack, LeaderTrack, TrailTrack)]
    tracks += [make(setting) for make in (AsleepTrack, EntropyTrack, WidthTrack)]
    return tracks
