"""What a leader remembers: whose word about a track counts, calls of other leaders, and readings of members."""

from collections.abc import Collection, Mapping

import numpy as np

from netsim.algorithms.joint_messages import Call, Held, Reading
from netsim.algorithms.joint_station import Station
from netsim.kernels.semiring import FloatArray

_KEPT_STEPS = 2
_UNKNOWN = (-1, 0)


class Turns:
    """Of each track the highest turn known, and the leader that it is of; of equal turns the lower node's counts."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[int, int]] = {}

    def note(self, tracks: Collection[int], turn: int, leader: int) -> None:
        """Somebody leads some tracks."""
        for track in tracks:
            self._known[track] = max(self._known.get(track, _UNKNOWN), (turn, -leader))

    def news_in(self, held: Held) -> tuple[int, ...]:
        """The tracks of a group that is given which were not given before, nor led by another since."""
        return tuple(track for track in held.tracks if held.turn > self._known.get(track, _UNKNOWN)[0])


class Readings:
    """Readings that members told, by step and member."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._told: dict[int, dict[int, Reading]] = {}

    def note(self, member: int, reading: Reading) -> None:
        """Take a member's reading, unless it is too old to be of use."""
        if reading.step >= self._station.step - _KEPT_STEPS:
            self._told.setdefault(reading.step, {})[member] = reading

    def near(self, step: int, places_m: FloatArray) -> dict[int, Reading]:
        """Readings of a step by members within the sensing range of some places; earlier ones are forgotten."""
        self._told = {each: told for each, told in self._told.items() if each >= step}
        knowledge = self._station.knowledge
        return {
            member: reading
            for member, reading in self._told.get(step, {}).items()
            if float(np.hypot(*(places_m - np.array(knowledge.sensors_m[member])).T).min()) <= knowledge.sensing_range_m
        }


def call_of(held: Held, step: int, places_m: FloatArray) -> Call:
    """What a leader says of a group."""
    return Call(step, held.turn, held.tracks, places_m, held.known.hearsay())


def calls_in_range(station: Station, calls: Mapping[int, Call], step: int) -> dict[int, Call]:
    """Those calls of a step in whose sensing range this node is, by leader."""
    range_m = station.knowledge.sensing_range_m
    return {
        leader: call
        for leader, call in calls.items()
        if call.step == step and station.range_to_m(call.estimates_m) <= range_m
    }
