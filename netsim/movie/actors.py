"""What moves in a picture besides messages, part by part: each brings itself up to date. Here those of the nodes."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text

from netsim.movie import shapes
from netsim.movie.cast import Cast
from netsim.movie.ink import Drawn, Strokes, dots
from netsim.movie.layout import Layout
from netsim.movie.look import Look, charge_colours
from netsim.movie.scenery import NAME_DROP, draw_names, node_radius_px
from netsim.movie.state import CRASHED, DEAD, Moment
from netsim.movie.tracks import Beliefs, Clouds, Estimates, Groups, Targets

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
