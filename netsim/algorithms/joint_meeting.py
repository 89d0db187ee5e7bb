"""What a leader makes of tracks of others that its members are in range of too: doubles, and groups to be joined."""

from collections.abc import Sequence

import numpy as np

from netsim.algorithms.joint_groups import is_joint, places_of
from netsim.algorithms.joint_messages import Held, Sighting
from netsim.algorithms.joint_station import Station


def double_of(station: Station, held: Held, others: Sequence[Sighting]) -> int | None:
    """The earlier track that a group's, which is fresh, turns out to be a double of."""
    if not station.is_fresh(held.name):
        return None
    (x_m, y_m), *_ = places_of(held).tolist()
    earlier = (each for each in others if each.track < held.name)
    same_m = station.parameters.same_m
    return next((each.track for each in earlier if np.hypot(each.x_m - x_m, each.y_m - y_m) <= same_m), None)


def belong(station: Station, held: Held, other: Sighting) -> bool:
    """Whether a group and another's track are to be joint; fresh ones may yet be the same, and wait."""
    is_settled = not any(map(station.is_fresh, (*held.tracks, other.track)))
    return is_settled and is_joint(station.parameters, held, places_of(held), other)


def are_joint(station: Station, held: Held, other: Held) -> bool:
    """Whether two groups of one node are to be joint."""
    places_m = zip(other.tracks, places_of(other).tolist(), strict=True)
    near = (Sighting(station.node.id, track, *at) for track, at in places_m)
    return any(belong(station, held, one) for one in near)


def host_of(station: Station, held: Held, near: Sequence[Sighting]) -> int | None:
    """The leader to whom a group is to be given: of those that are to be joint, the one of the lowest track stays."""
    lower = [each for each in near if each.track < held.name and each.leader != station.node.id]
    return min(lower, key=lambda each: each.track).leader if lower else None
