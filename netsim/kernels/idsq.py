"""The IDSQ tracker as plain functions: a step of Table 1, and all of it without a network (Liu, Reich, Zhao 2002)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.gating import tail_operations, tail_probability
from netsim.kernels.grid_belief import (
    GridBelief,
    condition,
    diffuse,
    diffusion_operations,
    pruned,
    uniform,
    update_operations,
)
from netsim.kernels.selection import SelectionRule, best, utilities
from netsim.kernels.tracking_model import TrackingKnowledge


@dataclass(frozen=True, slots=True)
class Filter:
    """How a leader filters.

    Attributes:
        radius_m: How far a target moves at most from one reading to the next.
        least_probability: Cells below this are dropped after every reading.
        gate: A reading is not used if one as unlikely or more has less than this probability; 0 uses every reading.
    """

    radius_m: float
    least_probability: float
    gate: float = 0.0

    def predicted(self, belief: GridBelief, steps: int) -> GridBelief:
        """Step 1 of Table 1, for several readings' time."""
        for _ in range(steps):
            belief = diffuse(belief, self.radius_m)
        return belief

    def updated(
        self, predicted: GridBelief, sensor: SensorSpec, reading: float, *, gated: bool = True
    ) -> tuple[GridBelief, bool]:
        """Steps 2 and 3: the belief after a reading, and whether the reading was used; surely so unless `gated`."""
        if gated and self.gate > 0.0 and tail_probability(predicted, sensor, reading) < self.gate:
            return predicted, False
        after, _ = condition(predicted, sensor.log_likelihood(reading, predicted.centres_m))
        return pruned(after, self.least_probability), True

    def operations(self, before: GridBelief, predicted: GridBelief, steps: int, sensor: SensorSpec) -> int:
        """Elementary floating-point operations of `predicted` and `updated`; of several steps each as large as the last."""
        cells = len(predicted.cells)
        gating = tail_operations(cells, sensor) if self.gate > 0.0 else 0
        diffusing = steps * diffusion_operations(before, predicted, self.radius_m)
        return diffusing + gating + sensor.likelihood_operations(cells) + update_operations(cells)


@dataclass(frozen=True, eq=False)
class Turn:
    """What one leader does.

    Attributes:
        step: Number of the reading.
        leader: Who takes it.
        belief: After it.
        utility: What speaks for each candidate, by node; empty where there is none.
        successor: Who leads at the next step: the leader itself where there is no candidate.
    """

    step: int
    leader: int
    belief: GridBelief
    utility: Mapping[int, float]
    successor: int


@dataclass(frozen=True, slots=True)
class Choice:
    """How the next leader is chosen; see `netsim.kernels.selection.utilities`.

    Attributes:
        rule: The rule.
        exact: Whether mutual information goes through every cell of the belief.
        excludes_previous: The triplet rule: who led before the leader is no candidate.
    """

    rule: SelectionRule = "mutual_information"
    exact: bool = False
    excludes_previous: bool = True


def table_1(
    knowledge: Mapping[int, TrackingKnowledge],
    reading: Callable[[int, int], float],
    first: int,
    steps: int,
    filtering: Filter,
    choice: Choice,
    rngs: Callable[[int], np.random.Generator],
    received: Callable[[GridBelief], GridBelief] = lambda belief: belief,
) -> list[Turn]:
    """Table 1 as if all nodes were one and hand-offs cost nothing: what a network must do whose links lose nothing.

    The first leader begins with a uniform belief at step 0 and takes its first reading at step 1.

    Args:
        knowledge: Of every node with a sensor.
        reading: Of a node's sensor at a step.
        first: The first leader.
        steps: How many readings are taken.
        filtering: How a leader filters.
        choice: How the next leader is chosen.
        rngs: Each node's random numbers, for the rule `random`.
        received: What the next leader makes of a belief that is handed on.
    """
    turns: list[Turn] = []
    leader, belief = first, uniform(knowledge[first].grid)
    without: tuple[int, ...] = ()
    for step in range(1, steps + 1):
        known = knowledge[leader]
        sensor = _sensor_of(known)
        belief, _ = filtering.updated(filtering.predicted(belief, 1), sensor, reading(leader, step))
        candidates = {node: known.others[node] for node in known.neighbours(sensor.position_m, without)}
        predicted = filtering.predicted(belief, 1)
        utility = utilities(choice.rule, predicted, candidates, rngs(leader), exact=choice.exact)
        successor = best(utility) if utility else leader
        turns.append(Turn(step, leader, belief, utility, successor))
        if successor != leader:
            leader, without = successor, (leader,) if choice.excludes_previous else ()
            belief = received(belief)
    return turns


def _sensor_of(knowledge: TrackingKnowledge) -> SensorSpec:
    if knowledge.sensor is None:
        message = "a leader without a sensor"
        raise ValueError(message)
    return knowledge.sensor


def rim_probability(belief: GridBelief) -> float:
    """Probability of the outermost cells of the grid, where beliefs about targets that have left pile up."""
    rows, columns = np.divmod(belief.cells, belief.grid.columns)
    on_rim = (rows == 0) | (columns == 0) | (rows == belief.grid.rows - 1) | (columns == belief.grid.columns - 1)
    return float(belief.probability[on_rim].sum())
