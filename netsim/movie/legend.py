"""What the signs mean: only those that a movie has."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from netsim.movie import shapes
from netsim.movie.cast import Cast, Places
from netsim.movie.layout import ROW_FONTS, Layout
from netsim.movie.look import Colour, Colours, Look, charge_colours
from netsim.movie.scenery import sensor_colour, sensor_kinds, shorten
from netsim.movie.state import CRASHED, DEAD
from netsim.movie.story import Story
from netsim.replay.flying import ACKS, INTERFERED, LOST, LOST_ACKS

_MARK_FONTS = 2.6  # width of the column of signs
_MOST_KINDS = 8


@dataclass(frozen=True)
class Entry:
    """A sign and its meaning.

    Attributes:
        label: Its meaning.
        sign: `arrow`, `line`, `loss`, `discs`, `ring`, `square`, `diamond`, `cross`, `lines`, `hull`; empty for a headline.
        colours: Of the sign's parts.
    """

    label: str
    sign: str = ""
    colours: Sequence[Colour] = ()


def entries(story: Story, cast: Cast, look: Look) -> list[Entry]:
    """The legend of a movie, row by row."""
    messages = list(_messages(story, look))
    return [*([Entry("messages"), *messages] if messages else []), Entry("map"), *_map(story, cast, look)]


def _messages(story: Story, look: Look) -> Iterator[Entry]:
    layers = np.unique(story.flights.layer)
    kinds = story.kinds
    for number, kind in enumerate(kinds[:_MOST_KINDS]):
        yield Entry(kind, "arrow", [look.kind(story.places[number])])
    if len(kinds) > _MOST_KINDS:
        yield Entry(f"and {len(kinds) - _MOST_KINDS} more kinds")
    if {ACKS, LOST_ACKS} & set(layers.tolist()):
        label = "acknowledgement, wake-up" if story.has_strobes else "acknowledgement"
        yield Entry(label, "line", [look.acknowledgement])
    if LOST in layers:
        yield Entry("lost", "loss", [look.lost])
    if INTERFERED in layers:
        yield Entry("lost to interference", "loss", [look.collided])


def _map(story: Story, cast: Cast, look: Look) -> Iterator[Entry]:
    yield from _nodes(story, cast, look)
    moments = story.moments
    if any(each.targets for each in moments):
        yield Entry("target", "diamond", [look.track(0) if cast.has_track_colours else look.target])
    if any(each.estimates for each in moments):
        colour = look.track(0) if cast.has_track_colours else look.estimate
        has_spread = any(len(told.covariance_m2) == 3 for each in moments for told in each.estimates.values())
        yield Entry("estimate, 2 sigma" if has_spread else "estimate", "estimate", [colour])
    if any(each.beliefs for each in moments):
        yield Entry("belief: low to high", "discs", _stops(look.cells(np.array([0.02, 0.3, 1.0]))))
    tracks = sorted({track for each in moments for track in (*each.particles, *each.groups)})[:3]
    colours = [look.track(track) for track in tracks]
    if any(each.particles for each in moments):
        yield Entry("particles of a track", "dots", colours)
    if any(each.groups for each in moments):
        yield Entry("group of a track", "lines", colours)
    if len(cast.lines()[0]):
        yield Entry("link: bad to good", "lines", _stops(look.links(np.array([0.0, 0.5, 1.0]))))


def _nodes(story: Story, cast: Cast, look: Look) -> Iterator[Entry]:
    battery = np.isfinite(np.asarray(cast.nodes.battery_j, float))
    sinks = np.array([role == "sink" for role in cast.nodes.role])
    if battery.any():
        yield Entry("battery: empty to full", "discs", _stops(charge_colours(np.array([0.0, 0.5, 1.0]))))
    if (~battery & ~sinks).any():
        yield Entry("node on mains power", "discs", [look.roles[1]])
    if sinks.any():
        yield Entry("sink", "sink", [look.roles[0], look.sink_rim])
    for kind in sensor_kinds(cast):
        yield Entry(f"{kind} sensor", "ring", [sensor_colour(kind)])
    signs = [
        (Entry("leader", "square", [look.leader]), any(each.leaders for each in story.moments)),
        (Entry("dead", "dead", [look.dead, look.soft]), _ever(story, DEAD)),
        (Entry("crashed", "cross", [look.dead, look.crashed]), _ever(story, CRASHED)),
        (Entry("fault at work", "ring", [look.fault]), any(each.struck for each in story.moments)),
        (Entry("jammer", "discs", [look.jammer]), any(each.jammers for each in story.moments)),
    ]
    yield from (entry for entry, is_there in signs if is_there)


def _ever(story: Story, life: int) -> bool:
    return any((each.life == life).any() for each in story.moments)


def _stops(colours: Colours) -> list[Colour]:
    return [(red, green, blue, alpha) for red, green, blue, alpha in colours.tolist()]


def draw_legend(axes: Axes, layout: Layout, look: Look, legend: Sequence[Entry]) -> None:
    """Draw it into its box, from the top."""
    font, box = layout.font_px, layout.legend
    for number, entry in enumerate(legend):
        y = box.high - (number + 0.5) * ROW_FONTS * font
        headline = not entry.sign
        x = box.left + (0.0 if headline else _MARK_FONTS * font)
        colour = look.soft if headline else look.ink
        text = axes.text(x, y, entry.label, size=0.92 * font, color=colour, va="center_baseline")
        shorten(text, box.right - x)
        _draw_sign(axes, entry, np.array([box.left + 0.42 * _MARK_FONTS * font, y]), 0.36 * font)


def _draw_sign(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    """A sign about six sizes wide and two high."""
    drawers = {"arrow": _arrow, "loss": _loss, "line": _lines, "lines": _lines}
    drawer = drawers.get(entry.sign, _discs if entry.sign in ("discs", "dots") else _outline)
    if entry.sign:
        drawer(axes, entry, middle, size)


def _arrow(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    half = np.array([2.6 * size, 0.0])
    width = 0.5 * size
    shaft, head = shapes.arrows((middle - half)[None], 2 * half[None], np.array([width]))
    axes.add_collection(LineCollection(list(shaft), colors=entry.colours, linewidths=width))
    axes.add_collection(PolyCollection(list(head), facecolors=entry.colours, edgecolors="none"))


def _loss(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    half = np.array([2.0 * size, 0.0])
    strokes = [np.stack([middle - half, middle + half]), *shapes.crosses((middle + half)[None], 0.75 * size)]
    axes.add_collection(LineCollection(strokes, colors=entry.colours, linewidths=0.4 * size))


def _lines(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    width = (0.25 if entry.sign == "line" else 0.42) * size
    step = 5.2 * size / len(entry.colours)
    lefts = [middle + np.array([-2.6 * size + number * step, 0.0]) for number in range(len(entry.colours))]
    strips = [np.stack([left, left + np.array([0.82 * step, 0.0])]) for left in lefts]
    axes.add_collection(LineCollection(strips, colors=list(entry.colours), linewidths=width))


def _discs(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    across = 1.9 * size * (np.arange(len(entry.colours)) - (len(entry.colours) - 1) / 2)
    diameter = (1.0 if entry.sign == "dots" else 1.7) * size
    places = middle + np.column_stack([across, np.zeros(len(across))])
    axes.scatter(places[:, 0], places[:, 1], s=diameter**2, c=list(entry.colours), linewidths=0)


def _outline(axes: Axes, entry: Entry, middle: Places, size: float) -> None:
    one, colours = middle[None], list(entry.colours)
    if entry.sign in ("dead", "cross", "sink", "estimate"):
        edge = colours[1] if entry.sign in ("sink", "dead") else "none"
        diameter = 1.1 * size if entry.sign == "estimate" else 1.9 * size
        axes.scatter(one[:, 0], one[:, 1], s=diameter**2, color=[colours[0]], edgecolors=edge, linewidths=0.22 * size)
    strips = {
        "ring": lambda: shapes.circles(one, size),
        "square": lambda: shapes.squares(one, size),
        "diamond": lambda: shapes.diamonds(one, size),
        "cross": lambda: shapes.crosses(one, 0.75 * size),
        "estimate": lambda: shapes.circles(one, 1.25 * size),
    }
    if entry.sign in strips:
        width = (0.22 if entry.sign == "estimate" else 0.36) * size
        axes.add_collection(LineCollection(list(strips[entry.sign]()), colors=[colours[-1]], linewidths=width))
