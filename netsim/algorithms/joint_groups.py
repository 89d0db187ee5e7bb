"""When groups are joint, what a joint group becomes, and where its members are: no node, no time."""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from netsim.algorithms.joint_messages import Held, Sighting
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.api import Circle, Region
from netsim.kernels.logical_targets import clusters, contiguous_groups, join, order_shares, ordered, separate
from netsim.kernels.particles import ParticleBelief
from netsim.kernels.semiring import FloatArray
from netsim.protocols.regions import Union, covering


def cover(places_m: FloatArray, range_m: float) -> Region:
    """A shape that holds the discs of a range around some places, as tight as one can be sent to."""
    discs = [Circle((x_m, y_m), range_m) for x_m, y_m in places_m.tolist()]
    return discs[0] if len(discs) == 1 else covering(Union(tuple(discs))) or discs[0]


def is_joint(parameters: JointTrackingParameters, held: Held, places_m: FloatArray, other: Sighting) -> bool:
    """Whether a group and a track of another, which collide, are to be tracked jointly (Liu et al. 2004, section 4.3)."""
    if parameters.switch == "always":
        return True
    if parameters.switch == "latched":
        return not held.is_parted
    distance_m = float(np.hypot(*(places_m - (other.x_m, other.y_m)).T).min())
    return parameters.switch == "distance" and distance_m <= parameters.separate_m


def joined(held: Held, other: Held, particles: int, rng: np.random.Generator) -> Held:
    """Two groups as one: the product of their beliefs (eq 4), the tracks in ascending order."""
    order = np.argsort([*held.tracks, *other.tracks])
    belief = join(held.belief, other.belief, particles, rng)
    return Held(
        step=max(held.step, other.step),
        turn=max(held.turn, other.turn) + 1,
        tracks=tuple(sorted((*held.tracks, *other.tracks))),
        belief=replace(belief, positions_m=belief.positions_m[:, order]),
        known=held.known.reconciled(other.known),
    )


def parts_of(
    parameters: JointTrackingParameters,
    held: Held,
    range_m: float,
    particles: Callable[[int], int],
    rng: np.random.Generator,
) -> list[Held]:
    """A group's parts after its targets have parted; the group itself where they have not.

    Args:
        parameters: The rule: distance, and how identities mix.
        held: The group.
        range_m: Sensing range: `latched` joins groups up to twice that apart, and lets them come near before they part.
        particles: How many particles a belief of so many targets has.
        rng: For drawing them.
    """
    if len(held.tracks) == 1 or parameters.switch == "always":
        return [held]
    estimates_m, near_m = ordered(held.belief).estimate_m, parameters.separate_m
    is_waiting = parameters.switch == "latched" and not held.has_met
    sizes = contiguous_groups(clusters(estimates_m, max(near_m, 2.0 * range_m) if is_waiting else near_m))
    if len(sizes) == 1:
        return [replace(held, has_met=held.has_met or len(clusters(estimates_m, near_m)) == 1)]
    beliefs = separate(held.belief, sizes, rng, [particles(size) for size in sizes])
    shares = order_shares(held.belief)
    _, component = linear_sum_assignment(shares, maximize=True)
    by_track = shares[np.argsort(component)] if parameters.mixing == "particles" else None
    known = held.known.met(held.tracks, by_track)
    found, begin = [], 0
    for size, belief in zip(sizes, beliefs, strict=True):
        logical = sorted(range(begin, begin + size), key=lambda target: held.tracks[component[target]])
        begin += size
        found.append(
            replace(
                held,
                tracks=tuple(held.tracks[component[target]] for target in logical),
                belief=replace(
                    belief, positions_m=belief.positions_m[:, [target - begin + size for target in logical]]
                ),
                known=known,
                is_parted=True,
                has_met=False,
            )
        )
    return found


def kept(held: Held, tracks: Collection[int]) -> Held | None:
    """What is left of a group when it keeps only some of its tracks; None if it keeps none.

    Of a joint belief that is the marginal of the logical targets that bear their names (eqs 6 and 7). It breaks up as in
    `parts_of`: who is who among its tracks is open from now on, also between those that stay and those that go.
    """
    left = [index for index, track in enumerate(held.tracks) if track in tracks]
    if len(left) == len(held.tracks):
        return held
    if not left:
        return None
    belief = named(held.belief)
    return replace(
        held,
        tracks=tuple(held.tracks[index] for index in left),
        belief=replace(belief, positions_m=belief.positions_m[:, left]),
        known=held.known.met(held.tracks),
        waiting=(),
    )


def named(belief: ParticleBelief) -> ParticleBelief:
    """Logical targets, each in the place of the target that it most probably is.

    What a joint belief, which may not tell its targets apart, says of each of them; `parts_of` names its parts alike.
    """
    if belief.targets == 1:
        return belief
    _, component = linear_sum_assignment(order_shares(belief), maximize=True)
    return ParticleBelief(ordered(belief).positions_m[:, np.argsort(component)], belief.log_weights)


def places_of(held: Held) -> FloatArray:
    """Estimates of a group's targets in the order of its tracks, shape (M, 2)."""
    return named(held.belief).estimate_m
