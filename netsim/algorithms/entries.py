"""How messages between vertices stand in a payload: one message to a node carries all that one round has for it."""

from collections.abc import Iterable

from netsim.algorithms.message_passing_parameters import LAST_ROUND
from netsim.api import Message
from netsim.codec import Precision, Record, decode_count, decode_floats, encode_count, encode_floats, size_byte
from netsim.kernels.semiring import FloatArray

EdgeMessage = tuple[int, int, FloatArray]
"""Source vertex, destination vertex, log message."""
_ENTRY = Record("HHH")  # round or step modulo 65,536, source vertex, destination vertex; the number of entries follows
_ROUND = Record("H")  # what every payload begins with


def encode_entries(round_number: int, entries: Iterable[tuple[int, int, FloatArray]], width: Precision) -> bytes:
    """Messages for one node as one payload: (source vertex, destination vertex, log message) each."""
    return b"".join(
        _ENTRY.pack(round_number & LAST_ROUND, source, destination)
        + encode_count(len(message))
        + encode_floats(message, width)
        for source, destination, message in entries
    )


def decode_entries(payload: bytes, width: Precision) -> list[tuple[int, int, int, FloatArray]]:
    """The (round, source, destination, log message) that `encode_entries` put into a payload."""
    entries = []
    offset = 0
    while offset < len(payload):
        round_number, source, destination = _ENTRY.unpack(payload, offset)
        size, begin = decode_count(payload, offset + _ENTRY.size_byte)
        offset = begin + size_byte(size, width)
        entries.append((round_number, source, destination, decode_floats(payload[begin:offset], width)))
    return entries


def is_due(number: int, message: Message) -> bool:
    """Whether a message belongs to a round before this one; all its entries are of one round."""
    return not message.payload or int(_ROUND.unpack(message.payload, 0)[0]) < number
