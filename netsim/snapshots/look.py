"""How snapshots look: the paper's signs (Fig. 8), in colours that show on white and are told apart by most eyes."""

from typing import Final

AMPLITUDE: Final = "#F5B301"
BEARING: Final = "#3FA7E0"
SENSOR_EDGE: Final = "#4a4a4a"
LEADER: Final = "#C2187A"
NEIGHBOUR: Final = "#0A8F5B"
TARGET: Final = "#D7191C"
TRAIL: Final = "#111827"
LINES: Final = (TRAIL, "#C4650A", "#2F6FB0", "#7A7F87")
"""Of the errors of several tracks or threads, in the order in which they began."""
DOWN: Final = "#6b7280"
CENTRE: Final = "#111827"
CELLS: Final = ("#ffffff", "#dcd9ec", "#a9a3cf", "#6a5fae", "#3a2a7c", "#1c0f4d")
"""From no probability to that of the most probable cell."""
SPREAD: Final = "#a9a3cf"
OUTAGE: Final = "#D7191C"
TRACKS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A5C3E", "#5B5BD6")
"""Of targets and tracks by number; a track and the target that it began with have the same one."""
JOINT: Final = "#6b7280"
WORD: Final = "#5B21B6"
QUIET_SENSOR: Final = "#b9c2cc"


def track_colour(number: int) -> str:
    """The colour of a track or target."""
    return TRACKS[number % len(TRACKS)]
