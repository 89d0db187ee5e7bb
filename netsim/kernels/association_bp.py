"""Association probabilities by loopy belief propagation: two numbers a pair and round, instead of all joint associations.

Williams and Lau 2014 (Approximate evaluation of marginal association probabilities with belief propagation, IEEE
Transactions on Aerospace and Electronic Systems 50(4)): sum-product on the bipartite graph with one variable an event (its
measurement, or none) and one a measurement (its event, or none), each message reduced to one number:

    nu_{j->k} = 1 / (1 + sum_{k' != k} mu_{j,k'}),   mu_{j,k} = w_jk / (1 + sum_{j' != j} w_j'k nu_{j'->k})

with w_jk = alpha L_jk. It is exact on trees, and converges on every graph to an approximation.
"""

from dataclasses import dataclass

import numpy as np

from netsim.kernels.event_gating import require_weights
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, eq=False)
class AssociationBeliefs:
    """What belief propagation found.

    Attributes:
        probabilities: beta_jk, shape (N, K); what is missing to one in a column is the probability that the event has no
            measurement.
        iterations: Rounds of messages, both ways each.
        converged: Whether the last round changed no message by more than the tolerance.
    """

    probabilities: FloatArray
    iterations: int
    converged: bool


def propagate(weights: FloatArray, tolerance: float = 1e-9, max_iterations: int = 10_000) -> AssociationBeliefs:
    """Belief propagation from nu = 1 on.

    Args:
        weights: alpha L_jk, shape (N, K), zero where a pair is not gated.
        tolerance: Largest change of the logarithm of a message nu in the last round, above 0. After such a round, messages
            are within rate / (1 - rate) of it from where they would end, with the rate of `contraction`.
        max_iterations: Rounds after which it stops all the same, at least 1.

    Raises:
        ValueError: For weights that are no matrix of finite numbers, 0 or more, or bounds that are none.
    """
    w = require_weights(weights)
    if not tolerance > 0.0 or max_iterations < 1:
        text = f"expected a tolerance above 0 and at least 1 iteration, got {tolerance} and {max_iterations}"
        raise ValueError(text)
    nu: FloatArray = np.ones_like(w)
    iterations, converged = 0, False
    while not converged and iterations < max_iterations:
        before, nu = nu, message_round(w, nu)
        iterations, converged = iterations + 1, change(before, nu) <= tolerance
    return AssociationBeliefs(beliefs(w, nu), iterations, converged)


def message_round(weights: FloatArray, nu: FloatArray) -> FloatArray:
    """From the measurements' messages nu, through the events and back: the next, shape (N, K), 1 off the edges."""
    mu = weights / (1.0 + _sum_of_others(weights * nu, axis=0))
    return np.where(weights > 0.0, 1.0 / (1.0 + _sum_of_others(mu, axis=1)), 1.0)


def change(before: FloatArray, after: FloatArray) -> float:
    """How far messages are apart: the largest difference of their logarithms."""
    return float(np.abs(np.log(after / before)).max(initial=0.0))


def beliefs(weights: FloatArray, nu: FloatArray) -> FloatArray:
    """beta_jk = w_jk nu_jk / (1 + sum_j' w_j'k nu_j'k), shape (N, K)."""
    terms = weights * nu
    return np.asarray(terms / (1.0 + terms.sum(axis=0)))


def contraction(weights: FloatArray) -> float:
    """By what factor a round brings any two sets of messages closer, at least, in the sense of `change`; below 1.

    1 / (1 + s), as a function of the logarithms of the terms of s, changes in its logarithm by at most s / (1 + s) times as
    much as they do; so does each half of a round, with s at most the sum of the weights of a vertex's other edges. That is
    why there is one fixed point and every start leads to it (Williams and Lau 2014 prove it in much the same way).
    """
    w = require_weights(weights)
    events = float(_sum_of_others(w, axis=0).max(initial=0.0, where=w > 0.0))
    measurements = float(_sum_of_others(w, axis=1).max(initial=0.0, where=w > 0.0))
    return events / (1.0 + events) * (measurements / (1.0 + measurements))


def _sum_of_others(terms: FloatArray, axis: int) -> FloatArray:
    """Along an axis, for each entry the sum of all others; not the total less the entry, which would lose small sums."""
    lines = terms if axis == 0 else terms.T
    before, after = np.zeros_like(lines), np.zeros_like(lines)
    before[1:] = np.cumsum(lines[:-1], axis=0)
    after[:-1] = np.cumsum(lines[:0:-1], axis=0)[::-1]
    return before + after if axis == 0 else (before + after).T
