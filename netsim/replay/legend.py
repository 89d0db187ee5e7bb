"""The legend: what every mark on the map means, in rows below the field; only marks that the replay has.

A label's size on screen is fixed and that of the map is not, so each mark stands above its label, not beside it.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import LegendBox, Scene, diamond, static

_ROW_CHARACTERS = 84  # a row of so many characters fits below the map in a window of usual width
_GAP_CHARACTERS = 4
_MARK_DEPTH = 0.22  # depths as fractions of a row
_LABEL_DEPTH = 0.4
_CIRCLE = np.column_stack([np.cos(np.linspace(0.0, 2 * np.pi, 33)), np.sin(np.linspace(0.0, 2 * np.pi, 33))])
_SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
_STROKES = np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])


@dataclass(frozen=True)
class Mark:
    """One entry of the legend: an arrow, discs or lines above a label.

    Attributes:
        label: What it means.
        arrow: Colour and width (negative: points on screen) of an arrow.
        discs: Step to the right, radius and colour of each disc, in fractions of the size of a mark.
        lines: Colours of short lines, side by side.
        outline: Colour of a hollow diamond.
        ring: Colour of a circle.
        cross: Colour of a cross.
        square: Colour and half the side of a hollow square.
    """

    label: str
    arrow: tuple[style.Rgba, float] | None = None
    discs: Sequence[tuple[float, float, style.Rgba]] = ()
    lines: Sequence[style.Rgba] = ()
    outline: style.Rgba | None = None
    ring: style.Rgba | None = None
    cross: style.Rgba | None = None
    square: tuple[style.Rgba, float] | None = None


@dataclass(frozen=True)
class Met:
    """What frames there were.

    Attributes:
        kinds: Message kinds as they were met, with their colours.
        interference: How frames were lost to other signals.
        strobes: Whether there were wake-up frames of low-power listening.
    """

    kinds: Sequence[tuple[str, style.Rgba]]
    interference: Sequence[str]
    strobes: bool


def marks(scene: Scene, frames: Met, present: Collection[str]) -> list[Mark]:
    """What a map shows: first the arrows, then what they fly over.

    Args:
        scene: The still parts.
        frames: What frames there were.
        present: Entities on the map that have data.
    """
    return [*_arrow_marks(frames, present), *_node_marks(scene, present), *_other_marks(scene, present)]


def _arrow_marks(frames: Met, present: Collection[str]) -> Iterator[Mark]:
    for kind, colour in frames.kinds:
        yield Mark(kind, arrow=(colour, style.KIND_WIDTH))
    if "/map/acks" in present:
        yield Mark(
            "acknowledgement" + (", wake-up" if frames.strobes else ""), arrow=(style.ACKNOWLEDGEMENT, style.ACK_WIDTH)
        )
    if "/map/losses" in present:
        yield Mark("lost", arrow=(style.LOST, style.LOST_WIDTH))
        yield Mark(", ".join(frames.interference) or "collided", arrow=(style.COLLIDED, style.COLLIDED_WIDTH))


def _node_marks(scene: Scene, present: Collection[str]) -> Iterator[Mark]:
    battery = np.isfinite(np.asarray(scene.nodes.battery_j))
    sink = np.array([role == "sink" for role in scene.nodes.role])
    if battery.any():
        colours = style.energy_colours(np.array([1.0, 0.5, 0.0])).tolist()
        discs = [(step, 0.6, tuple(colour)) for step, colour in zip((-1.5, 0.0, 1.5), colours, strict=True)]
        yield Mark("energy: full to empty", discs=discs)
    if (~battery & ~sink).any():
        yield Mark("on mains", discs=[(0.0, 0.75, style.ROLE_COLOURS["sensor"])])
    if sink.any():
        yield Mark("sink", discs=[(0.0, 1.0, style.SINK_RIM), (0.0, 0.74, style.ROLE_COLOURS["sink"])])
    yield from _state_marks(bool(battery.any()), present)
    if "/map/faults" in present:
        yield Mark("fault at work", ring=style.FAULT)
    if "/map/jammers" in present:
        yield Mark("jammer", discs=[(0.0, 0.9, style.JAMMER)])


def _state_marks(on_battery: bool, present: Collection[str]) -> Iterator[Mark]:
    """Of nodes that take no part for a while or for good."""
    if "/map/asleep" in present:
        yield Mark("asleep", ring=style.ASLEEP)
    if "/map/dead" in present:
        empty = tuple(style.energy_colours(np.array([0.0]))[0].tolist())
        yield Mark("dead", discs=[(0.0, 0.75, empty), (0.0, 0.6, style.DEAD)])
    if "/map/crashed" in present:
        colours = style.energy_colours(np.array([0.8])) if on_battery else style.role_colours(["sensor"])
        alive: style.Rgba = tuple(colours[0].tolist())
        yield Mark("crashed", discs=[(0.0, 0.75, alive), (0.0, 0.6, style.DEAD)], cross=style.CRASHED)


def _other_marks(scene: Scene, present: Collection[str]) -> Iterator[Mark]:
    yield from _track_marks(present)
    yield from _pair_marks(present)
    if "/map/targets" in present:
        yield Mark("target", outline=style.TARGET if scene.group_range_m is None else style.kind_colour(0))
    if "/map/estimates" in present:
        yield Mark("estimate", discs=[(0.0, 0.5, style.ESTIMATE)])
    if "/map/routes" in present:
        yield Mark("next hop to a sink", lines=[style.ROUTE])
    if "/map/ways" in present:
        yield Mark("way of a node", lines=[style.WAY])
    if "/map/model" in present:
        yield Mark("graph variables", lines=[style.MODEL], discs=[(s, 0.25, style.VARIABLE) for s in (-1.6, 1.6)])
    if "/map/links" in present:
        colours = style.prr_colours(np.array([1.0, 0.5, 0.0])).tolist()
        yield Mark("link: good to bad", lines=[tuple(colour) for colour in colours])


def _track_marks(present: Collection[str]) -> Iterator[Mark]:
    """Of a belief and who holds it."""
    for kind, colour in style.SENSOR_COLOURS.items():
        if f"/map/{kind}_sensors" in present:
            alive: style.Rgba = tuple(style.energy_colours(np.array([1.0]))[0].tolist())
            yield Mark(f"{kind} sensor", discs=[(0.0, 0.95, colour), (0.0, 0.76, style.RIM), (0.0, 0.62, alive)])
    if "/map/beliefs" in present:
        colours = style.belief_colours(np.array([1.0, 0.3, 0.02])).tolist()
        yield Mark(
            "belief: likely to unlikely",
            discs=[(s, 0.7, tuple(c)) for s, c in zip((-1.3, 0.0, 1.3), colours, strict=True)],
        )
    if "/map/particles" in present:
        colours = [style.kind_colour(track) for track in range(3)]
        discs = [(s, size, c) for s, size, c in zip((-1.3, 0.0, 1.3), (0.2, 0.4, 0.6), colours, strict=True)]
        yield Mark("particles of a track, larger by weight", discs=discs)
    if "/map/groups" in present:
        yield Mark("group of a track, joint: bold", lines=[style.kind_colour(track) for track in range(3)])
    if "/map/leaders" in present:
        yield Mark("leader", square=(style.LEADER, 0.9))
    if "/map/neighbours" in present:
        yield Mark("its neighbours", square=(style.NEIGHBOUR, 0.75))


def _pair_marks(present: Collection[str]) -> Iterator[Mark]:
    """Of measurements, events, and how probable it is that they belong together."""
    if "/map/measurements" in present:
        yield Mark("a measurement", discs=[(0.0, 0.45, style.MEASUREMENT)])
    if "/map/events" in present:
        yield Mark("predicted event", cross=style.EVENT)
    if "/map/pairs" in present:
        colours = style.belief_colours(np.array([1.0, 0.3, 0.02])).tolist()
        yield Mark("pair: likely to unlikely", lines=[tuple(colour) for colour in colours])


def rows_of(entries: Sequence[Mark]) -> list[list[Mark]]:
    """The entries in as few rows as they need, of about equal length."""
    widths = [len(entry.label) + _GAP_CHARACTERS for entry in entries]
    total = max(1, sum(widths))
    count = -(-total // _ROW_CHARACTERS)
    middles = [end - width / 2 for end, width in zip(accumulate(widths), widths, strict=True)]
    rows: list[list[Mark]] = [[] for _ in range(count)]
    for entry, middle in zip(entries, middles, strict=True):
        rows[min(count - 1, int(middle * count / total))].append(entry)
    return [row for row in rows if row]


def legend_chunks(scene: Scene, rows: Sequence[Sequence[Mark]]) -> Iterator[Chunk]:
    """The rows below the map as static data."""
    entries = [entry for row in rows for entry in row]
    if not entries:
        return
    box = scene.legend_box()
    at = np.concatenate([_places(row, box, depth) for depth, row in enumerate(rows)])
    marks_at = at + np.array([0.0, _MARK_DEPTH * box.row_m])
    order = style.ORDER["legend"]
    labels = rr.Points2D(
        at + np.array([0.0, _LABEL_DEPTH * box.row_m]),
        colors=[style.LABEL],
        radii=[0.0],
        labels=[entry.label for entry in entries],
        show_labels=True,
        draw_order=order,
    )
    yield static("/map/legend/labels", labels)
    yield from _arrows(entries, marks_at, box.mark_m)
    yield from _lines(entries, marks_at, box.mark_m)
    yield from _discs(entries, marks_at, box.mark_m)


def _places(row: Sequence[Mark], box: LegendBox, depth: int) -> NDArray[np.float64]:
    """Where the entries of a row begin to hang; each has room in proportion to its label."""
    widths = np.array([len(entry.label) + _GAP_CHARACTERS for entry in row], float)
    middles = (np.cumsum(widths) - widths / 2) / widths.sum()
    return np.column_stack([box.left_m + box.width_m * middles, np.full(len(row), box.top_m + depth * box.row_m)])


def _arrows(entries: Sequence[Mark], at: NDArray[np.float64], size_m: float) -> Iterator[Chunk]:
    found = [(place, *entry.arrow) for place, entry in zip(at, entries, strict=True) if entry.arrow is not None]
    if found:
        half = np.array([1.8 * size_m, 0.0])
        places, colours, widths = zip(*found, strict=True)
        arrows = rr.Arrows2D(
            origins=np.array(places) - half,
            vectors=[2 * half] * len(found),
            colors=colours,
            radii=widths,
            draw_order=style.ORDER["legend"],
        )
        yield static("/map/legend/arrows", arrows)


def _lines(entries: Sequence[Mark], at: NDArray[np.float64], size_m: float) -> Iterator[Chunk]:
    drawn = [line for place, entry in zip(at, entries, strict=True) for line in _lines_of(entry, place, size_m)]
    if drawn:
        strips, colours = zip(*drawn, strict=True)
        lines = rr.LineStrips2D(strips, colors=colours, radii=[-1.4], draw_order=style.ORDER["legend"] + 2)
        yield static("/map/legend/lines", lines)


def _lines_of(entry: Mark, place: NDArray[np.float64], size_m: float) -> Iterator[tuple[NDArray[Any], style.Rgba]]:
    if entry.outline is not None:
        yield diamond(place[None], 0.9 * size_m)[0], entry.outline
    if entry.ring is not None:
        yield place + 0.8 * size_m * _CIRCLE, entry.ring
    if entry.square is not None:
        colour, half = entry.square
        yield place + half * size_m * _SQUARE, colour
    if entry.cross is not None:
        yield from ((place + 0.45 * size_m * stroke, entry.cross) for stroke in _STROKES)
    length = 3.2 * size_m / max(1, len(entry.lines))
    for step, colour in enumerate(entry.lines):
        left = place[0] - 1.6 * size_m + step * length
        yield np.array([[left, place[1]], [left + 0.85 * length, place[1]]]), colour


def _discs(entries: Sequence[Mark], at: NDArray[np.float64], size_m: float) -> Iterator[Chunk]:
    found = [(place, disc) for place, entry in zip(at, entries, strict=True) for disc in entry.discs]
    if found:
        discs = rr.Points2D(
            [place + np.array([step * size_m, 0.0]) for place, (step, _, _) in found],
            radii=[radius * size_m for _, (_, radius, _) in found],
            colors=[colour for _, (_, _, colour) in found],
            draw_order=style.ORDER["legend"] + 1,
        )
        yield static("/map/legend/discs", discs)
