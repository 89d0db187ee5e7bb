"""What a leader remembers: whose word about a track counts, calls of other leaders, and readings of members."""

from collections.abc import Collection

import numpy as np

from netsim.algorithms.joint_messages import Call, Held, Reading, Sighting
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


class Calls:
    """The calls that put this node into groups, by step; a leader may have several groups."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._heard: dict[int, dict[tuple[int, ...], tuple[int, Call]]] = {}

    def note(self, leader: int, call: Call) -> None:
        """Somebody calls; earlier steps than the one before are forgotten."""
        if self._station.range_to_m(call.estimates_m) <= self._station.knowledge.sensing_range_m:
            self._heard = {step: calls for step, calls in self._heard.items() if step >= call.step - 1}
            self._heard.setdefault(call.step, {})[call.tracks] = leader, call

    def any_at(self, step: int) -> bool:
        """Whether a group has called this node at a step."""
        return bool(self._heard.get(step))

    def sighted(self, group: Call) -> tuple[Sighting, ...]:
        """The tracks of the other groups that called this node at the step of a group's call."""
        return tuple(
            Sighting(leader, track, *place)
            for tracks, (leader, call) in sorted(self._heard.get(group.step, {}).items())
            if tracks != group.tracks
            for track, place in zip(tracks, call.estimates_m.tolist(), strict=True)
        )


def call_of(held: Held, step: int, places_m: FloatArray) -> Call:
    """What a leader says of a group."""
    return Call(step, held.turn, held.tracks, places_m, held.known.hearsay(), held.is_blank)
