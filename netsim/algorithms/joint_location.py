"""How leaders find each other after tracks have changed hands (Liu et al. 2004, section 5): by pointers or a rendezvous.

Forwarding pointers: whoever has given a track away knows to whom, and passes words on. Turns grow along the way, so it ends;
the leader answers directly, which shortens the way for the next word. A rendezvous is the sensor nearest to a place that
follows from the track's number alone, as in a geographic hash table (Ratnasamy et al. 2002): leaders register with it.
"""

import hashlib
from collections.abc import Callable

from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_identity_messages import (
    decode_locate,
    decode_located,
    decode_register,
    encode_locate,
    encode_located,
    encode_register,
)
from netsim.algorithms.joint_station import Station
from netsim.api import Message, Op
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge
from netsim.units import s_to_ns

REGISTER, REGISTERED, LOCATE, LOCATED = "register", "registered", "locate", "located"


def home_of(track: int, knowledge: EnergyTrackingKnowledge) -> int:
    """The sensor that keeps where a track's leader is: nearest to a place in the sensors' bounding box drawn by hashing."""
    places_m = knowledge.places_m(knowledge.sensors_m)
    words = hashlib.blake2b(f"track {track}".encode(), digest_size=16).digest()
    shares = [int.from_bytes(words[begin : begin + 8], "big") / 2.0**64 for begin in (0, 8)]
    low_m, size_m = places_m.min(axis=0), places_m.max(axis=0) - places_m.min(axis=0)
    x_m, y_m = (low_m + size_m * shares).tolist()
    return knowledge.nearest((x_m, y_m))[0]


def ask(
    station: Station, receiver: int, kind: str, payload: bytes, answers: str, fits: Callable[[Message], bool]
) -> Op[Message | None]:
    """Send a message until an answer comes, `tell_attempts` times; None where none does."""
    node, parameters = station.node, station.parameters
    for _ in range(parameters.tell_attempts):
        node.send(receiver, kind, payload)
        answer = yield from node.receive(kinds={answers}, match=fits, timeout_ns=s_to_ns(parameters.tell_s))
        if answer is not None:
            return answer
    return None


class Whereabouts:
    """What a node knows of where tracks' leaders are."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._pointers: dict[int, Place] = {}
        """To whom this node has given tracks."""
        self._registered: dict[int, Place] = {}
        """Tracks whose rendezvous this node is."""
        self._number = 0

    @property
    def _by_rendezvous(self) -> bool:
        return self._station.parameters.location == "rendezvous"

    def took(self, track: int, turn: int) -> None:
        """This node leads a track."""
        self._pointers.pop(track, None)
        if self._by_rendezvous:
            place, home = Place(turn, self._station.node.id), home_of(track, self._station.knowledge)
            if home == self._station.node.id:
                self._note(track, place)
            else:
                self._station.node.spawn(self._register(track, place, home))

    def left(self, track: int, place: Place) -> None:
        """Another node leads a track that this node led."""
        if place.leader != self._station.node.id:
            self._pointers[track] = place

    def next_of(self, track: int) -> int | None:
        """To whom a word for a track is to be passed on; None where this node never gave it, or others are asked."""
        pointer = self._pointers.get(track)
        return None if pointer is None or self._by_rendezvous else pointer.leader

    def find(self, track: int, last: Place) -> Op[int]:
        """A track's leader, as far as one can find out, given where it was."""
        pointer = self._pointers.get(track, last)
        best = max(last, pointer, key=lambda place: place.turn)
        if not self._by_rendezvous:
            return best.leader
        home = home_of(track, self._station.knowledge)
        is_here = home == self._station.node.id
        found = self._registered.get(track) if is_here else (yield from self._asked(track, home))
        return best.leader if found is None or found.turn < best.turn else found.leader

    def serve(self, message: Message) -> None:
        """A leader registers, or somebody asks."""
        node = self._station.node
        if message.kind == REGISTER:
            self._note(*decode_register(message.payload))
            node.send(message.source, REGISTERED, message.payload, causes=[message])
        else:
            number, track = decode_locate(message.payload)
            answer = encode_located(number, track, self._registered.get(track))
            node.send(message.source, LOCATED, answer, causes=[message])

    def _note(self, track: int, place: Place) -> None:
        known = self._registered.get(track)
        if known is None or known.turn <= place.turn:
            self._registered[track] = place

    def _register(self, track: int, place: Place, home: int) -> Op[None]:
        payload = encode_register(self._new_number(), track, place)
        answer = yield from ask(
            self._station, home, REGISTER, payload, REGISTERED, lambda message: message.payload == payload
        )
        if answer is None:
            self._station.node.log(f"node {home} does not confirm that track {track} is led here")

    def _asked(self, track: int, home: int) -> Op[Place | None]:
        number = self._new_number()
        payload = encode_locate(number, track)
        answer = yield from ask(
            self._station, home, LOCATE, payload, LOCATED, lambda m: decode_located(m.payload)[:2] == (number, track)
        )
        return None if answer is None else decode_located(answer.payload)[2]

    def _new_number(self) -> int:
        self._number = (self._number + 1) % 2**16
        return self._number
