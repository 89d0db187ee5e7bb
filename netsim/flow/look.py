"""How the picture of an information flow looks; blue and orange are told apart by most colour-blind eyes."""

from collections.abc import Mapping
from typing import Any

SENDS = "#0072B2"
WAKES = "#D55E00"
SILENT_FILL, SILENT_EDGE = "#f4f6f8", "#b9c2cc"
FELL_SILENT = "#8a96a3"
EDGE = "#e0e5ea"
INK, SOFT, GRID = "#1c2430", "#5a6675", "#dde2e8"

MARK_PT = 13.0
"""Greatest diameter of a vertex, in points."""
LABEL_PT = 5.6
"""Size of a vertex's name in a mark of that diameter."""
LEAST_LABEL_PT = 3.4
"""Smaller names are left out."""

RC: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": SOFT,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "svg.hashsalt": "netsim",
    "svg.fonttype": "path",
    "savefig.dpi": 150,
}
"""Settings of matplotlib while a picture is drawn or written."""
