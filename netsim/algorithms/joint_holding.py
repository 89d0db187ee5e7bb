"""The groups that a node leads, each in a place of its own, and the records of who leads what."""

import json
from collections.abc import Collection, Sequence

from netsim.algorithms.joint_book import Turns
from netsim.algorithms.joint_groups import kept
from netsim.algorithms.joint_identity import Identities
from netsim.algorithms.joint_messages import Held
from netsim.algorithms.joint_station import Station
from netsim.trace.events import AlgorithmRecord, Role

LEADER = "leader"


class Holding:
    """What a node leads; what it loses goes at once, whatever the group is being used for.

    Args:
        station: The node.
        identities: Told who is led here, and asked who is who.

    Attributes:
        groups: By place.
        leaving: Places of groups that are being given away.
        amidst: Places of groups that are amidst a reading.
        turns: Whose word on a track counts.
    """

    def __init__(self, station: Station, identities: Identities) -> None:
        self._station, self._identities = station, identities
        self.groups: dict[int, Held] = {}
        self.leaving: set[int] = set()
        self.amidst: set[int] = set()
        self.turns = Turns()
        self._next = 0

    def add(self, held: Held) -> int:
        """Lead a group at the place that is returned; of its tracks no other group is held any more."""
        broken = [self.lose(place, held.tracks) for place in list(self.groups)]
        if not held.is_blank:  # what a live leader gives counts for more
            self.turns.note(held.tracks, held.turn, self._station.node.id)
        place, self._next = self._next, self._next + 1
        self.groups[place] = held
        self._identities.lead(held)
        for left in filter(None, broken):
            self._identities.meet(left)
        self.tell_role(held.tracks, 1)
        return place

    def put(self, place: int, held: Held) -> None:
        """A group as it is led from now on, at its place."""
        self.groups[place] = held
        self._identities.lead(held)

    def fresh(self, place: int) -> Held:
        """A group with what is known of its identities now; of a joint one all that has been learned."""
        held = self.groups[place]
        if len(held.tracks) > 1:
            self._identities.evidence.fold(held.tracks)
        held = self.groups[place] = self._identities.fresh(held)
        return held

    def lose(self, place: int, tracks: Collection[int]) -> Held | None:
        """Lead these tracks no more; what is left of a joint group that breaks up by that."""
        held = self.fresh(place)
        del self.groups[place]
        left = kept(held, set(held.tracks).difference(tracks))
        if left is not None:
            self.groups[place] = left
        self.tell_role(sorted(set(held.tracks).intersection(tracks)), 0)
        return left if left is not held else None

    def tell_role(self, tracks: Collection[int], holds: int) -> None:
        """Record that this node leads some tracks, or does so no more."""
        for track in tracks:
            self._station.node.record(Role(self._station.node.id, f"{LEADER} {track}", holds))

    def tell_change(self, kind: str, parts: Sequence[Held]) -> None:
        """Record a merge or a split, with the tracks of each part."""
        fields = json.dumps({"parts": [list(part.tracks) for part in parts]})
        self._station.node.record(AlgorithmRecord(self._station.node.id, kind, fields))
