"""How wrong correlation decay can be at a depth, from the weights alone (Oh 2010, Lemma 2, Theorems 2 and 3).

For every even t and every vertex of every subgraph

    |log P(v is in no pair) - log Phi(v, t)| <= (1 - D)^(t / 2) log rho

The paper's numbers are loose: the depth they ask for is mostly beyond the one at which the recursion is exact anyway.
They are information; the certified intervals of `netsim.kernels.decay_interval` are the tool.
"""

import math
from dataclasses import dataclass

import numpy as np

from netsim.kernels.event_gating import require_weights
from netsim.kernels.matchings import components
from netsim.kernels.semiring import FloatArray


@dataclass(frozen=True, slots=True)
class DecayBound:
    """A bound on the error of the factors Phi, and what follows for association probabilities.

    Attributes:
        rho: At least 1; a vertex is in no pair with probability 1 / rho or more (Lemma 2).
        decay: D, the share of the bound that two more levels take off, above 0 and at most 1.
        vertices: N + K.
    """

    rho: float
    decay: float
    vertices: int

    def factor_error(self, depth: int) -> float:
        """Bound of |log P - log Phi| at an even depth (Theorem 2); at depth 0, where Phi is 1, by Lemma 2.

        Raises:
            ValueError: For a depth that is odd or negative: the theorem speaks of steps of two levels from Phi = 1 on.
        """
        if depth < 0 or depth % 2:
            text = f"depth: expected an even number, 0 or more, got {depth}"
            raise ValueError(text)
        return math.log(self.rho) * math.exp(-self._delta * (depth // 2))

    def ratio_error(self, depth: int, factors: int | None = None) -> float:
        """Bound of |log(estimate / beta)| for every pair, at an even depth.

        Args:
            depth: t.
            factors: How many Phi go into an estimate; by default 2 (N + K), as the paper's proof counts the N + K and
                N + K - 2 of Algorithm 2. The two-factor and the normalised estimators have an error of two.

        Raises:
            ValueError: For a depth that is odd or negative.
        """
        return self._factors(factors) * self.factor_error(depth)

    def depth_for(self, epsilon: float, factors: int | None = None) -> int:
        """The least even depth at which `ratio_error` is at most epsilon (Theorem 3, from Theorem 2 anew).

        (1 - D)^(t/2) log rho <= epsilon / (2 (N + K)) gives t = 2 ceil(log(2 (N + K) log rho / epsilon) / delta) with
        delta = -log(1 - D). The paper prints a delta within the inner logarithm besides, log(2 (N + K) log rho / (delta
        epsilon)), which the last line of its own proof does without. As the delta of Theorem 2 is at most log 2, the printed
        depth suffices as well, but exceeds this one by about 2 log(1 / delta) / delta.

        Args:
            epsilon: Above 0; exp(-epsilon) <= estimate / beta <= exp(epsilon) is what is asked for.
            factors: As for `ratio_error`.

        Raises:
            ValueError: For an epsilon that is not above 0.
        """
        if not epsilon > 0.0:
            text = f"epsilon: expected above 0, got {epsilon:g}"
            raise ValueError(text)
        start = self.ratio_error(0, factors)
        return 0 if start <= epsilon else 2 * math.ceil(math.log(start / epsilon) / self._delta)

    @property
    def _delta(self) -> float:
        """Of Theorem 3; 0 where nothing is to decay."""
        return -math.log1p(-self.decay) if self.rho > 1.0 else 0.0

    def _factors(self, factors: int | None) -> int:
        return 2 * self.vertices if factors is None else factors


def paper_bound(weights: FloatArray) -> DecayBound:
    """Theorem 2 as it stands: rho = 1 + Delta w_max, D = 1 / (1 + w_max / w_min sqrt(rho)).

    Args:
        weights: alpha L_jk, shape (N, K), zero where a pair is not gated; w_max and w_min are the largest and the least over
            the pairs that are, and stand for alpha L_max and alpha L_min; Delta is the largest number of pairs of a vertex.

    Raises:
        ValueError: For weights that are no matrix of finite numbers, 0 or more.
    """
    w = require_weights(weights)
    edges = w[w > 0.0]
    if not edges.size:
        return DecayBound(1.0, 1.0, sum(w.shape))
    degree = int(max(np.count_nonzero(w, axis=0).max(), np.count_nonzero(w, axis=1).max()))
    rho = 1.0 + degree * float(edges.max())
    return DecayBound(rho, 1.0 / (1.0 + float(edges.max() / edges.min()) * math.sqrt(rho)), sum(w.shape))


def sharp_bound(weights: FloatArray) -> DecayBound:
    """The same with less given away: rho = 1 + s, D = 2 / (1 + sqrt(rho)), with s the largest sum of a vertex's weights.

    Two levels shrink an error by 1 - (1 + sum s_i x_i^2) / (1 + sum s_i x_i), where s_i are the weights at a vertex and
    0 <= x_i <= 1 (the paper's appendix A). For a given m = sum s_i x_i, sum s_i x_i^2 is at least m^2 / s with s = sum s_i
    (Cauchy and Schwarz), and (1 + m^2 / s) / (1 + m) is least at m = sqrt(1 + s) - 1, where it is 2 / (1 + sqrt(1 + s)). So
    the ratio of the largest to the least weight plays no part; for equal weights and degrees it is the rate of Bayati et
    al. 2007 (Simple deterministic approximation algorithms for counting matchings). Lemma 2 holds with s, which is at most
    Delta w_max, for the same reason as with that.

    Args:
        weights: As for `paper_bound`.

    Raises:
        ValueError: As `paper_bound`.
    """
    w = require_weights(weights)
    rho = 1.0 + float(max(w.sum(axis=0).max(initial=0.0), w.sum(axis=1).max(initial=0.0)))
    return DecayBound(rho, 2.0 / (1.0 + math.sqrt(rho)), sum(w.shape))


def exact_depth(weights: FloatArray) -> int:
    """A depth from which on every Phi is exact: 2 min(N, K), of the component where that is largest.

    The recursion follows paths that change sides at every step and never come back: after 2 min(N, K) steps no neighbour is
    left, and a vertex without is in no pair, as Phi = 1 has it.

    Args:
        weights: Shape (N, K).
    """
    sides = (min(len(part.measurements), len(part.events)) for part in components(require_weights(weights)))
    return 2 * max(sides, default=0)
