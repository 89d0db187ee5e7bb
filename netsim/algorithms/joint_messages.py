"""What the groups of joint tracking tell each other, as bytes.

A group is named by its tracks; its word counts by `turn`, which grows with every change of leader.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_identity_messages import decode_acquaintances, encode_acquaintances
from netsim.algorithms.joint_particles import decode_particles, encode_particles
from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, size_byte
from netsim.kernels.particles import ParticleBelief, equal_weights
from netsim.kernels.semiring import FloatArray

_CALL = Record("IHB")  # step, turn, number of tracks
_READING = Record("I")  # step
_SIGHTING = Record("HI")  # leader, track
_GIVEN = Record("IHBBBH")  # step, turn, flags, quiet readings, tracks, particles that are named
_PARTED, _MET, _COUNTED, _BLANK_GIVEN, _WAITING = 1, 2, 4, 8, 16
"""Flags: it is parted, it has met, its particles have counts, it is blank, evidence waits."""
_BLANK = 0x80
"""Flag of a call in the number of tracks: it is blank."""
_TRACK = Record("I")
_TAKEN = Record("IH")  # step, turn
_ASK = Record("IHHB")  # step, turn, member, how often passed on
_MOST_QUIET = 0xFF


@dataclass(frozen=True, slots=True, eq=False)
class Call:
    """A leader's word to its group: read, and tell me.

    Attributes:
        step: Number of the reading.
        turn: How often the group's leader has changed.
        tracks: The group's tracks, ascending.
        estimates_m: Where they were a step ago, shape (M, 2).
        known: What the leader knows of identities, as hearsay, for who takes over without being given anything.
        is_blank: Whether the leader began anew and has had no reading yet.
    """

    step: int
    turn: int
    tracks: tuple[int, ...]
    estimates_m: FloatArray
    known: Acquaintances
    is_blank: bool = False


def encode_call(call: Call) -> bytes:
    """A call as it goes over the air; estimates and rows as float32."""
    count = len(call.tracks) | _BLANK * call.is_blank
    head = _CALL.pack(call.step, call.turn, count) + b"".join(map(_TRACK.pack, call.tracks))
    return head + encode_floats(call.estimates_m.ravel(), "float32") + encode_acquaintances(call.known, "float32")


def decode_call(data: bytes) -> Call:
    """The inverse of `encode_call`."""
    step, turn, flagged = _CALL.unpack(data)
    count = flagged & ~_BLANK
    tracks, offset = _tracks(data, _CALL.size_byte, count)
    end = offset + size_byte(2 * count, "float32")
    estimates_m = decode_floats(data[offset:end], "float32").reshape(count, 2)
    known, _ = decode_acquaintances(data, end, "float32")
    return Call(step, turn, tracks, estimates_m, known, bool(flagged & _BLANK))


@dataclass(frozen=True, slots=True)
class Ask:
    """A member's question for later words on some tracks.

    Attributes:
        step: Of the last word that it heard.
        turn: Of the same.
        member: Node to answer to.
        passed: How often the question was passed on.
        tracks: Those of which it heard nothing since.
    """

    step: int
    turn: int
    member: int
    passed: int
    tracks: tuple[int, ...]


def encode_ask(ask: Ask) -> bytes:
    """A question as it goes over the air."""
    return _ASK.pack(ask.step, ask.turn, ask.member, ask.passed) + b"".join(map(_TRACK.pack, ask.tracks))


def decode_ask(data: bytes) -> Ask:
    """The inverse of `encode_ask`."""
    count = (len(data) - _ASK.size_byte) // _TRACK.size_byte
    step, turn, member, passed = _ASK.unpack(data)
    return Ask(step, turn, member, passed, _tracks(data, _ASK.size_byte, count)[0])


def _tracks(data: bytes, offset: int, count: int) -> tuple[tuple[int, ...], int]:
    """Track numbers at an offset, and where they end."""
    offsets = range(offset, offset + count * _TRACK.size_byte, _TRACK.size_byte)
    return tuple(int(_TRACK.unpack(data, at)[0]) for at in offsets), offset + count * _TRACK.size_byte


@dataclass(frozen=True, slots=True)
class Sighting:
    """A track of another group in whose range a member is too: its groups collide.

    Attributes:
        leader: Node that leads it.
        track: Its number.
        x_m: Where it was a step ago.
        y_m: Where it was a step ago.
    """

    leader: int
    track: int
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Reading:
    """What a member tells its leader.

    Attributes:
        step: Number of the reading.
        energy: What it read.
        others: Tracks of other groups whose calls for this step it heard, and in whose range it is too.
    """

    step: int
    energy: float
    others: tuple[Sighting, ...]


def encode_reading(reading: Reading) -> bytes:
    """A reading as it goes over the air."""
    parts = [_READING.pack(reading.step), encode_floats([reading.energy], "float32")]
    for other in reading.others:
        parts += [_SIGHTING.pack(other.leader, other.track), encode_floats([other.x_m, other.y_m], "float32")]
    return b"".join(parts)


def decode_reading(data: bytes) -> Reading:
    """The inverse of `encode_reading`."""
    (step,) = _READING.unpack(data)
    first = _READING.size_byte + 4
    energy = float(decode_floats(data[first - 4 : first], "float32")[0])
    others = tuple(_sighting(data, offset) for offset in range(first, len(data), _SIGHTING.size_byte + 8))
    return Reading(step, energy, others)


def _sighting(data: bytes, offset: int) -> Sighting:
    leader, track = _SIGHTING.unpack(data, offset)
    begin = offset + _SIGHTING.size_byte
    return Sighting(leader, track, *decode_floats(data[begin : begin + 8], "float32").tolist())


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """A group as its leader holds it.

    Attributes:
        step: The last reading in its belief.
        turn: How often its leader has changed.
        tracks: Its tracks; the belief's targets in this order.
        belief: Where the targets are.
        known: What is known of identities, of its tracks and those that they are acquainted with.
        is_parted: Whether it came from a split, and its groups have collided ever since.
        has_met: Whether its targets have been within the distance of separation since they were joined.
        quiet: Readings in a row in which no member read a target, or that are explained better by one target less.
        is_blank: Whether its belief began anew, and has no reading in it yet.
        waiting: What was learned of who each track is and has not been told yet, as a likelihood of each identity; nothing
            if there is nothing.
        spare: The track without which the last reading is explained better than with all; the leader alone knows it.
    """

    step: int
    turn: int
    tracks: tuple[int, ...]
    belief: ParticleBelief
    known: Acquaintances
    is_parted: bool = False
    has_met: bool = False
    quiet: int = 0
    is_blank: bool = False
    waiting: tuple[tuple[float, ...], ...] = ()
    spare: int | None = None

    @property
    def rows(self) -> FloatArray:
        """Identity rows of the tracks, shape (M, targets)."""
        return np.stack([self.known.row(track) for track in self.tracks])

    @property
    def name(self) -> int:
        """The lowest of its tracks."""
        return min(self.tracks)

    @property
    def label(self) -> str:
        """Its tracks, in words."""
        return label_of(self.tracks)


def label_of(tracks: Sequence[int]) -> str:
    """Tracks in words."""
    return " and ".join(f"track {track}" for track in tracks)


def encode_given(held: Held, width: FloatWidth) -> bytes:
    """A group as it is given; its particles have equal weights, and those that are alike are named once."""
    particles, named, has_counts = encode_particles(held.belief.positions_m, width)
    flags = _PARTED * held.is_parted | _MET * held.has_met | _COUNTED * has_counts | _BLANK_GIVEN * held.is_blank
    flags |= _WAITING * bool(held.waiting)
    head = _GIVEN.pack(held.step, held.turn, flags, min(held.quiet, _MOST_QUIET), len(held.tracks), named)
    waiting = encode_floats(np.ravel(held.waiting), "float32")
    return head + b"".join(map(_TRACK.pack, held.tracks)) + encode_acquaintances(held.known) + waiting + particles


def decode_given(data: bytes, width: FloatWidth) -> Held:
    """The inverse of `encode_given`, but for the order of the particles: that of their coordinates."""
    step, turn, flags, quiet, count, named = _GIVEN.unpack(data)
    tracks, offset = _tracks(data, _GIVEN.size_byte, count)
    known, end = decode_acquaintances(data, offset)
    waiting, end = _waiting(data, end, (count, known.start.shape[1])) if flags & _WAITING else ((), end)
    belief = equal_weights(decode_particles(data[end:], named, bool(flags & _COUNTED), count, width))
    is_parted, has_met, is_blank = (bool(flags & flag) for flag in (_PARTED, _MET, _BLANK_GIVEN))
    return Held(step, turn, tracks, belief, known, is_parted, has_met, quiet, is_blank, waiting)


def _waiting(data: bytes, offset: int, shape: tuple[int, int]) -> tuple[tuple[tuple[float, ...], ...], int]:
    """Evidence that waits, and where it ends."""
    end = offset + size_byte(shape[0] * shape[1], "float32")
    likelihoods = decode_floats(data[offset:end], "float32").reshape(shape).tolist()
    return tuple(tuple(each) for each in likelihoods), end


def encode_taken(held: Held) -> bytes:
    """The confirmation of a group that was given."""
    return _TAKEN.pack(held.step, held.turn) + b"".join(map(_TRACK.pack, held.tracks))
