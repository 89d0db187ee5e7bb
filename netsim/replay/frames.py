"""Frames as growing arrows, one entity a message kind; what is lost goes to entities of its own, with the reason."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.flights import NO_FLIGHTS, Air, Flights, Rows
from netsim.replay.flying import (
    ACKS,
    FIRST_KIND,
    INTERFERED,
    INTERFERENCE,
    LOST,
    LOST_ACKS,
    Audience,
    Frames,
    good_links,
    shafts,
)
from netsim.replay.legend import Met
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, timed
from netsim.trace.events import OUTCOME_CODE, OUTCOMES, Frame

_FIXED_LAYERS = ("/map/losses/lost", "/map/losses/interference", "/map/losses/acks", "/map/acks")
_REASONS = np.array([name.replace("_", " ") for name in OUTCOMES] + ["out of reach"])
_WIDTHS = {
    LOST: style.LOST_WIDTH,
    INTERFERED: style.COLLIDED_WIDTH,
    LOST_ACKS: style.ACK_WIDTH,
    ACKS: style.ACK_WIDTH,
}
_COLOURS = {
    LOST: style.LOST,
    INTERFERED: style.COLLIDED,
    LOST_ACKS: style.LOST,
    ACKS: style.ACKNOWLEDGEMENT,
}
_MANY_LISTENERS = 0.4  # width of the arrows of one broadcast where they are many
_EXPLAINED = (LOST, INTERFERED)
_CROWDED = 0.5
_MOST_REASONS = 8  # of more losses at once the reasons are seen by pointing only


class FrameTrack:
    """Every frame to every listener that it was meant for."""

    topics = (Frame.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        pace = setting.pace
        self._air = Air(pace.start_ns, pace.tick_ns, pace.hold_ns)
        self._longest_ns = 0
        self._styled: set[int] = set()
        scene = setting.scene
        self._audience = Audience(scene.rows, setting.shown, good_links(scene.links, scene.rows, scene.motion))
        self._interference: set[int] = set()
        self._has_strobes = False

    def met(self) -> Met:
        """What has been met of what the legend tells apart."""
        interference = [str(_REASONS[code]) for code in INTERFERENCE if code in self._interference]
        kinds = self._setting.kinds
        coloured = [(name, kinds.colour(number)) for number, name in enumerate(kinds.names)]
        return Met(coloured, interference, self._has_strobes)

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Arrows of all ticks that no later frame can touch, taking none to be longer than those seen so far."""
        started_ns = batch.numbers("t_start_ns")
        self._longest_ns = max(self._longest_ns, int((batch.numbers("t_end_ns") - started_ns).max()))
        horizon_ns = int(batch.time_ns[-1]) - self._longest_ns
        for rows in self._air.advance(self._flights(batch), min(horizon_ns, self._setting.pace.end_ns)):
            yield from self._chunks(rows)

    def finish(self) -> Iterator[Chunk]:
        """The arrows of the last ticks."""
        pace = self._setting.pace
        for rows in self._air.advance(NO_FLIGHTS, pace.end_ns + pace.hold_ns + 2 * pace.tick_ns):
            yield from self._chunks(rows)

    def _flights(self, batch: Batch) -> Flights:
        codes, words = batch.words("kind")
        strobes = batch.flags("is_strobe")
        self._has_strobes |= bool(strobes.any())
        listener, lengths = batch.rows("rx_node")
        frames = Frames(
            start_ns=batch.numbers("t_start_ns"),
            source=batch.numbers("source"),
            destination=batch.numbers("destination"),
            kind=self._setting.kinds.numbers(words)[codes],
            carries_nothing=batch.flags("is_ack") | strobes,
            lengths=lengths,
            listener=listener,
            outcome=batch.rows("rx_outcome")[0].astype(np.int64),
        )
        return self._audience.flights(frames)

    def _chunks(self, rows: Rows) -> Iterator[Chunk]:
        path = self._entity(rows.layer)
        if rows.layer not in self._styled:
            self._styled.add(rows.layer)
            yield static(path, self._style(rows.layer))
            if rows.layer in _EXPLAINED:
                colour = _COLOURS[rows.layer]
                look = rr.Points2D.from_fields(
                    colors=[colour], radii=[0.0], show_labels=True, draw_order=style.ORDER["losses"]
                )
                yield static(f"{path}/reasons", look)
        origins, vectors = shafts(self._setting.scene.motion, self._setting.scene.radius_m, rows)
        columns = rr.Arrows2D.columns(origins=origins, vectors=vectors).partition(rows.lengths)
        parts = list(columns)
        if rows.layer == INTERFERED:
            self._interference |= set(np.unique(rows.flights.outcome).tolist())
        if rows.layer in _EXPLAINED:
            parts += rr.Arrows2D.columns(labels=list(_REASONS[rows.flights.outcome])).partition(rows.lengths)
        yield timed(path, rows.time_ns, parts)
        if rows.layer in _EXPLAINED and self._setting.scene.roomy:
            yield _reasons(rows, origins + vectors)

    def _entity(self, layer: int) -> str:
        if layer < FIRST_KIND:
            return _FIXED_LAYERS[layer]
        kind, is_broadcast = divmod(layer - FIRST_KIND, 2)
        path = entity("map", "messages", self._setting.kinds.names[kind])
        return f"{path}/broadcast" if is_broadcast else path

    def _style(self, layer: int) -> rr.Arrows2D:
        kind, is_broadcast = divmod(layer - FIRST_KIND, 2)
        order = "messages" if layer >= FIRST_KIND else "acks" if layer in (ACKS, LOST_ACKS) else "losses"
        below = layer >= FIRST_KIND and is_broadcast
        width = _WIDTHS.get(layer, style.KIND_WIDTH) * (1.0 if self._setting.scene.roomy else _CROWDED)
        return rr.Arrows2D.from_fields(
            colors=[_COLOURS.get(layer) or self._setting.kinds.colour(kind)],
            radii=[width * (_MANY_LISTENERS if below and self._setting.scene.crowded else 1.0)],
            draw_order=style.ORDER[order] - (1.0 if below else 0.0),
            show_labels=False,
        )


def _reasons(rows: Rows, heads: NDArray[np.float64]) -> Chunk:
    """Why frames were lost, where their arrows end: one label a sender and row, none where there would be many.

    That a frame collided needs no label: what it collided with is seen.
    """
    row = np.repeat(np.arange(len(rows.lengths)), rows.lengths)
    told = np.flatnonzero(rows.flights.outcome != OUTCOME_CODE["collided"])
    senders = int(rows.flights.tail.max(initial=0)) + 1
    first = np.sort(told[np.unique((row * senders + rows.flights.tail)[told], return_index=True)[1]])
    first = first[(np.bincount(row[first], minlength=len(rows.lengths)) <= _MOST_REASONS)[row[first]]]
    labels = rr.Points2D.columns(positions=heads[first], labels=list(_REASONS[rows.flights.outcome[first]]))
    lengths = np.bincount(row[first], minlength=len(rows.lengths))
    return timed(f"{_FIXED_LAYERS[rows.layer]}/reasons", rows.time_ns, labels.partition(lengths))
