"""Who senses next: the utility of each sensor's next reading under different rules (Liu, Reich, Zhao 2002, section 4)."""

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.information import information_bit

SelectionRule = Literal["mutual_information", "nearest", "random"]


def utilities(
    rule: SelectionRule,
    predicted: GridBelief,
    sensors: Mapping[int, SensorSpec],
    rng: np.random.Generator,
    *,
    exact: bool = False,
) -> dict[int, float]:
    """What speaks for each sensor; the greatest is to be chosen, of equals the lowest node.

    `mutual_information`: bits expected of its reading (eq 15). `nearest`: minus its distance from the mean of the belief, in
    metres. `random`: a random number.

    Args:
        rule: The rule.
        predicted: Belief at the time of the next reading, before it.
        sensors: The candidates, by node.
        rng: For `random`.
        exact: See `netsim.kernels.information`.
    """
    if rule == "mutual_information":
        return {node: information_bit(predicted, spec, exact=exact) for node, spec in sorted(sensors.items())}
    if rule == "nearest":
        mean_m = predicted.mean_m
        return {node: -math.dist(spec.position_m, mean_m) for node, spec in sorted(sensors.items())}
    return {node: float(rng.random()) for node in sorted(sensors)}


def best(utility: Mapping[int, float]) -> int:
    """The node of the greatest utility, of equals the lowest."""
    return max(sorted(utility), key=utility.__getitem__)
