"""Distances between two finite sets of points: OSPA and GOSPA, and the assignment that they rest on.

Schuhmacher, Vo, Vo, "A consistent metric for performance evaluation of multi-object filters", IEEE Transactions on Signal
Processing 56 (2008) 3447-3457: OSPA. Rahmathullah, Garcia-Fernandez, Svensson, "Generalized optimal sub-pattern
assignment metric", FUSION 2017: GOSPA with alpha = 2, proposition 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from netsim.kernels.semiring import FloatArray

Pairs = list[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Gospa:
    """A GOSPA distance in its parts; all three are costs, in metres to the power of the order, and add up to its power.

    Attributes:
        localisation: Sum of the distances of assigned points, each to the power p.
        missed: c^p / 2 for each point of the first set that is assigned to none.
        false: The same for each point of the second set.
        order: The order p.
    """

    localisation: float
    missed: float
    false: float
    order: float

    @property
    def distance(self) -> float:
        """The metric itself, in metres."""
        return float((self.localisation + self.missed + self.false) ** (1.0 / self.order))


def distances(one: FloatArray, other: FloatArray) -> FloatArray:
    """Euclidean distances of all pairs of points, shape (m, n), from points of shapes (m, d) and (n, d)."""
    return np.asarray(np.linalg.norm(one[:, None, :] - other[None, :, :], axis=2))


def match(distance: FloatArray, cut_off: float, order: float) -> Pairs:
    """The pairs (row, column) of an optimal assignment that are nearer than the cut-off.

    It minimises the sum of min(distance, cut_off) ** order over the assigned pairs: leaving two points alone costs as much
    as assigning them at the cut-off (GOSPA with alpha = 2).

    Args:
        distance: Of all pairs, shape (m, n); infinity for a pair that must not be.
        cut_off: Above 0.
        order: At least 1.
    """
    rows, columns = linear_sum_assignment(np.minimum(distance, cut_off) ** order)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [(row, column) for row, column in pairs if distance[row, column] < cut_off]


def ospa(one: FloatArray, other: FloatArray, cut_off: float, order: float) -> float:
    """OSPA distance: 0 for equal sets, the cut-off when only one of them is empty.

    With m <= n points: ((sum of min(d, c)^p over an optimal assignment of the m + c^p (n - m)) / n)^(1/p).

    Args:
        one: Points, shape (m, d), in metres.
        other: Points, shape (n, d).
        cut_off: The cut-off c, in metres: what a point without counterpart costs.
        order: The order p, at least 1.
    """
    most = max(len(one), len(other))
    if most == 0:
        return 0.0
    cost = np.minimum(distances(one, other), cut_off) ** order
    total = float(cost[linear_sum_assignment(cost)].sum()) + cut_off**order * abs(len(one) - len(other))
    return float((total / most) ** (1.0 / order))


def gospa(truth: FloatArray, found: FloatArray, cut_off: float, order: float) -> Gospa:
    """GOSPA distance with alpha = 2, in its parts.

    Args:
        truth: Points that are there, shape (m, d), in metres.
        found: Points that were found, shape (n, d).
        cut_off: The cut-off c, in metres: points at least so far apart are no pair.
        order: The order p, at least 1.
    """
    distance = distances(truth, found)
    pairs = match(distance, cut_off, order)
    alone = cut_off**order / 2.0
    return Gospa(
        localisation=float(sum(distance[pair] ** order for pair in pairs)),
        missed=alone * (len(truth) - len(pairs)),
        false=alone * (len(found) - len(pairs)),
        order=order,
    )


def keep_and_match(distance: FloatArray, before: Sequence[tuple[int, int]], cut_off: float, order: float) -> Pairs:
    """Pairs that were there before and are still nearer than the cut-off, then an optimal assignment of the rest.

    Bernardin, Stiefelhagen, "Evaluating multiple object tracking performance: the CLEAR MOT metrics", EURASIP Journal on
    Image and Video Processing 2008.
    """
    kept = [pair for pair in before if distance[pair] < cut_off]
    rest = distance.copy()
    for row, column in kept:
        rest[row, :] = np.inf
        rest[:, column] = np.inf
    return sorted(kept + match(rest, cut_off, order))
