"""Colours of a movie on a dark and on a light ground, as fractions for matplotlib; sizes follow the picture's width."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from netsim.replay import style

Colour = tuple[float, float, float, float]
Colours = NDArray[np.float64]


def _c(red: int, green: int, blue: int, alpha: int = 255) -> Colour:
    return red / 255, green / 255, blue / 255, alpha / 255


def _like(colour: style.Rgba, alpha: int | None = None) -> Colour:
    red, green, blue, own = colour
    return _c(red, green, blue, own if alpha is None else alpha)


@dataclass(frozen=True)
class Look:
    """The colours.

    Attributes:
        kinds: Of message kinds, in the order in which they are met.
        tracks: Of particles and groups, by number of the track.
        prr: Stops for links from bad to good.
        belief: Stops for cells from improbable to most probable, with opacity.
        roles: Of nodes on mains power: sink, others.
    """

    ground: Colour
    ink: Colour
    soft: Colour
    field: Colour
    strip: Colour
    rim: Colour
    sink_rim: Colour
    dead: Colour
    crashed: Colour
    leader: Colour
    target: Colour
    target_trail: Colour
    estimate: Colour
    trail: Colour
    fault: Colour
    jammer: Colour
    lost: Colour
    collided: Colour
    acknowledgement: Colour
    kinds: tuple[Colour, ...]
    tracks: tuple[Colour, ...]
    prr: tuple[Colour, ...]
    belief: tuple[Colour, ...]
    roles: tuple[Colour, Colour]

    def kind(self, number: int) -> Colour:
        """The colour of a message kind."""
        return self.kinds[number % len(self.kinds)]

    def track(self, number: int) -> Colour:
        """The colour of a track's particles and group."""
        return self.tracks[number % len(self.tracks)]

    def links(self, prr: NDArray[np.float64]) -> Colours:
        """Of links by reception ratio; shape (n, 4)."""
        return _between(self.prr, prr)

    def cells(self, share: NDArray[np.float64]) -> Colours:
        """Of cells by probability over the greatest one; by the square root, so that unlikely ones are seen too."""
        return _between(self.belief, np.sqrt(np.clip(share, 0.0, 1.0)))


def _between(stops: tuple[Colour, ...], fraction: NDArray[np.float64]) -> Colours:
    places = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(fraction, places, channel) for channel in np.array(stops).T], axis=-1)


def charge_colours(fraction: NDArray[np.float64]) -> Colours:
    """Red when empty over yellow to green when full; shape (n, 4)."""
    return style.energy_colours(fraction) / 255.0


_DARK_KINDS = tuple(_like(colour) for colour in style.KIND_COLOURS)
DARK = Look(
    ground=_like(style.BACKGROUND), ink=_c(232, 237, 244), soft=_c(150, 160, 175), field=_like(style.FIELD),
    strip=_c(24, 29, 37), rim=_like(style.RIM), sink_rim=_like(style.SINK_RIM), dead=_c(48, 51, 58),
    crashed=_like(style.CRASHED), leader=_like(style.LEADER), target=_like(style.TARGET),
    target_trail=_like(style.TARGET_DIM, 190), estimate=_like(style.ESTIMATE), trail=_like(style.ESTIMATE, 150),
    fault=_like(style.FAULT), jammer=_like(style.JAMMER), lost=_like(style.LOST), collided=_like(style.COLLIDED),
    acknowledgement=_like(style.ACKNOWLEDGEMENT), kinds=_DARK_KINDS, tracks=_DARK_KINDS,
    prr=(_c(105, 40, 35), _c(88, 80, 32), _c(36, 84, 52)),
    belief=(_c(70, 42, 130, 60), _c(150, 50, 140, 130), _c(225, 85, 90, 185), _c(255, 200, 110, 225)),
    roles=(_c(90, 170, 255), _c(120, 200, 190)),
)  # fmt: skip

# After Okabe and Ito (2008), dark enough for thin lines on white.
_LIGHT_KINDS = (
    _c(0, 114, 178), _c(224, 130, 0), _c(0, 140, 100), _c(190, 80, 150), _c(98, 76, 200), _c(140, 120, 0),
    _c(0, 150, 165), _c(104, 140, 40),
)  # fmt: skip
LIGHT = Look(
    ground=_c(255, 255, 255), ink=_c(28, 36, 48), soft=_c(90, 102, 117), field=_c(196, 203, 212),
    strip=_c(243, 245, 248), rim=_c(255, 255, 255), sink_rim=_c(28, 36, 48), dead=_c(186, 192, 200),
    crashed=_c(28, 36, 48), leader=_c(28, 36, 48), target=_c(150, 70, 10), target_trail=_c(190, 140, 100, 210),
    estimate=_c(200, 0, 160), trail=_c(200, 0, 160, 150), fault=_c(225, 85, 0), jammer=_c(215, 25, 28, 130),
    lost=_c(140, 147, 158), collided=_c(215, 25, 28), acknowledgement=_c(120, 190, 165), kinds=_LIGHT_KINDS,
    tracks=_LIGHT_KINDS, prr=(_c(238, 180, 172), _c(228, 214, 150), _c(176, 214, 188)),
    belief=(_c(220, 217, 236, 90), _c(169, 163, 207, 170), _c(106, 95, 174, 205), _c(40, 24, 100, 225)),
    roles=(_c(30, 110, 210), _c(60, 150, 140)),
)  # fmt: skip

RC: dict[str, Any] = {"font.family": "DejaVu Sans", "text.antialiased": True, "path.simplify": True}
"""Settings of matplotlib while a movie is drawn."""
