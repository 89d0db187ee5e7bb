"""How things look: colours, sizes on screen, what lies above what.

Red and grey are kept for losses, so a message kind has neither.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Rgba = tuple[int, int, int, int]
Colours = NDArray[np.uint8]

# Told apart on black and by most colour-blind eyes (after Okabe and Ito, 2008, without its red and greys).
KIND_COLOURS: tuple[Rgba, ...] = (
    (86, 180, 233, 255),
    (255, 194, 61, 255),
    (0, 200, 140, 255),
    (224, 135, 200, 255),
    (158, 140, 255, 255),
    (240, 228, 66, 255),
    (0, 220, 220, 255),
    (190, 220, 130, 255),
)
LOST: Rgba = (150, 155, 165, 255)
COLLIDED: Rgba = (255, 66, 66, 255)
ACKNOWLEDGEMENT: Rgba = (205, 255, 235, 255)
# Widths of arrows, negative for points on screen.
KIND_WIDTH = -2.4
COLLIDED_WIDTH = -2.2
LOST_WIDTH = -1.6
ACK_WIDTH = -0.7
FIELD: Rgba = (70, 78, 92, 255)
MODEL: Rgba = (62, 52, 110, 255)
VARIABLE: Rgba = (140, 115, 235, 255)
LABEL: Rgba = (205, 212, 222, 255)
TARGET: Rgba = (255, 205, 170, 255)
ESTIMATE: Rgba = (255, 70, 220, 255)
ESTIMATE_DIM: Rgba = (255, 70, 220, 150)
TRAIL: Rgba = (255, 150, 235, 255)
TARGET_DIM: Rgba = (190, 150, 125, 255)
LEADER: Rgba = (255, 255, 255, 255)
NEIGHBOUR: Rgba = (165, 175, 190, 255)
SENSOR_COLOURS: dict[str, Rgba] = {"amplitude": (245, 179, 1, 255), "bearing": (63, 190, 235, 255)}
UNIFORM_BELIEF = 0.02
"""Probability, over that of the most probable cell, as which cells are drawn that are all equally probable."""
ASLEEP: Rgba = (110, 125, 210, 255)
DEAD: Rgba = (38, 40, 46, 255)
CRASHED: Rgba = (235, 240, 250, 255)
ROUTE: Rgba = (105, 125, 215, 255)
WAY: Rgba = (70, 100, 130, 255)
FAULT: Rgba = (255, 120, 40, 255)
JAMMER: Rgba = (255, 66, 66, 170)
RIM: Rgba = (10, 12, 16, 255)
SINK_RIM: Rgba = (235, 240, 250, 255)
ROLE_COLOURS: dict[str, Rgba] = {"sink": (90, 170, 255, 255), "sensor": (120, 200, 190, 255)}
BACKGROUND: Rgba = (13, 16, 20, 255)
LEAST: Rgba = (240, 90, 80, 255)
MEAN: Rgba = (240, 200, 80, 255)
MOST: Rgba = (90, 200, 120, 255)

# The view of the graphical model.
FLOW_COLOURS: dict[str, Rgba] = {
    "sends": (86, 180, 233, 255),
    "wakes": (255, 140, 50, 255),
    "fell silent": (44, 84, 112, 255),
    "silent": (52, 57, 66, 255),
}
FLOW_WAKES: Rgba = FLOW_COLOURS["wakes"]
FLOW_EDGE: Rgba = (58, 64, 76, 255)
FLOW_LABEL_DROP = 1.3

RADIO_COLOURS: dict[str, Rgba] = {
    "off": (30, 32, 38, 255),
    "sleep": (52, 62, 110, 255),
    "listen": (38, 58, 68, 255),
    "receive": (64, 170, 120, 255),
    "captured": COLLIDED,
    "jammed": COLLIDED,
    "outage": LOST,
    "corrupted": LOST,
    "crashed": (96, 66, 30, 255),
    "transmit": (255, 170, 50, 255),
    "switch": (110, 110, 120, 255),
    "collided": COLLIDED,
    "dead": (70, 20, 24, 255),
    "idle": (72, 84, 136, 255),
}

# Higher is nearer to the eye.
_LAYERS = (
    "field",
    "beliefs",
    "ways",
    "links",
    "routes",
    "model",
    "groups",
    "particles",
    "targets",
    "acks",
    "messages",
    "losses",
    "faults",
    "sensors",
    "rims",
    "nodes",
    "dead",
    "leaders",
    "trails",
    "estimates",
    "legend",
)
ORDER = {name: float(10 * rank) for rank, name in enumerate(_LAYERS)}

_ENERGY_STOPS = np.array([(214, 48, 49), (240, 200, 60), (46, 190, 96)], float)
_BELIEF_STOPS = np.array([(70, 42, 130), (150, 50, 140), (225, 85, 90), (255, 200, 110)], float)
_BELIEF_ALPHA = (70.0, 215.0)
_PRR_STOPS = np.array([(105, 40, 35), (88, 80, 32), (36, 84, 52)], float)


def shade(fraction: NDArray[np.float64], stops: NDArray[np.float64], alpha: int) -> Colours:
    """Colours between `stops` for fractions in [0, 1]; shape (n, 4)."""
    places = np.linspace(0.0, 1.0, len(stops))
    channels = [np.interp(fraction, places, stops[:, channel]) for channel in range(3)]
    return np.stack([*channels, np.full(len(fraction), alpha)], axis=1).astype(np.uint8)


def energy_colours(fraction: NDArray[np.float64]) -> Colours:
    """Red when empty over yellow to green when full; shape (n, 4)."""
    return shade(fraction, _ENERGY_STOPS, 255)


def belief_colours(share: NDArray[np.float64]) -> Colours:
    """Dim violet over red to bright yellow for probabilities over the greatest one; shape (n, 4).

    By the square root, so that unlikely cells are seen too.
    """
    root = np.sqrt(np.clip(share, 0.0, 1.0))
    colours = shade(root, _BELIEF_STOPS, 255)
    colours[:, 3] = np.interp(root, (0.0, 1.0), _BELIEF_ALPHA).astype(np.uint8)
    return colours


def prr_colours(prr: NDArray[np.float64]) -> Colours:
    """Dim red for a bad link to dim green for a good one; shape (n, 4)."""
    return shade(prr, _PRR_STOPS, 255)


def role_colours(roles: Sequence[str]) -> Colours:
    """The colours of nodes on mains power; shape (n, 4)."""
    return np.array([ROLE_COLOURS.get(role, ROLE_COLOURS["sensor"]) for role in roles], np.uint8).reshape(-1, 4)


def kind_colour(position: int) -> Rgba:
    """The colour of the n-th message kind that is met, and of the track and the target of a number."""
    return KIND_COLOURS[position % len(KIND_COLOURS)]


def dim(colour: Rgba) -> Rgba:
    """A colour half as bright."""
    red, green, blue, opacity = colour
    return red // 2, green // 2, blue // 2, opacity
