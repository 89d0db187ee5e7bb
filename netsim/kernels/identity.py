"""Which track is which target, as a matrix of probabilities (Liu et al. 2004, section 3.2, eq 2; Shin, Guibas, Zhao 2003).

Row i of an identity matrix B is the distribution of track i over the identities, column j where identity j may be. While no
target appears or disappears, rows and columns sum to one, and both updates keep it so: `mix` where tracks met, `evidence`
where something was learned of one. The matrix takes M^2 numbers where the exact posterior (`ExactIdentity`) takes M!; for
two targets they agree.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from netsim.kernels.fitting import fitted
from netsim.kernels.semiring import FloatArray

EVEN_PAIR: Final = 0.5
"""Probability of a swap where a pair met and nothing tells whether they crossed or turned away from each other."""

MOST_TARGETS: Final = 8
"""Of the exact posterior: the 40320 assignments of eight targets would become 362880."""

IMPOSSIBLE: Final = 1e-9
"""Evidence this improbable, beside what it would be under the identity that it speaks most for, contradicts what is known:
entries of a matrix are not sure to more."""

CLOSED: Final = 1e-9
"""A group may lack this much of an identity that evidence gives to one of its rows; it is rounding."""


def unmixed(targets: int) -> FloatArray:
    """The matrix at the start, when track i is target i, shape (targets, targets)."""
    return np.eye(targets)


def even(rows: int) -> float:
    """The p of `mix` after which as many tracks are each any of them alike: 1/2 for two, 2/3 for three."""
    return (rows - 1) / rows


def mix(identities: FloatArray, rows: Sequence[int], p: float) -> FloatArray:
    """The matrix after tracks met: mass flows between their rows.

    Args:
        identities: B, shape (tracks, identities).
        rows: Who met, two or more.
        p: How probable it is that a track goes on as another than before, each of the others alike.

    Raises:
        ValueError: Fewer than two rows or one twice, or p is no probability.
    """
    check_meeting(rows, p)
    count = len(rows)
    shares = np.full((count, count), p / (count - 1))
    np.fill_diagonal(shares, 1.0 - p)
    return mix_by(identities, rows, shares)


def check_meeting(rows: Sequence[int], p: float) -> None:
    """Refuse a meeting of fewer than two different tracks, and a p that is no probability, by a ValueError."""
    if len(rows) < 2 or len(set(rows)) != len(rows):
        message = f"a meeting of tracks {tuple(rows)}: expected two or more different ones"
        raise ValueError(message)
    if not 0.0 <= p <= 1.0:
        message = f"p = {p}: expected a probability"
        raise ValueError(message)


def mix_by(identities: FloatArray, rows: Sequence[int], shares: FloatArray) -> FloatArray:
    """The matrix after tracks met, given how probable each way on is.

    Args:
        identities: B, shape (tracks, identities).
        rows: Who met, k of them.
        shares: Entry (a, b) is the probability that the a-th of them goes on as what was the b-th, shape (k, k), doubly
            stochastic; such as `logical_targets.order_shares`.
    """
    mixed = identities.copy()
    mixed[list(rows)] = shares @ identities[list(rows)]
    return mixed


def evidence(identities: FloatArray, row: int, likelihood: ArrayLike, group: Sequence[int] | None = None) -> FloatArray:
    """The matrix after something was learned of one track.

    Its row is what Bayes' rule makes of it, and is kept. The group's other rows are scaled, by rows and columns in turn,
    until they sum to one again and each identity has the mass within the group that it had (iterative proportional fitting).
    Rows outside the group stay as they are. That can always be done if the group holds everyone whose identity is mixed
    with the track's. Where it cannot, because members are missing, the row itself is scaled with the others: the evidence
    counts for as much as the group's rows have room for.

    Args:
        identities: B, shape (tracks, identities); the group's rows are enough, they need not be a square.
        row: The track.
        likelihood: Of what was learned under each identity, shape (identities,), up to a factor; at least 0.
        group: The rows that may change, the track's among them or not; None for all.

    Raises:
        ValueError: The evidence contradicts the row: it is impossible, to rounding, under every identity the track may have.
            Or the likelihood is negative or not finite, or leaves the group's rows no way to sum up.
    """
    updated = identities.copy()
    members = [member for member in (range(len(identities)) if group is None else group) if member != row]
    updated[row] = posterior(identities[row], likelihood)
    if not members:
        return identities.copy()  # a group of one holds its identity for certain, or may not take mass from elsewhere
    held = identities[[row, *members]].sum(axis=0)
    others = _others(identities[members], held - updated[row])
    if others is not None:
        updated[members] = others
        return updated
    together = fitted(updated[[row, *members]], np.ones(len(members) + 1), held)
    if together is None:
        message = f"the evidence about track {row} leaves the rows {sorted([row, *members])} no way to sum to one"
        raise ValueError(message)
    updated[[row, *members]] = together
    return updated


def posterior(row: FloatArray, likelihood: ArrayLike) -> FloatArray:
    """Bayes' rule on one row.

    Raises:
        ValueError: As `evidence` says.
    """
    factors = np.asarray(likelihood, dtype=float)
    wrong = ~(np.isfinite(factors) & (factors >= 0.0))
    if wrong.any():
        message = f"a likelihood of {factors[wrong][0]}: expected finite numbers of at least 0"
        raise ValueError(message)
    joint = row * factors
    total = float(joint.sum())
    if total <= IMPOSSIBLE * float(factors.max(initial=0.0)):
        message = "the evidence contradicts what is known: no identity that the track may have agrees with it"
        raise ValueError(message)
    return np.asarray(joint / total)


def _others(rows: FloatArray, columns: FloatArray) -> FloatArray | None:
    """The other rows scaled to sums of one, and to these sums of columns; None where that is impossible."""
    if columns.min() < -CLOSED:
        return None
    return fitted(rows, np.ones(len(rows)), np.maximum(columns, 0.0))


def evidence_operations(rows: int, identities: int, sweeps: int = 20) -> int:
    """Elementary floating-point operations of `evidence` in a group of so many rows.

    Bayes' rule, the columns' sums, and for each sweep two sums, two divisions and two products an entry.
    """
    return 3 * identities + rows * identities * (1 + 4 * sweeps)


@dataclass(frozen=True, eq=False)
class ExactIdentity:
    """The exact posterior: a probability for each assignment of identities to tracks; what a matrix is measured against.

    Attributes:
        assignments: Which identity each track has, one assignment a row, shape (M!, M).
        probability: Theirs, shape (M!,), sums to one.
    """

    assignments: NDArray[np.int64]
    probability: FloatArray

    def mix(self, rows: Sequence[int], p: float) -> "ExactIdentity":
        """The posterior after tracks met: with some probability all orders of their identities become equally likely.

        Args:
            rows: Who met.
            p: How probable it is that a track goes on as another, as in `identity.mix`. Of two tracks any probability: the
                pair is swapped with it. Of k tracks at most (k - 1) / k, which makes every order equally likely.

        Raises:
            ValueError: As `identity.mix`, or p is greater than that.
        """
        check_meeting(rows, p)
        if len(rows) > 2 and p > even(len(rows)):
            message = f"p = {p} of {len(rows)} tracks: expected at most {even(len(rows)):g}"
            raise ValueError(message)
        anew = p / even(len(rows))
        sorted_rows = self.assignments.copy()
        sorted_rows[:, list(rows)] = np.sort(sorted_rows[:, list(rows)], axis=1)
        _, alike = np.unique(sorted_rows, axis=0, return_inverse=True)
        mean = np.bincount(alike.ravel(), self.probability) / math.factorial(len(rows))
        return ExactIdentity(self.assignments, (1.0 - anew) * self.probability + anew * mean[alike.ravel()])

    def evidence(self, row: int, likelihood: ArrayLike) -> "ExactIdentity":
        """The posterior after something was learned of one track (Bayes' rule).

        Args:
            row: The track.
            likelihood: Under each identity, shape (M,), up to a factor.

        Raises:
            ValueError: The evidence contradicts what is known, or is no likelihood.
        """
        factors = np.asarray(likelihood, dtype=float)[self.assignments[:, row]]
        return ExactIdentity(self.assignments, posterior(self.probability, factors))

    def marginals(self) -> FloatArray:
        """The identity matrix that belongs to it: row i the distribution of track i, shape (M, M)."""
        count = self.assignments.shape[1]
        by_track = [np.bincount(tracks, self.probability, count) for tracks in self.assignments.T]
        return np.stack(by_track)


def exact_start(targets: int) -> ExactIdentity:
    """The posterior at the start, when track i is target i.

    Raises:
        ValueError: Not 1 to `MOST_TARGETS` targets.
    """
    if not 1 <= targets <= MOST_TARGETS:
        message = f"the exact posterior of {targets} targets: expected 1 to {MOST_TARGETS}"
        raise ValueError(message)
    assignments = np.array(list(permutations(range(targets))), dtype=np.int64)
    probability = np.zeros(len(assignments))
    probability[0] = 1.0
    return ExactIdentity(assignments, probability)
