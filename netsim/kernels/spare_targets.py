"""Whether readings speak for all the targets of a joint belief, or for one less.

The models are compared by the probability that each gives the readings, its evidence (Kass and Raftery 1995, section 3.2): a
Bayes factor, which no threshold needs to be tuned for. A target that is gone stays in a joint belief beside the others, and
is moved to where it does the least harm; but two sources explain the sound of one badly wherever they are.
"""

import numpy as np

from netsim.kernels.energy_sensing import EnergyModel, likelihood_operations
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.particles import ParticleBelief, log_evidence
from netsim.kernels.semiring import FloatArray


def spare_target(
    model: EnergyModel, readings: FloatArray, sensors_m: FloatArray, belief: ParticleBelief, log_likelihood: FloatArray
) -> int | None:
    """The target without which a belief explains readings best, if it explains them better than with all.

    Args:
        model: How sources show in readings.
        readings: Of one instant, shape (S,).
        sensors_m: Where, shape (S, 2).
        belief: Before the readings, about several logical targets, each in a place of its own.
        log_likelihood: Of the readings at each particle, all targets being there, shape (P,).

    Returns:
        Its index; None where the readings speak for all targets, or there is but one.
    """
    if belief.targets == 1:
        return None
    without = [
        log_evidence(belief, model.log_likelihood(readings, sensors_m, np.delete(belief.positions_m, target, axis=1)))
        for target in range(belief.targets)
    ]
    best = int(np.argmax(without))
    return best if without[best] > log_evidence(belief, log_likelihood) else None


def spare_operations(sensors: int, particles: int, targets: int) -> int:
    """Elementary floating-point operations of `spare_target`: likelihoods and evidence, an exponential a particle each."""
    if targets == 1:
        return 0
    evidence = particles * (FUNCTION_OPERATIONS + 3) + FUNCTION_OPERATIONS
    return targets * (likelihood_operations(sensors, particles, targets - 1) + evidence) + evidence
