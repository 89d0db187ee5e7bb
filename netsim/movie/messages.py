"""Messages in the air as arrows that grow from sender to receiver; what is lost ends in a cross on the way."""

from collections.abc import Iterator

import numpy as np

from netsim.movie import shapes
from netsim.movie.cast import Cast
from netsim.movie.ink import Areas, Drawn, Strokes
from netsim.movie.layout import Layout
from netsim.movie.look import Colour, Look
from netsim.movie.scenery import node_radius_px
from netsim.movie.story import Story
from netsim.replay.flights import Rows
from netsim.replay.flying import ACKS, FIRST_KIND, INTERFERED, LOST, LOST_ACKS, shafts

_KIND, _BROADCAST, _LOSS, _ACK = 0.2, 0.13, 0.13, 0.08  # widths in heights of the font
_CROSS = 0.34
_CROWDED_NODES = 100
_CROWDED = 0.75
_MANY_BROADCASTS, _MANY_ARROWS = 60, 250  # of more at once the arrows are thin and pale
_PALE = 0.6
_STEPS = 24  # of an arrow's way that are told apart


class Messages:
    """The arrows of a picture."""

    def __init__(self, layout: Layout, look: Look, cast: Cast, story: Story) -> None:
        self._layout, self._look, self._cast, self._story = layout, look, cast, story
        self._radius_m = node_radius_px(layout, cast) / layout.px_per_m
        self._size = layout.font_px * (_CROWDED if cast.size > _CROWDED_NODES else 1.0)

    def show(self, picture: int) -> Iterator[Drawn]:
        """What is to be drawn, from below."""
        for rows in sorted(self._story.air(picture), key=lambda rows: _height(rows.layer)):
            if len(rows.reach):
                yield from self._arrows(_distinct(rows))

    def _arrows(self, rows: Rows) -> Iterator[Drawn]:
        origins_m, vectors_m = shafts(self._cast.motion, self._radius_m, rows)
        origins, vectors = self._layout.px(origins_m), vectors_m * self._layout.px_per_m
        colour, width = self._style(rows.layer, len(origins))
        if rows.layer >= FIRST_KIND:
            lines, heads = shapes.arrows(origins, vectors, np.full(len(origins), width))
            yield Strokes(colour, width, "butt").having(lines)
            yield Areas(colour).having(heads)
            return
        ends = origins + vectors
        yield Strokes(colour, width).having(np.stack([origins, ends], axis=1))
        if rows.layer in (LOST, INTERFERED):
            yield Strokes(colour, 1.2 * width).having(shapes.crosses(ends, _CROSS * self._size))

    def _style(self, layer: int, count: int) -> tuple[Colour, float]:
        """Colour and width in pixels."""
        look = self._look
        fixed = {
            LOST: (look.lost, _LOSS),
            INTERFERED: (look.collided, _LOSS),
            LOST_ACKS: (look.lost, _ACK),
            ACKS: (look.acknowledgement, _ACK),
        }
        if layer in fixed:
            colour, width = fixed[layer]
        else:
            kind, is_broadcast = divmod(layer - FIRST_KIND, 2)
            colour, width = look.kind(self._story.places[kind]), _BROADCAST if is_broadcast else _KIND
            if count > (_MANY_BROADCASTS if is_broadcast else _MANY_ARROWS):
                colour, width = (*colour[:3], _PALE), _PALE * width
        return colour, max(width * self._size, 0.7)


def _distinct(rows: Rows) -> Rows:
    """Without arrows that would hide each other: in a fast movie the same link may be used hundreds of times."""
    flights = rows.flights
    keys = np.column_stack([flights.tail, flights.head, np.ceil(_STEPS * rows.reach).astype(np.int64)])
    kept = np.sort(np.unique(keys, axis=0, return_index=True)[1])
    return Rows(rows.layer, rows.time_ns, np.array([len(kept)]), flights.pick(kept), rows.reach[kept])


def _height(layer: int) -> tuple[int, int]:
    """Acknowledgements lie lowest, then broadcasts, other messages, losses."""
    if layer in (ACKS, LOST_ACKS):
        return 0, layer
    if layer >= FIRST_KIND:
        return 2 - (layer - FIRST_KIND) % 2, layer
    return 3, layer
