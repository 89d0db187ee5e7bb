"""What is told of targets: where they are, estimates, groups of sensors, and beliefs as cells and as particles."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from netsim.movie import shapes
from netsim.movie.cast import Cast, Places
from netsim.movie.ink import Drawn, Strokes, dots
from netsim.movie.layout import Layout
from netsim.movie.look import Colour, Look
from netsim.movie.scenery import node_radius_px
from netsim.movie.state import Line, Moment
from netsim.replay import style
from netsim.trace.events import Belief

_PALE = 0.4
_LEAST, _MOST = 0.17, 0.75  # diameters of particles in heights of the font: without weight, of the heaviest
_GROUP_MARGIN = 1.9  # node radii between a member and the hull


class Targets:
    """Hollow diamonds, so that they are not taken for nodes, and where they were."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._look, self._has_colours = layout, look, cast.has_track_colours
        self._half = max(0.5 * node_radius_px(layout, cast), 0.5 * layout.font_px)

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        font, px = self._layout.font_px, self._layout.px
        trails = {target: px(trail) for target, trail in moment.target_trails.items()}
        outlines = {
            target: shapes.diamonds(px(np.array([place])), self._half)[0] for target, place in moment.targets.items()
        }
        drawn = _by_colour(trails, self._trail_colour, 0.1 * font)
        return drawn + _by_colour(outlines, self._colour, 0.16 * font)

    def _colour(self, target: int) -> Colour:
        return self._look.track(target) if self._has_colours else self._look.target

    def _trail_colour(self, target: int) -> Colour:
        """Paler than that of a track."""
        return (*self._look.track(target)[:3], _PALE) if self._has_colours else self._look.target_trail


class Estimates:
    """Discs with their two-sigma ellipses, and where they were."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast) -> None:
        self._layout, self._look, self._has_colours = layout, look, cast.has_track_colours
        self._rims, self._discs = dots(axes), dots(axes)
        self._rims.set_facecolor(look.ground)
        for each, size in ((self._rims, 0.8), (self._discs, 0.58)):
            each.set_sizes([(size * layout.font_px) ** 2])

    def show(self, moment: Moment) -> Sequence[Drawn]:
        """Bring it up to date."""
        font, px, told = self._layout.font_px, self._layout.px, moment.estimates
        at = px(np.array([(each.x_m, each.y_m) for each in told.values()], float).reshape(-1, 2))
        for discs in (self._rims, self._discs):
            discs.set_offsets(at)
        self._discs.set_facecolor([self._colour(line, self._look.estimate) for line in told] or "none")
        ellipses = {
            line: px(shapes.ellipse_m(each.x_m, each.y_m, np.asarray(each.covariance_m2)))
            for line, each in told.items()
            if len(each.covariance_m2) == 3
        }
        trails = {line: px(trail) for line, trail in moment.trails.items()}
        drawn = _by_colour(trails, lambda line: self._colour(line, self._look.trail), 0.1 * font)
        drawn += _by_colour(ellipses, lambda line: self._colour(line, self._look.estimate), 0.09 * font)
        return [*drawn, self._rims, self._discs]

    def _colour(self, line: Line, usual: Colour) -> Colour:
        return (*self._look.track(line[0])[:3], usual[3]) if self._has_colours else usual


def _by_colour(outlines: Mapping[Any, Places], colour: Callable[[Any], Colour], width_px: float) -> list[Drawn]:
    """Lines of one width, all of one colour together."""
    found: dict[Colour, list[Places]] = {}
    for name, outline in outlines.items():
        found.setdefault(colour(name), []).append(outline)
    return [Strokes(each, width_px).having(some) for each, some in found.items()]


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
