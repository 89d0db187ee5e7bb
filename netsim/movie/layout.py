"""Where everything is in a picture: a line of title, the map, the legend beside it, a strip with messages per second.

All in pixels from the lower left corner. The strip is below the map; where the map is tall, it is below the legend.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.movie.cast import Cast, Places

_FONT_SHARE, _LEAST_FONT_PX = 72, 9.5
_LEGEND_FONTS = 15.5  # width of the legend in heights of the font
_STRIP_FONTS = 6.2
_HEAD_FONTS = 2.7
_TICK_FONTS = 1.7
ROW_FONTS = 1.75
"""Height of a row of the legend."""
_HIGHEST_STRIP = 13.0
_FOOT_FONTS = 1.9  # below the map, for its scale
_TALLEST, _TALLEST_BESIDE = 0.6, 0.72  # map's height over the picture's width, without and with the strip beside it
_TALL = 1.12  # maps taller than wide by this have the strip at their side


@dataclass(frozen=True)
class Box:
    """A rectangle in pixels."""

    left: float
    low: float
    right: float
    high: float

    @property
    def width(self) -> float:
        """From left to right."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From bottom to top."""
        return self.high - self.low

    def cut(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """This part of a picture, whose first row is at the top."""
        top, bottom = (len(pixels) - round(y) for y in (self.high, self.low))
        return pixels[top:bottom, round(self.left) : round(self.right)]


@dataclass(frozen=True)
class Layout:
    """The boxes of a picture.

    Attributes:
        width_px: Width of the picture, even.
        height_px: Height of the picture, even.
        font_px: Size of the text.
        field: The map.
        legend: The legend.
        strip: The bars of messages per second, without the labels below.
        head_y: Middle of the title.
        px_per_m: Scale of the map.
        origin_m: What is at the lower left corner of the map.
    """

    width_px: int
    height_px: int
    font_px: float
    field: Box
    legend: Box
    strip: Box
    head_y: float
    px_per_m: float
    origin_m: Places

    def px(self, places_m: Places) -> Places:
        """Places on the map in pixels; shape (..., 2)."""
        return np.asarray((places_m - self.origin_m) * self.px_per_m + np.array([self.field.left, self.field.low]))


def lay_out(cast: Cast, width_px: int, legend_rows: int) -> Layout:
    """Fit the map of a cast, and so many rows of a legend, into a picture of some width."""
    width = width_px - width_px % 2
    font = max(_LEAST_FONT_PX, width / _FONT_SHARE)
    low, high = cast.outline()
    wide_m, tall_m = (float(side) for side in high - low)
    is_tall = tall_m > _TALL * wide_m
    inner = width - (_LEGEND_FONTS + 3.4) * font
    legend_px = (legend_rows + 0.5) * ROW_FONTS * font
    beside_px = legend_px + (_STRIP_FONTS + 4.5) * font * is_tall
    tallest = (_TALLEST_BESIDE if is_tall else _TALLEST) * width
    field_px = max(min(tallest, inner * tall_m / wide_m), beside_px)
    px_per_m = min(field_px / tall_m, inner / wide_m)
    floor = (_FOOT_FONTS + (0.0 if is_tall else _STRIP_FONTS + _TICK_FONTS + 0.8)) * font
    height = 2 * round((floor + field_px + _HEAD_FONTS * font) / 2)
    map_px = (wide_m * px_per_m, tall_m * px_per_m)
    left = font + (0.0 if is_tall else (inner - map_px[0]) / 2)
    low_y = floor + (field_px - map_px[1]) / 2
    field = Box(left, low_y, left + map_px[0], low_y + map_px[1])
    column = field.right + 1.6 * font if is_tall else width - (_LEGEND_FONTS + 1.0) * font
    legend = Box(column, floor, width - font, floor + field_px)
    strip = _strip(legend, font, width, field_px - legend_px if is_tall else None)
    head_y = height - 0.52 * _HEAD_FONTS * font
    return Layout(width, height, font, field, legend, strip, head_y, px_per_m, low)


def _strip(legend: Box, font: float, width: float, room_px: float | None) -> Box:
    """The strip's box: along the foot of the picture, or in what room the legend leaves below it."""
    if room_px is None:
        low = (0.6 + _TICK_FONTS) * font
        return Box(3.6 * font, low, width - font, low + _STRIP_FONTS * font)
    low = legend.low + 0.5 * font
    return Box(legend.left + 2.4 * font, low, width - font, low + min(room_px - 4.0 * font, _HIGHEST_STRIP * font))
