"""Measurements and predicted events on the map, and how probable it is that they belong together."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import Scene, static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import PairProbabilities, Problem
from netsim.trace.reader import read_trace

_MEASUREMENT, _EVENT = 0.55, 0.9  # node radii
_STROKES = np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
_LABELLED_EVENTS = 12  # more labels than this hide the map; they are then seen by pointing
_LEAST = 0.01  # pairs that are less probable are not drawn

Places = tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]
"""Map positions of the measurements, shape (n, 2), and of the predicted events by number."""


class PairTrack:
    """A line from each measurement to the events it may be of, once its owner has stated how probable each is.

    The colour is that of beliefs: violet for unlikely, yellow for certain. Pointing at a line tells probability and
    interval.
    """

    topics = (PairProbabilities.topic,)
    past = True

    def __init__(self, setting: Setting, places: Places) -> None:
        self._setting = setting
        self._measurements, self._events = places

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """One entity a measurement."""
        variables = batch.numbers("variable")
        for variable in np.unique(variables).tolist():
            if variable < len(self._measurements):
                mine = batch.where(variables == variable).from_start(self._setting.pace.start_ns)
                path = f"/map/pairs/{variable}"
                look = rr.LineStrips2D.from_fields(radii=[-1.6], show_labels=False, draw_order=style.ORDER["pairs"])
                yield static(path, look)
                yield from self._lines(mine, int(variable), path)

    def finish(self) -> Iterator[Chunk]:
        """Nothing."""
        yield from ()

    def _lines(self, batch: Batch, variable: int, path: str) -> Iterator[Chunk]:
        events, lengths = batch.rows("event")
        probability, low, high = (batch.rows(name)[0] for name in ("probability", "low", "high"))
        drawn = (probability >= _LEAST) & np.isin(events, list(self._events))
        statement = np.repeat(np.arange(len(lengths)), lengths)
        counts = np.bincount(statement[drawn], minlength=len(lengths))
        start = self._measurements[variable]
        labels = [
            f"measurement {variable} of event {event}: {p:.3g} in [{least:.3g}, {most:.3g}]"
            for event, p, least, most in zip(events[drawn], probability[drawn], low[drawn], high[drawn], strict=True)
        ]
        lines = rr.LineStrips2D.columns(
            strips=np.array([[start, self._events[int(event)]] for event in events[drawn]], np.float32).reshape(
                -1, 2, 2
            ),
            colors=style.belief_colours(probability[drawn]),
            labels=labels,
        )
        yield timed(path, batch.time_ns, lines.partition(counts))


def pair_places(trace: Path) -> Places:
    """Where measurements and predicted events are; none for another kind of problem."""
    for _, event in read_trace(trace, {Problem.topic}, end_ns=1):
        if isinstance(event, Problem) and event.kind == "event-association":
            content = json.loads(event.content_json)
            places = np.array(content["measurements_m"], float).reshape(-1, 2) * (1.0, -1.0)
            return places, {each["event"]: np.array([each["x_m"], -each["y_m"]]) for each in content["events"]}
    return np.empty((0, 2)), {}


def pair_chunks(scene: Scene, places: Places) -> Iterator[Chunk]:
    """Measurements as small discs and predicted events as crosses; both stay where they are."""
    measurements, events = places
    order = style.ORDER["measurements"]
    if len(measurements):
        discs = rr.Points2D(
            measurements,
            colors=[style.MEASUREMENT],
            radii=[_MEASUREMENT * scene.radius_m],
            labels=[f"measurement {number}" for number in range(len(measurements))],
            show_labels=False,
            draw_order=order,
        )
        yield static("/map/measurements", discs)
    if events:
        middles, half_m = np.array(list(events.values())), _EVENT * scene.radius_m
        strokes = (middles[:, None, None] + half_m * _STROKES).reshape(-1, 2, 2).astype(np.float32)
        yield static("/map/events", rr.LineStrips2D(strokes, colors=[style.EVENT], radii=[-1.4], draw_order=order))
        names = rr.Points2D(
            middles + np.array([0.0, 1.6 * half_m]),
            colors=[style.LABEL],
            radii=[0.0],
            labels=[f"event {number}" for number in events],
            show_labels=len(events) <= _LABELLED_EVENTS,
            draw_order=order,
        )
        yield static("/map/events/labels", names)
