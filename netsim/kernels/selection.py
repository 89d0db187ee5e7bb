"""Who senses next: the utility of each sensor's next reading under different rules (Liu, Reich, Zhao 2002, section 4)."""

import math
from collections.abc import Mapping
from typing import Final, Literal

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.expected_covariance import expected_variance_m2, variance_operations
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.handoff_cost import weighed_j
from netsim.kernels.information import information_bit, information_operations
from netsim.kernels.operations import FUNCTION_OPERATIONS

SelectionRule = Literal[
    "mutual_information", "covariance", "information_less_cost", "information_per_joule", "nearest", "random", "all"
]
PRICED: Final = ("information_less_cost", "information_per_joule")
"""Rules that need the costs of the hand-offs."""
BIT_PER_JOULE: Final = 100.0
"""Default price of energy: handing over a belief of 200 cells costs some 5 mJ at 250 kbit/s, so half a bit."""


def utilities(
    rule: SelectionRule,
    predicted: GridBelief,
    sensors: Mapping[int, SensorSpec],
    rng: np.random.Generator,
    *,
    exact: bool = False,
    costs: Mapping[int, float] | None = None,
    energy_left: Mapping[int, float] | None = None,
    bit_per_joule: float = BIT_PER_JOULE,
) -> dict[int, float]:
    """What speaks for each sensor; the greatest is to be chosen, of equals the lowest node.

    `mutual_information`: bits expected of its reading (eq 15). `all`: the same; all neighbours sense, and this tells who
    leads next. `covariance`: minus the variance to expect after its reading, in square metres. `information_less_cost`: bits
    less the price of the hand-off (the objective of Chu, Haussecker, Zhao 2002, utility less cost), and
    `information_per_joule`: bits over joules, both with joules weighed by how short the sensor's energy is. `nearest`: minus
    its distance from the mean of the belief, in metres. `random`: a random number.

    Args:
        rule: The rule.
        predicted: Belief at the time of the next reading, before it.
        sensors: The candidates, by node.
        rng: For `random`.
        exact: See `netsim.kernels.information`.
        costs: Joules of the hand-off to each candidate, for the rules with a cost.
        energy_left: Share of its energy that each candidate has left, as far as it is known, from 0 to 1.
        bit_per_joule: Price of energy, for `information_less_cost`.

    Raises:
        ValueError: For a rule with a cost where the costs are missing, or are not above 0.
    """
    nodes = sorted(sensors)
    if rule == "nearest":
        mean_m = predicted.mean_m
        return {node: -math.dist(sensors[node].position_m, mean_m) for node in nodes}
    if rule == "random":
        return {node: float(rng.random()) for node in nodes}
    if rule == "covariance":
        return {node: -expected_variance_m2(predicted, sensors[node], exact=exact) for node in nodes}
    bits = {node: information_bit(predicted, sensors[node], exact=exact) for node in nodes}
    if rule not in PRICED:
        return bits
    joules = _weighed(nodes, costs, energy_left)
    if rule == "information_per_joule":
        return {node: bits[node] / joules[node] for node in nodes}
    return {node: bits[node] - bit_per_joule * joules[node] for node in nodes}


def _weighed(
    nodes: list[int], costs: Mapping[int, float] | None, energy_left: Mapping[int, float] | None
) -> dict[int, float]:
    if costs is None or any(not costs.get(node, 0.0) > 0.0 for node in nodes):
        text = f"this rule needs the joules of the hand-off to each of the nodes {nodes}, above 0, got {costs}"
        raise ValueError(text)
    return weighed_j(costs, energy_left)


def best(utility: Mapping[int, float]) -> int:
    """The node of the greatest utility, of equals the lowest."""
    return max(sorted(utility), key=utility.__getitem__)


def choosing_operations(
    rule: SelectionRule, predicted: GridBelief, sensors: Mapping[int, SensorSpec], *, exact: bool = False
) -> int:
    """Elementary floating-point operations of `utilities` on a node; rules without readings take next to none."""
    if rule in ("nearest", "random"):
        return FUNCTION_OPERATIONS * len(sensors)
    operations = variance_operations if rule == "covariance" else information_operations
    return sum(operations(predicted, spec, exact=exact) for spec in sensors.values())
