"""A belief about the places of one or several targets as weighted particles (Liu et al. 2004, section 4.1, eq 1).

Weights are held as logarithms, so that readings however unlikely leave the ratios of the particles' weights as they are.
`predict` is the integral over the dynamics, `condition` the product with a likelihood; sequential importance resampling with
them is Gordon, Salmond and Smith 1993. The functions take their random numbers from a generator that is given to them.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray

IndexArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ParticleBelief:
    """Weighted particles, each a place of every target of the belief.

    Attributes:
        positions_m: Shape (P, M, 2): particle, target, coordinate; P and M at least 1.
        log_weights: Logarithms of the weights, shape (P,); their exponentials sum to one. Minus infinity is weight 0.
    """

    positions_m: FloatArray
    log_weights: FloatArray

    @property
    def count(self) -> int:
        """How many particles: P."""
        return len(self.positions_m)

    @property
    def targets(self) -> int:
        """How many targets: M."""
        return int(self.positions_m.shape[1])

    @cached_property
    def weights(self) -> FloatArray:
        """Shape (P,), sums to one."""
        return np.exp(self.log_weights)

    @cached_property
    def estimate_m(self) -> FloatArray:
        """Mean place of every target, shape (M, 2).

        Of a joint belief that does not tell its targets apart take it after `logical_targets.ordered`.
        """
        return np.asarray(np.tensordot(self.weights, self.positions_m, axes=1))

    def covariance_m2(self, target: int) -> FloatArray:
        """Covariance of one target's place, shape (2, 2)."""
        offsets_m = self.positions_m[:, target] - self.estimate_m[target]
        return np.asarray((offsets_m * self.weights[:, None]).T @ offsets_m)

    @property
    def effective_sample_size(self) -> float:
        """1 / sum of squared weights, from 1 to P: how many equal particles would be as good (Kong, Liu and Wong 1994)."""
        return float(1.0 / (self.weights**2).sum())


def equal_weights(positions_m: FloatArray) -> ParticleBelief:
    """The belief that takes each of some particles, shape (P, M, 2), for equally likely."""
    count = len(positions_m)
    return ParticleBelief(positions_m, np.full(count, -math.log(count)))


def uniform_disc(centres_m: ArrayLike, radius_m: float, count: int, rng: np.random.Generator) -> ParticleBelief:
    """A first belief: every target anywhere in a disc, independently of the others.

    Args:
        centres_m: Centres of the discs, shape (M, 2), or (2,) for a single target.
        radius_m: Of the discs.
        count: How many particles.
        rng: Random numbers.
    """
    centres = np.asarray(centres_m, dtype=float).reshape(-1, 2)
    return equal_weights(centres + _in_disc((count, len(centres)), radius_m, rng))


def _in_disc(shape: tuple[int, int], radius_m: float, rng: np.random.Generator) -> FloatArray:
    """Uniform draws from a disc around the origin, shape (*shape, 2)."""
    range_m = radius_m * np.sqrt(rng.random(shape))
    angle = rng.uniform(0.0, 2.0 * np.pi, shape)
    return np.stack([range_m * np.cos(angle), range_m * np.sin(angle)], axis=-1)


def predict(belief: ParticleBelief, most_m: float, rng: np.random.Generator) -> ParticleBelief:
    """The belief after every target moved by at most `most_m` in any direction, each place of the disc alike (eq 1).

    Give it more than the targets can do: in the paper three times their speed, and with just their speed tracks get lost.
    """
    moved_m = belief.positions_m + _in_disc((belief.count, belief.targets), most_m, rng)
    return ParticleBelief(moved_m, belief.log_weights)


def log_evidence(belief: ParticleBelief, log_likelihood: FloatArray) -> float:
    """Logarithm of a measurement's probability under a belief: minus infinity where no particle can explain it."""
    return _log_sum(belief.log_weights + log_likelihood)


def _log_sum(logs: FloatArray) -> float:
    top = float(logs.max())
    return top + math.log(float(np.exp(logs - top).sum())) if math.isfinite(top) else top


def condition(belief: ParticleBelief, log_likelihood: FloatArray) -> ParticleBelief:
    """The belief after a measurement (eq 1).

    Args:
        belief: Before.
        log_likelihood: Of the measurement at each particle, shape (P,), up to a constant; may be minus infinity.

    Raises:
        ValueError: No particle can explain the measurement, or a likelihood is not a number. The track is lost then: begin
            it anew with `uniform_disc`, or leave the measurement out.
    """
    logs = belief.log_weights + log_likelihood
    top = float(logs.max())
    if not math.isfinite(top):
        message = f"the best of {belief.count} particles has the log weight {top}: expected a finite number"
        raise ValueError(message)
    above = logs - top  # first, as the logarithm of the sum is small beside a top far from 0
    return ParticleBelief(belief.positions_m, above - _log_sum(above))


def systematic(weights: FloatArray, count: int, rng: np.random.Generator) -> IndexArray:
    """Indices of `count` draws with one random number: particle i is drawn floor or ceil of count * w_i times.

    Ascending (Kitagawa 1996, appendix); where two sets of draws are paired, shuffle one of them.
    """
    upper = np.cumsum(weights)
    places = (rng.random() + np.arange(count)) * (upper[-1] / count)
    drawn = np.searchsorted(upper, places, side="right")
    return np.asarray(np.minimum(drawn, np.flatnonzero(weights)[-1]))


def resample(belief: ParticleBelief, count: int, rng: np.random.Generator) -> ParticleBelief:
    """`count` particles of equal weight in place of the belief's, drawn systematically."""
    return equal_weights(belief.positions_m[systematic(belief.weights, count, rng)])


def predict_operations(particles: int, targets: int) -> int:
    """Elementary floating-point operations of `predict`.

    For each target of each particle two random numbers (a function's work each), a root, a sine, a cosine, three products
    and two additions.
    """
    return particles * targets * (5 * FUNCTION_OPERATIONS + 5)


def condition_operations(particles: int) -> int:
    """Elementary floating-point operations of `condition`; the likelihood is apart.

    An addition, a comparison, a difference, an exponential, an addition and a difference for each particle; one logarithm.
    """
    return particles * (FUNCTION_OPERATIONS + 5) + FUNCTION_OPERATIONS + 1


def resample_operations(particles: int, count: int) -> int:
    """Elementary floating-point operations of `resample`.

    An exponential, an addition and a comparison for each particle, an addition, a product and a comparison for each drawn.
    """
    return particles * (FUNCTION_OPERATIONS + 2) + 3 * count + FUNCTION_OPERATIONS
