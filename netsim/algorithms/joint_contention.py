"""Two leaders of one track: who goes on, and how the other one learns of it."""

from dataclasses import replace

from netsim.algorithms.joint_book import call_of
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_groups import places_of
from netsim.algorithms.joint_holding import Holding
from netsim.algorithms.joint_identity import Identities
from netsim.algorithms.joint_messages import Call, Held, encode_call
from netsim.algorithms.joint_station import CALL, CLAIM, Station
from netsim.api import Message


class Contention:
    """Of two that lead a track the one with more turns goes on, of equal turns the lower node.

    But one that has begun anew and has no reading yet gives way to one that has lately had readings: such a claim is
    false, made by a member that missed this leader's calls.

    Args:
        station: The node.
        holding: What it leads.
        identities: Told who leads tracks instead.
    """

    def __init__(self, station: Station, holding: Holding, identities: Identities) -> None:
        self._station, self._holding, self._identities = station, holding, identities

    def hear(self, message: Message, call: Call) -> None:
        """Another leader speaks for some tracks."""
        if not call.is_blank:
            self._holding.turns.note(call.tracks, call.turn, message.source)
        for place, held in list(self._holding.groups.items()):
            if set(held.tracks) & set(call.tracks):
                self._contend(place, message, call)

    def _contend(self, place: int, message: Message, call: Call) -> None:
        held = self._holding.groups[place]
        if call.is_blank and not held.is_blank and held.step >= call.step - 1:
            self._refute(place, message, call)
        elif (held.turn, -self._station.node.id) < (call.turn, -message.source):
            self._station.node.log(f"node {message.source} leads {held.label} since, or a part: giving way")
            self._give_way(place, call.tracks, Place(call.turn, message.source))
        elif message.kind == CALL:  # who is to give way may be out of the region of this group's calls
            self.assert_to(message.source, held, message)

    def _give_way(self, place: int, tracks: tuple[int, ...], leader: Place) -> None:
        held = self._holding.groups[place]
        left = self._holding.lose(place, tracks)
        self._identities.leave(sorted(set(held.tracks) & set(tracks)), leader)
        if left is not None:
            self._identities.meet(left)

    def _refute(self, place: int, message: Message, call: Call) -> None:
        """Contradict a false claim, with a turn above its own (SWIM's incarnation numbers, Das et al. 2002, section 4.2)."""
        if place in self._holding.leaving:
            return  # the turn is offered already; whoever takes the group hears the next call, and contradicts it
        held = self._holding.groups[place]
        if held.turn <= call.turn:
            self._holding.put(place, replace(held, turn=call.turn + 1))
        self.assert_to(message.source, self._holding.groups[place], message)

    def assert_to(self, other: int, held: Held, cause: Message | None = None) -> None:
        """Tell a node that leads a group, or perhaps does, that this one leads it."""
        word = encode_call(call_of(held, held.step, places_of(held)))
        self._station.node.send(other, CLAIM, word, causes=[] if cause is None else [cause])
