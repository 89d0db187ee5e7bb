"""Outlines that the pictures are drawn of, in pixels."""

import numpy as np
import shapely
from numpy.typing import NDArray

from netsim.movie.cast import Places

_TURN = np.linspace(0.0, 2 * np.pi, 49)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])
_SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
_DIAMOND = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
_CROSS = np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
_SIGMAS = 2.0  # estimates are drawn with their two-sigma ellipse
_HEAD = 3.1  # length of an arrow's head in widths of its shaft, besides a few pixels
_HALF_HEAD = 0.42
_QUARTER_SEGMENTS = 6


def circles(middles: Places, radius: float) -> Places:
    """Closed outlines; shape (n, 49, 2)."""
    return middles[:, None] + radius * _CIRCLE


def squares(middles: Places, half: float) -> Places:
    """Closed outlines of upright squares; shape (n, 5, 2)."""
    return middles[:, None] + half * _SQUARE


def diamonds(middles: Places, half: float) -> Places:
    """Closed outlines of squares that stand on a corner; shape (n, 5, 2)."""
    return middles[:, None] + half * _DIAMOND


def crosses(middles: Places, half: NDArray[np.float64] | float) -> Places:
    """Two strokes each; shape (2 n, 2, 2)."""
    halves = np.broadcast_to(half, len(middles))
    strokes: Places = (middles[:, None, None] + halves[:, None, None, None] * _CROSS).reshape(-1, 2, 2)
    return strokes


def ellipse_m(x_m: float, y_m: float, covariance_m2: NDArray[np.float64]) -> Places:
    """Closed outline of the two-sigma ellipse of a covariance xx, xy, yy; shape (49, 2)."""
    xx, xy, yy = covariance_m2
    values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    axes = vectors * np.sqrt(np.maximum(values, 0.0))
    outline: Places = np.array([x_m, y_m]) + _SIGMAS * _CIRCLE @ axes.T
    return outline


def hull(places: Places, margin: float) -> Places:
    """Closed outline around some places, at a distance from them; shape (n, 2)."""
    around = shapely.MultiPoint(places).convex_hull.buffer(margin, _QUARTER_SEGMENTS)
    return np.asarray(shapely.get_coordinates(around.exterior))


def arrows(tails: Places, vectors: Places, widths: NDArray[np.float64]) -> tuple[Places, Places]:
    """Shafts, shape (n, 2, 2), and heads, shape (n, 3, 2), of arrows.

    The head takes no more than what there is of the arrow.
    """
    length = np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)
    unit = vectors / length[:, None]
    head = np.minimum(_HEAD * widths + 3.0, length)[:, None]
    tips = tails + vectors
    necks = tips - head * unit
    aside = _HALF_HEAD * head * np.column_stack([-unit[:, 1], unit[:, 0]])
    return np.stack([tails, necks + 0.3 * head * unit], axis=1), np.stack([tips, necks + aside, necks - aside], axis=1)
