"""What moves in a picture besides messages: nodes, targets, tracks and beliefs. Each part brings itself up to date."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.text import Text

from netsim.movie import shapes
from netsim.movie.cast import Cast, Places
from netsim.movie.ink import Drawn, Strokes
from netsim.movie.layout import Layout
from netsim.movie.look import Look, charge_colours
from netsim.movie.scenery import NAME_DROP, draw_names, node_radius_px
from netsim.movie.state import CRASHED, DEAD, Line, Moment
from netsim.replay import style
from netsim.trace.events import Belief

_LEAST, _MOST = 0.17, 0.75  # diameters of particles in heights of the font: without weight, of the heaviest
_GROUP_MARGIN = 1.9  # node radii between a member and the hull
_MOST_MOVING_NAMES = 30  # text is slow to draw
_FAULT_RING, _JAMMER, _LEADER = 1.75, 2.2, 2.1


class Actor(Protocol):
    """A part of the picture that changes."""

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date; what is to be drawn, from below."""
        ...


def make_actors(axes: Axes, layout: Layout, look: Look, cast: Cast) -> tuple[list[Actor], list[Actor]]:
    """What is drawn below the messages and above them, each from below."""
    below: list[Actor] = [make(axes, layout, look, cast) for make in (Beliefs, Jammers, Groups)]
    above: list[Actor] = [make(axes, layout, look, cast) for make in (Clouds, Targets, Nodes, Marks, Estimates)]
    return below, above


def dots(axes: Axes) -> Any:
    """An empty collection of discs to be filled, not drawn with the rest."""
    return axes.scatter([], [], animated=True, linewidths=0)


class Nodes:
    """Discs coloured by the energy left, on mains power by role; dark and crossed when they are down; names."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._look, self._motion = layout, look, cast.motion
        self._radius = node_radius_px(layout, cast)
        sinks = np.array([role == "sink" for role in cast.nodes.role])
        self._mains = np.where(sinks[:, None], np.array(look.roles[0]), np.array(look.roles[1]))
        self._rims, self._discs, self._covers = dots(axes), dots(axes), dots(axes)
        self._crosses = Strokes(look.crashed, 0.15 * layout.font_px)
        self._rims.set_sizes((2 * self._radius * np.where(sinks, 1.4, 1.22)) ** 2)
        self._rims.set_facecolor(np.where(sinks[:, None], np.array(look.sink_rim), np.array(look.rim)))
        self._discs.set_sizes([(2 * self._radius) ** 2])
        self._covers.set_sizes([(1.5 * self._radius) ** 2])
        self._covers.set_facecolor(look.dead)
        self._names = self._named(axes, cast)

    def _named(self, axes: Axes, cast: Cast) -> list[Text]:
        """Names of nodes that move, to be drawn in each picture; those of others are part of the scenery."""
        if cast.motion.is_still or cast.size > _MOST_MOVING_NAMES:
            return []
        names = draw_names(axes, self._layout, self._look, cast)
        for name in names:
            name.set_animated(True)
        return names

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        at = self._layout.px(self._motion.snapshot(moment.time_ns))
        known = np.isfinite(moment.charge)
        colours = self._mains.copy()
        colours[known] = charge_colours(moment.charge[known])
        for each in (self._rims, self._discs):
            each.set_offsets(at)
        self._discs.set_facecolor(colours)
        down = (moment.life == DEAD) | (moment.life == CRASHED)
        self._covers.set_offsets(at[down])
        crosses = self._crosses.having(shapes.crosses(at[moment.life == CRASHED], 0.6 * self._radius))
        for name, (x, y) in zip(self._names, at, strict=False):
            name.set_position((x, y - NAME_DROP * self._radius))
        return [self._rims, self._discs, self._covers, crosses, *self._names]


class Marks:
    """Squares around leaders, rings around nodes that a fault concerns."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._motion = layout, cast.motion
        self._radius = node_radius_px(layout, cast)
        self._leaders = Strokes(look.leader, 0.15 * layout.font_px)
        self._rings = Strokes(look.fault, 0.12 * layout.font_px)

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        at = self._layout.px(self._motion.snapshot(moment.time_ns))
        rings = self._rings.having(shapes.circles(at[list(moment.struck)], _FAULT_RING * self._radius))
        leaders = self._leaders.having(shapes.squares(at[list(moment.leaders)], _LEADER * self._radius))
        return [rings, leaders]


class Jammers:
    """Discs where jammers are at work."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout = layout
        self._discs = dots(axes)
        self._discs.set_facecolor(look.jammer)
        self._discs.set_sizes([(2 * _JAMMER * node_radius_px(layout, cast)) ** 2])

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        self._discs.set_offsets(self._layout.px(np.array(moment.jammers, float).reshape(-1, 2)))
        return [self._discs]


class Targets:
    """Hollow diamonds, so that they are not taken for nodes, and where they were."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout = layout
        self._half = max(0.5 * node_radius_px(layout, cast), 0.5 * layout.font_px)
        self._trails = Strokes(look.target_trail, 0.1 * layout.font_px)
        self._outlines = Strokes(look.target, 0.16 * layout.font_px)

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        at = self._layout.px(np.array(list(moment.targets.values()), float).reshape(-1, 2))
        trails = self._trails.having([self._layout.px(trail) for trail in moment.target_trails.values()])
        return [trails, self._outlines.having(shapes.diamonds(at, self._half))]


class Estimates:
    """Discs with their two-sigma ellipses, and where they were."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout = layout
        self._trails = Strokes(look.trail, 0.1 * layout.font_px)
        self._ellipses = Strokes(look.estimate, 0.09 * layout.font_px)
        self._rims, self._discs = dots(axes), dots(axes)
        for each, colour, size in ((self._rims, look.ground, 0.8), (self._discs, look.estimate, 0.58)):
            each.set_facecolor(colour)
            each.set_sizes([(size * layout.font_px) ** 2])

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        told = list(moment.estimates.values())
        at = self._layout.px(np.array([(each.x_m, each.y_m) for each in told], float).reshape(-1, 2))
        for each in (self._rims, self._discs):
            each.set_offsets(at)
        known = [each for each in told if len(each.covariance_m2) == 3]
        outlines = [shapes.ellipse_m(each.x_m, each.y_m, np.asarray(each.covariance_m2)) for each in known]
        ellipses = self._ellipses.having([self._layout.px(outline) for outline in outlines])
        trails = self._trails.having([self._layout.px(trail) for trail in moment.trails.values()])
        return [trails, ellipses, self._rims, self._discs]


class Groups:
    """Hulls around the sensors whose readings a leader used, in the colour of its track; broader for a joint group."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._look, self._cast = layout, look, cast

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        at = self._layout.px(self._cast.motion.snapshot(moment.time_ns))
        margin = _GROUP_MARGIN * node_radius_px(self._layout, self._cast)
        font = self._layout.font_px
        return [
            Strokes(self._look.track(track), (0.28 if joint else 0.16) * font).having(
                [shapes.hull(at[list(rows)], margin)]
            )
            for track, (rows, joint) in moment.groups.items()
        ]


class Clouds:
    """Beliefs as particles in the colour of their track, larger by weight."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._look = layout, look
        self._dots = dots(axes)
        self._shown: list[int] = []

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date, if the clouds are not those of the picture before."""
        if not moment.particles:
            return []
        shown = [id(event) for event, _ in moment.particles.values()]
        if shown != self._shown:
            self._shown = shown
            self._fill(moment)
        return [self._dots]

    def _fill(self, moment: Moment) -> None:
        places: list[Places] = []
        sizes, colours = [], []
        for track, (event, position) in moment.particles.items():
            weight = np.asarray(event.weight, float)
            own = slice(position * len(weight), (position + 1) * len(weight))
            places.append(np.column_stack([np.asarray(event.x_m, float)[own], np.asarray(event.y_m, float)[own]]))
            share = np.sqrt(weight / max(float(weight.max(initial=0.0)), 1e-30))
            sizes.append(self._layout.font_px * np.maximum(_LEAST, _MOST * share))
            colours.append(np.tile([*self._look.track(track)[:3], 0.75], (len(weight), 1)))
        self._dots.set_offsets(self._layout.px(np.concatenate(places)))
        self._dots.set_sizes(np.concatenate(sizes) ** 2)
        self._dots.set_facecolor(np.concatenate(colours))


class Beliefs:
    """Grids of cells coloured by their probability over that of the most probable one; pale if all are equal."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._axes, self._layout, self._look = axes, layout, look
        self._images: dict[Line, AxesImage] = {}
        self._shown: dict[Line, Belief] = {}

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date; an image that shows the same belief as before stays."""
        for line, belief in moment.beliefs.items():
            if self._shown.get(line) is not belief:
                self._shown[line] = belief
                self._fill(line, belief)
        return [self._images[line] for line in moment.beliefs]

    def _fill(self, line: Line, belief: Belief) -> None:
        cell, chance = np.asarray(belief.cell, np.int64), np.asarray(belief.probability, float)
        rows = int(cell.max(initial=0)) // belief.columns + 1
        share = chance / max(float(chance.max(initial=0.0)), 1e-300)
        is_blank = len(share) > 1 and float(np.ptp(share)) == 0.0
        picture = np.zeros((rows * belief.columns, 4))
        picture[cell] = self._look.cells(share * style.UNIFORM_BELIEF if is_blank else share)
        corner = np.array([belief.origin_x_m, belief.origin_y_m])
        (left, low), (right, high) = self._layout.px(
            np.stack([corner, corner + belief.cell_m * np.array([belief.columns, rows])])
        )
        if line not in self._images:
            self._images[line] = self._axes.imshow(
                picture.reshape(rows, -1, 4), origin="lower", interpolation="nearest", animated=True, aspect="auto"
            )
        self._images[line].set_data(picture.reshape(rows, belief.columns, 4))
        self._images[line].set_extent((left, right, low, high))
