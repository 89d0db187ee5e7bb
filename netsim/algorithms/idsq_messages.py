"""What the nodes of the IDSQ tracker say to each other, and what a leader holds.

Kinds: `handoff` the belief; `taken` the answer of who leads now; `lead` a claim, broadcast once a step, the answer to
`alive`, and what is passed on of claims after an alarm; `alive` a guard's question to its successor; `detect` a watchdog's
alarm.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from netsim.codec import Record
from netsim.kernels.grid_belief import GridBelief

HANDOFF: Final = "handoff"
TAKEN: Final = "taken"
LEAD: Final = "lead"
ALIVE: Final = "alive"
DETECT: Final = "detect"
NOBODY: Final = 0xFFFF
"""Leader of a track that has ended."""
TOLD: Final = 0
"""The track whose first leader was told that it leads."""
_LIMIT_DM: Final = 32_767
_LAST_EPOCH: Final = 0xFFFE
_THREAD = Record("IB")  # track, number
_TURN = Record("HI")  # epoch, step
_COUNTS = Record("BB")  # quiet, refused
_CLAIM = Record("Hhh")  # leader, x, y in decimetres
_ENERGY = Record("B")
_ALARM = Record("IH")  # step, loudness in hundredths

Point = tuple[float, float]


def new_track(node: int, step: int) -> int:
    """A number for a track that no other node gives, nor this one within 65,536 steps; it tells the track's age."""
    return (node + 1) << 16 | step & 0xFFFF


def is_elder(track: int, other: int) -> bool:
    """Whether a track began before another; of those that began at one step, the one of the lower node."""
    return (track & 0xFFFF, track >> 16) < (other & 0xFFFF, other >> 16)


@dataclass(frozen=True, slots=True)
class Thread:
    """One of the redundant threads of a track.

    Attributes:
        track: Number of the track in the network.
        number: Of the thread, from 0.
    """

    track: int
    number: int = 0


@dataclass(frozen=True, slots=True)
class Turn:
    """How far a thread has come: of two, the greater one counts.

    Attributes:
        epoch: Twice as often as it was taken back, and one more if it was handed on since after a try that may have arrived
            unnoticed. So a leader that nobody hears does not outdo the one who took its place.
        step: Step of the belief.
    """

    epoch: int
    step: int


@dataclass(frozen=True, slots=True)
class Held:
    """What a leader holds.

    Attributes:
        thread: Of which track.
        turn: How far it has come.
        belief: After the reading of that step.
        previous: The leader before; None for the first.
        quiet: How many readings in a row told of no target.
        refused: How many in a row were refused as outliers.
    """

    thread: Thread
    turn: Turn
    belief: GridBelief
    previous: int | None = None
    quiet: int = 0
    refused: int = 0

    @property
    def step(self) -> int:
        """Step of the belief."""
        return self.turn.step

    def again(self) -> "Held":
        """The same, where another hand-off of it may be about."""
        return replace(self, turn=Turn(self.turn.epoch | 1, self.step))

    def taken_back(self) -> "Held":
        """The same in the next epoch."""
        return replace(self, turn=Turn(min((self.turn.epoch | 1) + 1, _LAST_EPOCH), self.step))

    @property
    def header(self) -> bytes:
        """What stands in front of the belief."""
        return _thread(self.thread) + _turn(self.turn) + _COUNTS.pack(min(self.quiet, 0xFF), min(self.refused, 0xFF))


@dataclass(frozen=True, slots=True)
class Claim:
    """Who leads a thread.

    Attributes:
        thread: The thread.
        turn: How far it has come.
        leader: Who leads it from now on; `NOBODY` where it has ended.
        place_m: Estimate of the target's position.
    """

    thread: Thread
    turn: Turn
    leader: int
    place_m: Point

    @property
    def rank(self) -> tuple[int, int, int]:
        """Of two claims of one thread the greater counts: the later turn, the end, then the lower node."""
        return self.turn.epoch, self.turn.step, 1 if self.leader == NOBODY else -self.leader


def claim_of(held: Held, leader: int) -> Claim:
    """That a node leads a thread, where its belief says the target is."""
    x_m, y_m = held.belief.mean_m.tolist()
    return Claim(held.thread, held.turn, leader, (x_m, y_m))


def turn_of(data: bytes) -> tuple[Thread, Turn]:
    """Thread and turn at the start of a payload.

    Raises:
        struct.error: If it is too short.
    """
    return Thread(*_THREAD.unpack(data)), Turn(*_TURN.unpack(data, _THREAD.size_byte))


def decode_handoff(data: bytes, source: int, decode: Callable[[bytes], GridBelief]) -> Held:
    """What a `handoff` from a node says.

    Args:
        data: The payload.
        source: Who sent it.
        decode: Makes a belief of bytes.

    Raises:
        struct.error: If it is too short.
        ValueError: If it holds no belief.
    """
    thread, turn = turn_of(data)
    quiet, refused = _COUNTS.unpack(data, _START_BYTE)
    return Held(thread, turn, decode(belief_bytes(data)), source, quiet, refused)


def belief_bytes(data: bytes) -> bytes:
    """The belief in a `handoff`."""
    return data[_START_BYTE + _COUNTS.size_byte :]


def encode_taken(held: Held, energy_share: float) -> bytes:
    """That a belief was taken, and what share of its energy the node has left (in 255ths)."""
    return _thread(held.thread) + _turn(held.turn) + _ENERGY.pack(round(255.0 * min(max(energy_share, 0.0), 1.0)))


def decode_energy(data: bytes) -> float:
    """The share of energy in a `taken`."""
    return float(_ENERGY.unpack(data, _START_BYTE)[0]) / 255.0


def encode_question(thread: Thread, turn: Turn) -> bytes:
    """Whether the leader of a thread is alive."""
    return _thread(thread) + _turn(turn)


def encode_claim(claim: Claim, origin_m: Point) -> bytes:
    """A claim; the place in whole decimetres from the grid's origin, 3.2 km at most."""
    x, y = (_decimetres(place - origin) for place, origin in zip(claim.place_m, origin_m, strict=True))
    return _thread(claim.thread) + _turn(claim.turn) + _CLAIM.pack(claim.leader, x, y)


def decode_claim(data: bytes, origin_m: Point) -> Claim:
    """See `encode_claim`.

    Raises:
        struct.error: If it is too short.
    """
    leader, x, y = _CLAIM.unpack(data, _START_BYTE)
    return Claim(*turn_of(data), leader, (origin_m[0] + x / 10.0, origin_m[1] + y / 10.0))


def encode_alarm(step: int, loudness: float) -> bytes:
    """What a node hears at a step, in hundredths, 655 at most."""
    return _ALARM.pack(step, loudness_code(loudness))


def decode_alarm(data: bytes) -> tuple[int, int]:
    """Step and loudness in hundredths.

    Raises:
        struct.error: If it is too short.
    """
    step, code = _ALARM.unpack(data)
    return int(step), int(code)


def loudness_code(loudness: float) -> int:
    """A loudness in hundredths, from 0 to 65,535."""
    return min(max(round(100.0 * loudness), 0), 0xFFFF)


def _decimetres(offset_m: float) -> int:
    return min(max(round(10.0 * offset_m), -_LIMIT_DM), _LIMIT_DM)


def _thread(thread: Thread) -> bytes:
    return _THREAD.pack(thread.track, thread.number)


def _turn(turn: Turn) -> bytes:
    return _TURN.pack(turn.epoch, turn.step)


_START_BYTE: Final = _THREAD.size_byte + _TURN.size_byte
