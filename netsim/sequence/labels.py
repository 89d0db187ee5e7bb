"""Room for labels: each goes where none is yet, shortened or left out where there is no room."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from netsim.sequence.ink import width_of

SIZE = 9.5
ABOVE = 4.4
GAP = 9.0  # between a label and the ends of its arrow
_PLACES = (0.5, 0.34, 0.66, 0.2, 0.8)
_BAND = 40.0

Box = tuple[float, float, float, float]
"""Left, top, right, bottom."""


@dataclass(frozen=True)
class Label:
    """A text along an arrow.

    Attributes:
        text: What it says.
        x: Where its middle is.
        y: Where its base line is.
        angle: In degrees, clockwise.
    """

    text: str
    x: float
    y: float
    angle: float


class Room:
    """Keeps where labels are."""

    def __init__(self) -> None:
        self._taken: dict[int, list[Box]] = {}

    def along(self, start: tuple[float, float], end: tuple[float, float], texts: Sequence[str]) -> Label | None:
        """A label above an arrow, in the first of some wordings that there is room for.

        Args:
            start: One end of the arrow.
            end: The other end.
            texts: The wordings, the one that is liked best first.
        """
        (x0, y0), (x1, y1) = (start, end) if start[0] <= end[0] else (end, start)
        length = math.dist(start, end)
        angle = math.atan2(y1 - y0, x1 - x0)
        for text in texts:
            wide = width_of(text, SIZE)
            if wide > length - 2 * GAP:
                continue
            slack = (wide / 2 + GAP) / length
            for place in _PLACES:
                share = min(max(place, slack), 1.0 - slack)
                x = x0 + share * (x1 - x0) + ABOVE * math.sin(angle)
                y = y0 + share * (y1 - y0) - ABOVE * math.cos(angle)
                if self.take(_box(x, y, wide, angle)):
                    return Label(text, x, y, math.degrees(angle))
        return None

    def take(self, box: Box) -> bool:
        """Take a box if it is free; whether it was."""
        left, top, right, bottom = box
        bands = range(int(top // _BAND), int(bottom // _BAND) + 1)
        for band in bands:
            for l2, t2, r2, b2 in self._taken.get(band, ()):
                if left < r2 and l2 < right and top < b2 and t2 < bottom:
                    return False
        for band in bands:
            self._taken.setdefault(band, []).append(box)
        return True


def _box(x: float, y: float, wide: float, angle: float) -> Box:
    """Around a text in the middle above a point of its base line."""
    half = wide / 2 * abs(math.cos(angle))
    rise = wide / 2 * abs(math.sin(angle))
    return x - half, y - 0.75 * SIZE - rise, x + half, y + 0.2 * SIZE + rise
