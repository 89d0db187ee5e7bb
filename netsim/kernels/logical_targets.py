"""From beliefs about single targets to a joint one and back (Liu et al. 2004, section 4.2).

A joint belief is the product of the beliefs it is made of (eq 4). Back it goes by *logical* targets: sums of energies do
not tell which target is which, so that a joint belief may hold a pair and the same pair swapped. Each particle's targets are
ordered along an axis, and a logical target is a rank in that order (eqs 6 and 7: the left and the right one). What is lost
is who is who, which identity matrices keep (`netsim.kernels.identity`). In the plane the border between two logical targets
is a cutting plane whose normal is the first principal axis of all places pooled.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import connected_components

from netsim.kernels.particles import IndexArray, ParticleBelief, equal_weights, resample, systematic
from netsim.kernels.semiring import FloatArray


def join(a: ParticleBelief, b: ParticleBelief, count: int, rng: np.random.Generator) -> ParticleBelief:
    """The product of two beliefs about different targets (eq 4): those of `a`, then those of `b`.

    Particles are drawn from each belief independently of the other: systematically, and in random pairs, so that each pair
    is expected as often as the product of its weights says.

    Args:
        a: About some targets.
        b: About others.
        count: How many particles the joint belief has.
        rng: Random numbers.
    """
    first = systematic(a.weights, count, rng)
    second = rng.permutation(systematic(b.weights, count, rng))
    return equal_weights(np.concatenate([a.positions_m[first], b.positions_m[second]], axis=1))


def principal_axis(joint: ParticleBelief) -> FloatArray:
    """Unit vector along which the places of all targets, pooled, vary most, shape (2,); its larger component is positive."""
    offsets_m = joint.positions_m - joint.estimate_m.mean(axis=0)
    covariance_m2 = np.einsum("p,pmi,pmj->ij", joint.weights, offsets_m, offsets_m)
    _, vectors = np.linalg.eigh(covariance_m2)
    axis = vectors[:, -1]
    return np.asarray(axis * np.sign(axis[np.argmax(np.abs(axis))]))


def _ranks(joint: ParticleBelief) -> IndexArray:
    """For each particle its targets from the lowest along the principal axis to the highest, shape (P, M)."""
    return np.argsort(joint.positions_m @ principal_axis(joint), axis=1, kind="stable")


def ordered(joint: ParticleBelief) -> ParticleBelief:
    """The same belief about logical targets: target k is whoever is k-th along the principal axis."""
    return ParticleBelief(np.take_along_axis(joint.positions_m, _ranks(joint)[:, :, None], axis=1), joint.log_weights)


def separate(
    joint: ParticleBelief,
    groups: Sequence[int],
    rng: np.random.Generator,
    counts: Sequence[int] | None = None,
) -> list[ParticleBelief]:
    """Beliefs about groups of logical targets: the marginals of `ordered` (eqs 6 and 7).

    Args:
        joint: About M targets.
        groups: How many neighbours along the axis each group has, from the lowest on; they sum up to M. (1, 1) separates a
            pair, (2, 1) leaves the lower two of three together.
        rng: Random numbers for drawing; unused without `counts`.
        counts: How many particles each group's belief is to have. Without it each keeps all particles with their weights,
            and nothing is lost but what groups tell of each other.

    Raises:
        ValueError: The groups do not share out the targets.
    """
    if sum(groups) != joint.targets or min(groups, default=0) < 1:
        message = f"groups of {tuple(groups)} targets: expected positive numbers that sum up to {joint.targets}"
        raise ValueError(message)
    edges = np.concatenate([[0], np.cumsum(groups)]).tolist()
    places_m = ordered(joint).positions_m
    parts = [ParticleBelief(places_m[:, low:high], joint.log_weights) for low, high in pairwise(edges)]
    return parts if counts is None else [resample(part, n, rng) for part, n in zip(parts, counts, strict=True)]


def order_shares(joint: ParticleBelief) -> FloatArray:
    """How probable it is that logical target k (row) is physical target j (column), shape (M, M), doubly stochastic."""
    shares = np.zeros((joint.targets, joint.targets))
    ranks = np.arange(joint.targets)
    np.add.at(shares, (np.broadcast_to(ranks, (joint.count, joint.targets)), _ranks(joint)), joint.weights[:, None])
    return shares


def mixing(joint: ParticleBelief) -> float:
    """How probable it is that a pair has swapped its order: the p that the particles themselves give for mixing identities.

    Resampling makes it drift to 0 or 1 though readings never told who is who; `identity.EVEN_PAIR` claims no more than is
    known.

    Raises:
        ValueError: The belief is not about two targets.
    """
    if joint.targets != 2:
        message = f"mixing of {joint.targets} targets: expected 2; `order_shares` takes any number"
        raise ValueError(message)
    return float(order_shares(joint)[0, 1])


def clusters(estimates_m: FloatArray, distance_m: float) -> list[tuple[int, ...]]:
    """Groups of targets that hang together by steps of at most a distance: single linkage, cut there.

    Args:
        estimates_m: Estimated places, shape (M, 2).
        distance_m: Longest step.

    Returns:
        Each group ascending, groups by their first member.
    """
    offsets_m = estimates_m[:, None, :] - estimates_m[None, :, :]
    _, labels = connected_components(np.hypot(offsets_m[..., 0], offsets_m[..., 1]) <= distance_m, directed=False)
    return [tuple(np.flatnonzero(labels == label).tolist()) for label in dict.fromkeys(labels.tolist())]


def contiguous_groups(parts: Iterable[Sequence[int]]) -> tuple[int, ...]:
    """Sizes, for `separate`, of the smallest runs of logical targets that keep every cluster together.

    Clusters of logical targets (`clusters` of the estimates of `ordered`) that lie beside each other across the axis overlap
    along it, and no cutting plane parts them: they stay together.
    """
    sizes: list[int] = []
    start, end = 0, 0
    for part in sorted(parts, key=min):
        if min(part) > end:
            sizes.append(end - start + 1)
            start = min(part)
        end = max(end, *part)
    return (*sizes, end - start + 1)


def join_operations(count: int, particles: int) -> int:
    """Elementary floating-point operations of `join` of beliefs with `particles` in all: two resamplings and the pairing."""
    return 22 * particles + 7 * count


def separate_operations(particles: int, targets: int) -> int:
    """Elementary floating-point operations of `separate` without drawing.

    For each target of each particle the covariance (12), its place along the axis (3), and about log2 M comparisons.
    """
    return particles * targets * (15 + max(1, int(np.ceil(np.log2(max(targets, 2))))))
