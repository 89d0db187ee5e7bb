"""Messages in the air as arrows that grow from sender to receiver; what is lost ends in a cross on the way."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from netsim.movie import shapes
from netsim.movie.actors import lines
from netsim.movie.cast import Cast, Places
from netsim.movie.layout import Layout
from netsim.movie.look import Colour, Look
from netsim.movie.story import Story
from netsim.replay.flights import Rows
from netsim.replay.flying import ACKS, FIRST_KIND, INTERFERED, LOST, LOST_ACKS, shafts

_KIND, _BROADCAST, _LOSS, _ACK = 0.2, 0.12, 0.13, 0.07  # widths in heights of the font
_CROSS = 0.34
_CROWDED_NODES = 100
_CROWDED = 0.75


class Messages:
    """The arrows of a picture."""

    def __init__(self, axes: Axes, layout: Layout, look: Look, cast: Cast, story: Story) -> None:
        self._layout, self._look, self._cast, self._story = layout, look, cast, story
        self._size = layout.font_px * (_CROWDED if cast.size > _CROWDED_NODES else 1.0)
        self._shafts, self._crosses = lines(axes, 1.0), lines(axes, _LOSS * self._size)
        self._shafts.set_capstyle("butt")
        self._heads = PolyCollection([], edgecolors="none", animated=True)
        axes.add_collection(self._heads, autolim=False)

    def show(self, picture: int) -> Sequence[Artist]:
        """Bring it up to date; what is to be drawn, from below."""
        parts = sorted(self._story.air(picture), key=lambda rows: _height(rows.layer))
        parts = [rows for rows in parts if len(rows.reach)]
        if not parts:
            return []
        arrows = [self._arrows(rows) for rows in parts]
        self._shafts.set_segments([shaft for shaft, _, _, _ in arrows for shaft in shaft])
        self._shafts.set_color([colour for _, _, colours, _ in arrows for colour in colours])
        self._shafts.set_linewidths(np.concatenate([widths for _, _, _, widths in arrows]))
        whole = [(heads, colours) for (_, heads, colours, _), rows in zip(arrows, parts, strict=True) if _whole(rows)]
        self._heads.set_verts([head for heads, _ in whole for head in heads])
        self._heads.set_facecolor([colour for _, colours in whole for colour in colours] or "none")
        self._set_crosses(parts)
        return [self._shafts, self._heads, self._crosses]

    def _arrows(self, rows: Rows) -> tuple[Places, Places, list[Colour], np.ndarray]:
        origins, vectors = self._ways(rows)
        colour, width = self._style(rows.layer)
        widths = np.full(len(origins), width)
        shaft, heads = shapes.arrows(origins, vectors, widths)
        if not _whole(rows):
            shaft = np.stack([origins, origins + vectors], axis=1)
        return shaft, heads, [colour] * len(origins), widths

    def _ways(self, rows: Rows) -> tuple[Places, Places]:
        origins, vectors = shafts(self._cast.motion, self._cast.radius_m, rows)
        return self._layout.px(origins), vectors * self._layout.px_per_m

    def _set_crosses(self, parts: Sequence[Rows]) -> None:
        lost = [(rows, sum(self._ways(rows))) for rows in parts if rows.layer in (LOST, INTERFERED)]
        self._crosses.set_segments(
            [stroke for _, ends in lost for stroke in shapes.crosses(ends, _CROSS * self._size)]
        )
        self._crosses.set_color(
            [self._style(rows.layer)[0] for rows, ends in lost for _ in range(2 * len(ends))] or "none"
        )

    def _style(self, layer: int) -> tuple[Colour, float]:
        """Colour and width in pixels."""
        look, size = self._look, self._size
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
            colour, width = look.kind(kind), _BROADCAST if is_broadcast else _KIND
        return colour, max(width * size, 0.8)


def _whole(rows: Rows) -> bool:
    """Whether arrows of this layer have heads."""
    return rows.layer >= FIRST_KIND


def _height(layer: int) -> tuple[int, int]:
    """Acknowledgements lie lowest, then broadcasts, other messages, losses."""
    if layer in (ACKS, LOST_ACKS):
        return 0, layer
    if layer >= FIRST_KIND:
        return 2 - (layer - FIRST_KIND) % 2, layer
    return 3, layer

