"""What changes on the map besides messages: the nodes' energy, targets and estimates."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import diamond, static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, line_names, timed
from netsim.trace.events import Estimate, NodeEnergy, TruthTargets

_CIRCLE = np.linspace(0.0, 2 * np.pi, 41)
_LABELLED_TARGETS = 6  # more labels than this hide the map; they are then seen by pointing
_SIGMAS = 2.0  # estimates are drawn with their two-sigma ellipse


class NodeColourTrack:
    """Nodes coloured by the energy they have left; on mains power by their role."""

    topics = (NodeEnergy.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._full_j = np.asarray(setting.scene.nodes.battery_j, np.float64)
        self._colours = style.role_colours(setting.scene.nodes.role)
        battery = np.isfinite(self._full_j)
        self._colours[battery] = style.energy_colours(np.ones(int(battery.sum())))
        self._start = np.array([setting.pace.start_ns], np.int64)
        self._begun = False

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """One row of colours a sample."""
        if not self._begun:
            yield from self.finish()
        batch = batch.from_start(int(self._start[0]))
        node, lengths = batch.rows("node")
        left_j, _ = batch.rows("left_j")
        row = self._scene.rows(node)
        colours = self._colours[row]
        battery = np.isfinite(self._full_j[row])
        fraction = np.clip(left_j[battery] / np.maximum(self._full_j[row][battery], 1e-30), 0.0, 1.0)
        colours[battery] = style.energy_colours(fraction)
        yield self._chunk(batch.time_ns, colours[np.argsort(_within_sample(row, lengths), kind="stable")], lengths)

    def finish(self) -> Iterator[Chunk]:
        """The colours of the start, if there was no sample."""
        if not self._begun:
            self._begun = True
            yield self._chunk(self._start, self._colours, np.array([len(self._colours)]))

    def _chunk(self, time_ns: NDArray[np.int64], colours: style.Colours, lengths: NDArray[np.int64]) -> Chunk:
        return timed("/map/nodes", time_ns, rr.Points2D.columns(colors=colours).partition(lengths))


def _within_sample(row: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """A key that sorts the nodes of each sample by their row and keeps the samples apart."""
    sample = np.repeat(np.arange(len(lengths)), lengths)
    return np.asarray(sample * (int(row.max(initial=0)) + 1) + row)


class TargetTrack:
    """The true targets: hollow diamonds, so that they are not taken for nodes and hide nothing."""

    topics = (TruthTargets.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._start_ns = setting.pace.start_ns
        self._begun = False
        self._few = False
        self._has_colours = setting.scene.group_range_m is not None
        """Whether targets are told apart by colours, as tracks are; static data would hide those of an instant."""
        self._radius_m = (0.8 if self._has_colours else 0.42) * setting.scene.radius_m

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """One row of positions a sample."""
        batch = batch.from_start(self._start_ns)
        target, lengths = batch.rows("target")
        if not self._begun:
            self._begun = True
            look = rr.LineStrips2D.from_fields(
                colors=None if self._has_colours else [style.TARGET],
                radii=[-1.4 if self._has_colours else -0.8],
                show_labels=False,
                draw_order=style.ORDER["targets"],
            )
            yield static("/map/targets", look)
            self._few = int(lengths.max()) <= _LABELLED_TARGETS
            names = rr.Points2D.from_fields(
                colors=[style.LABEL], radii=[0.0], show_labels=True, draw_order=style.ORDER["targets"]
            )
            if self._few:
                yield static("/map/targets/labels", names)
        positions = np.column_stack([batch.rows("x_m")[0], -batch.rows("y_m")[0]])
        labels = [f"target {number}" for number in target]
        colours = [style.kind_colour(number) for number in target.tolist()] if self._has_colours else None
        outlines = rr.LineStrips2D.columns(strips=diamond(positions, self._radius_m), labels=labels, colors=colours)
        yield timed("/map/targets", batch.time_ns, outlines.partition(lengths))
        if self._few:
            labelled = rr.Points2D.columns(positions=positions + np.array([0.0, 2.0 * self._radius_m]), labels=labels)
            yield timed("/map/targets/labels", batch.time_ns, labelled.partition(lengths))

    def finish(self) -> Iterator[Chunk]:
        """Nothing."""
        yield from ()


class EstimateTrack:
    """The latest estimate of each track and thread, whoever made it, with its ellipse."""

    topics = (Estimate.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._radius_m = 0.5 * setting.scene.radius_m
        self._seen: set[str] = set()
        self._round: set[str] = set()
        """Those that have had an ellipse."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """One entity a track and thread."""
        names = line_names(batch)
        for name in np.unique(names).tolist():
            if name not in self._seen:
                self._seen.add(name)
                yield from self._look(name)
            mine = batch.where(names == name).from_start(self._setting.pace.start_ns)
            yield self._points(mine, name)
            known = mine.rows("covariance_m2")[1] == 3
            if known.any() or name in self._round:
                self._round.add(name)
                yield _ellipses(mine, known, name)

    def finish(self) -> Iterator[Chunk]:
        """Nothing."""
        yield from ()

    def _look(self, name: str) -> Iterator[Chunk]:
        order = style.ORDER["estimates"]
        points = rr.Points2D.from_fields(
            colors=[style.ESTIMATE], radii=[self._radius_m], show_labels=False, draw_order=order
        )
        ellipse = rr.LineStrips2D.from_fields(colors=[style.ESTIMATE_DIM], radii=[-1.0], draw_order=order)
        yield static(f"/map/estimates/{name}", points)
        yield static(f"/map/estimates/{name}/ellipse", ellipse)

    def _points(self, batch: Batch, name: str) -> Chunk:
        positions = np.column_stack([batch.numbers("x_m"), -batch.numbers("y_m")])
        whose = f"track {name}".replace("_thread_", ", thread ")
        labels = [f"{whose} by {self._setting.label(int(node))}" for node in batch.numbers("node")]
        columns = rr.Points2D.columns(positions=positions, labels=labels)
        return timed(f"/map/estimates/{name}", batch.time_ns, columns)


def _ellipses(told: Batch, known: NDArray[np.bool_], name: str) -> Chunk:
    """Two-sigma ellipses of a target's estimates, one a row; none where the covariance is not known."""
    batch = told.where(known)
    xx, xy, yy = batch.rows("covariance_m2")[0].reshape(-1, 3).T
    covariance = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
    values, vectors = np.linalg.eigh(covariance)
    axes = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    circle = _SIGMAS * np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)])
    strips = (
        np.einsum("nij,jk->nki", axes, circle) + np.column_stack([batch.numbers("x_m"), batch.numbers("y_m")])[:, None]
    )
    strips[..., 1] *= -1
    columns = rr.LineStrips2D.columns(strips=strips).partition(known.astype(np.int64))
    return timed(f"/map/estimates/{name}/ellipse", told.time_ns, columns)
