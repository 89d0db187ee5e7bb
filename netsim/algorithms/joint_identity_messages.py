"""What leaders tell each other of identities, and of where they are, as bytes."""

import struct
from dataclasses import dataclass

import numpy as np

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import EVEN, EVIDENCE, Change, Epoch, Place
from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, size_byte
from netsim.errors import AlgorithmError

_GROUP = Record("BHH")  # tracks, identities, changes
_TRACK = Record("IHHHIH")  # track, epoch (era, heard, check), turn of its group, leader
_CHANGE = Record("HHIHBB")  # clock, author, first track, era, kind, tracks
_NAME = Record("I")
_WORD = Record("HHIB")  # number, who asks, track, how often it was passed on
_HEARD = Record("HII")  # number of the word, track, turn
_REGISTER = Record("HIIH")  # number, track, turn, leader
_LOCATE = Record("HI")  # number, track
_LOCATED = Record("HIIHB")  # number, track, turn, leader, whether it is known


def encode_acquaintances(known: Acquaintances, width: FloatWidth = "float64") -> bytes:
    """A copy with its changes; hearsay survives in float32."""
    parts = [_GROUP.pack(len(known.tracks), known.start.shape[1], len(known.changes))]
    for track, epoch, place in zip(known.tracks, known.epochs, known.places, strict=True):
        parts.append(_TRACK.pack(track, epoch.era, epoch.heard, epoch.check, place.turn, place.leader))
    parts.append(encode_floats(known.start.ravel(), width))
    return b"".join([*parts, *map(_encode_change, known.changes)])


def _encode_change(change: Change) -> bytes:
    head = _CHANGE.pack(*change.number, change.era, change.kind, len(change.tracks))
    width: FloatWidth = "float32" if change.kind == EVIDENCE else "float64"
    return head + b"".join(map(_NAME.pack, change.tracks)) + encode_floats(change.values, width)


def decode_acquaintances(data: bytes, offset: int = 0, width: FloatWidth = "float64") -> tuple[Acquaintances, int]:
    """The inverse of `encode_acquaintances`, and where it ends."""
    count, identities, changes = _GROUP.unpack(data, offset)
    offset += _GROUP.size_byte
    heads = [_TRACK.unpack(data, offset + index * _TRACK.size_byte) for index in range(count)]
    offset += count * _TRACK.size_byte
    end = offset + size_byte(count * identities, width)
    start = decode_floats(data[offset:end], width).reshape(count, identities)
    found = []
    for _ in range(changes):
        change, end = _decode_change(data, end, identities)
        found.append(change)
    epochs = tuple(Epoch(*head[1:4]) for head in heads)
    places = tuple(Place(*head[4:]) for head in heads)
    return Acquaintances(tuple(head[0] for head in heads), start, epochs, tuple(found), places), end


def _decode_change(data: bytes, offset: int, identities: int) -> tuple[Change, int]:
    clock, author, first, era, kind, count = _CHANGE.unpack(data, offset)
    offset += _CHANGE.size_byte
    tracks = tuple(int(_NAME.unpack(data, offset + index * _NAME.size_byte)[0]) for index in range(count))
    offset += count * _NAME.size_byte
    width: FloatWidth = "float32" if kind == EVIDENCE else "float64"
    entries = identities if kind == EVIDENCE else 0 if kind == EVEN else count * count
    end = offset + size_byte(entries, width)
    values = tuple(np.asarray(decode_floats(data[offset:end], width)).tolist())
    return Change((clock, author, first), era, kind, tracks, values), end


@dataclass(frozen=True, slots=True, eq=False)
class Word:
    """What one leader tells another.

    Attributes:
        number: Of the word, for its confirmation.
        origin: Node that leads the sender's track.
        track: Track whose leader is meant, whoever that is by now.
        passed: How many former leaders have passed it on.
        known: What the sender knows.
    """

    number: int
    origin: int
    track: int
    passed: int
    known: Acquaintances


def encode_word(word: Word) -> bytes:
    """A word as it goes over the air."""
    return _WORD.pack(word.number, word.origin, word.track, word.passed) + encode_acquaintances(word.known)


def decode_word(data: bytes) -> Word:
    """The inverse of `encode_word`.

    Raises:
        AlgorithmError: For bytes that are no word.
    """
    try:
        number, origin, track, passed = _WORD.unpack(data)
        return Word(number, origin, track, passed, decode_acquaintances(data, _WORD.size_byte)[0])
    except (struct.error, ValueError) as error:
        message = f"a word of {len(data)} bytes on identities: {error}"
        raise AlgorithmError(message) from error


def encode_heard(number: int, track: int, turn: int) -> bytes:
    """Confirmation of a word by the track's leader, whose group has changed hands so often."""
    return _HEARD.pack(number, track, turn)


def decode_heard(data: bytes) -> tuple[int, int, int]:
    """The inverse of `encode_heard`."""
    number, track, turn = _HEARD.unpack(data)
    return number, track, turn


def encode_register(number: int, track: int, place: Place) -> bytes:
    """A leader says where it is; the confirmation is the same bytes."""
    return _REGISTER.pack(number, track, place.turn, place.leader)


def decode_register(data: bytes) -> tuple[int, Place]:
    """Track and place."""
    _, track, turn, leader = _REGISTER.unpack(data)
    return track, Place(turn, leader)


def encode_locate(number: int, track: int) -> bytes:
    """Where is a track's leader?"""
    return _LOCATE.pack(number, track)


def decode_locate(data: bytes) -> tuple[int, int]:
    """Number of the question, and the track."""
    number, track = _LOCATE.unpack(data)
    return number, track


def encode_located(number: int, track: int, place: Place | None) -> bytes:
    """There, or unknown."""
    known = place or Place(0, 0)
    return _LOCATED.pack(number, track, known.turn, known.leader, place is not None)


def decode_located(data: bytes) -> tuple[int, int, Place | None]:
    """Number of the question, the track, and where its leader is."""
    number, track, turn, leader, is_known = _LOCATED.unpack(data)
    return number, track, Place(turn, leader) if is_known else None
