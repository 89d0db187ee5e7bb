"""Where targets and their estimates came from lately, and how far apart they are."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, line_names, scalars, timed
from netsim.trace.events import Estimate, TruthTargets
from netsim.units import NS_PER_S

_LENGTH = 40  # places in a trail
_MOST_CURVES = 6

Fix = tuple[int, float, float]
"""Instant and place, metres north and east."""


class TrailTrack:
    """Lines through the last places of targets and of estimates, and curves of the distance between them."""

    topics = (TruthTargets.topic, Estimate.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._pace = setting.pace
        self._begin_ns = round(max(0.0, setting.options.start_s) * NS_PER_S)
        self._cut_off_m = setting.scene.cut_off_m
        self._has_colours = setting.scene.group_range_m is not None
        """Whether tracks and targets are told apart by colours."""
        self._truth: defaultdict[str, list[Fix]] = defaultdict(list)
        self._told: defaultdict[str, list[Fix]] = defaultdict(list)
        self._spread_m: defaultdict[str, list[float]] = defaultdict(list)

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; they are compared at the end."""
        if batch.topic == TruthTargets.topic:
            target, lengths = batch.rows("target")
            times = np.repeat(batch.time_ns, lengths).tolist()
            places = batch.rows("x_m")[0].tolist(), batch.rows("y_m")[0].tolist()
            for number, *fix in zip(target.tolist(), times, *places, strict=True):
                self._truth[str(number)].append((fix[0], fix[1], fix[2]))
        else:
            self._take_estimates(batch)
        yield from ()

    def _take_estimates(self, batch: Batch) -> None:
        names, times = line_names(batch).tolist(), batch.time_ns.tolist()
        places = batch.numbers("x_m").tolist(), batch.numbers("y_m").tolist()
        flat, lengths = batch.rows("covariance_m2")
        spreads = (_spread_m(row) for row in np.split(flat, np.cumsum(lengths)[:-1]))
        for name, time_ns, x_m, y_m, spread_m in zip(names, times, *places, spreads, strict=True):
            self._told[name].append((time_ns, x_m, y_m))
            self._spread_m[name].append(spread_m)

    def finish(self) -> Iterator[Chunk]:
        """Trails of what moved, and the curves."""
        yield from self._trails("/map/target_trails", self._truth, style.TARGET_DIM)
        yield from self._trails("/map/trails", self._told, style.TRAIL)
        if self._truth and any(len(fixes) > 1 for fixes in self._told.values()) and len(self._told) <= _MOST_CURVES:
            yield from self._curves()

    def _trails(self, path: str, fixes: Mapping[str, Sequence[Fix]], colour: style.Rgba) -> Iterator[Chunk]:
        for name, each in fixes.items():
            places = np.array([(x_m, -y_m) for _, x_m, y_m in each])
            if len(each) < 2 or not np.ptp(places, axis=0).any():
                continue
            own = f"{path}/{name}"
            shown_as = self._own_colour(path, name) or colour
            look = rr.LineStrips2D.from_fields(colors=[shown_as], radii=[-0.9], draw_order=style.ORDER["trails"])
            yield static(own, look)
            times = np.array([time_ns for time_ns, _, _ in each], np.int64)
            first = max(0, int(np.searchsorted(times, self._pace.start_ns, "right")) - 1)
            strips = [places[max(0, last - _LENGTH + 1) : last + 1] for last in range(first, len(times))]
            at_ns = np.maximum(
                times[first:], self._pace.start_ns
            )  # what was left before the window is there at its start
            yield timed(own, at_ns, rr.LineStrips2D.columns(strips=strips).partition([1] * len(strips)))

    def _own_colour(self, path: str, name: str) -> style.Rgba | None:
        """That of a track, and dimmer that of a target; None where they have none."""
        if not self._has_colours:
            return None
        own = style.kind_colour(int(name.split("_")[0]))
        return own if path == "/map/trails" else style.dim(own)

    def _curve_colours(self, line: str, place: int, *, many: bool) -> tuple[style.Rgba, style.Rgba]:
        """Of error and spread."""
        own = self._own_colour("/map/trails", line)
        if own is not None:
            return own, style.dim(own)
        return (
            (style.kind_colour(2 * place), style.kind_colour(2 * place + 1)) if many else (style.ESTIMATE, style.MEAN)
        )

    def _curves(self) -> Iterator[Chunk]:
        """Error of each track and thread, and how large its covariance says that it is."""
        many = len(self._told) > 1
        for place, (line, fixes) in enumerate(self._told.items()):
            times = np.array([time_ns for time_ns, _, _ in fixes], np.int64)
            inside = times >= self._known_ns
            whose = f" of track {line}".replace("_thread_", ", thread ") if many else ""
            error_colour, spread_colour = self._curve_colours(line, place, many=many)
            curves = (
                ("error", self._errors_m(fixes), error_colour),
                ("spread", np.array(self._spread_m[line]), spread_colour),
            )
            for name, values, colour in curves:
                known = inside & np.isfinite(values)
                if known.any():
                    path = f"/plots/track/{name}_{line}"
                    yield static(path, rr.SeriesLines(colors=[colour], names=[name + whose], widths=[2.0]))
                    yield scalars(path, times[known], values[known])

    @property
    def _known_ns(self) -> int:
        """From when on curves are to be told.

        In a live view that is before this look: of estimates after the last word of the targets nobody knew the error.
        """
        before = [at for truth in self._truth.values() for at, *_ in truth if at < self._pace.start_ns]
        return max(self._begin_ns, min(self._pace.start_ns, max(before, default=self._pace.start_ns)))

    def _errors_m(self, fixes: Sequence[Fix]) -> NDArray[np.float64]:
        """Distance from the nearest target that is there; not a number without any, or where it is beyond the cut-off."""
        times, xs, ys = (np.array(column) for column in zip(*fixes, strict=True))
        nearest = np.full(len(times), np.inf)
        for truth in self._truth.values():
            at, east, north = (np.array(column) for column in zip(*truth, strict=True))
            off_m = np.hypot(np.interp(times, at, east) - xs, np.interp(times, at, north) - ys)
            there = (times >= at[0]) & ((times <= at[-1]) | (len(at) == 1))
            nearest = np.where(there, np.minimum(nearest, off_m), nearest)
        return np.where(nearest < self._cut_off_m, nearest, np.nan)


def _spread_m(covariance_m2: NDArray[np.float64]) -> float:
    """Root of the trace of a covariance; not a number without one."""
    if len(covariance_m2) != 3:
        return float("nan")
    return float(np.sqrt(max(0.0, float(covariance_m2[0] + covariance_m2[2]))))
