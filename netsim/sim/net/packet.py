"""The network layer's packets: a 12-byte header and a fragment of a message."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from netsim.errors import AlgorithmError
from netsim.trace.events import BROADCAST

_HEADER = struct.Struct("<HHHBBHH")
HEADER_BYTE = _HEADER.size
WIRE_BROADCAST = 0xFFFF
MAX_NODE_ID = WIRE_BROADCAST - 1


@dataclass(frozen=True, slots=True)
class Packet:
    """A fragment of a message on its way.

    Attributes:
        origin: Node whose algorithm sent the message.
        destination: Final destination, or `BROADCAST`.
        sequence: The origin's message counter, modulo 65,536: with the origin it names the message.
        kind_code: Code of the message's kind (see `KindTable`).
        hops: Transmissions so far, this one included.
        index: Which fragment this is, from 0.
        count: How many there are.
        chunk: The fragment's bytes.
    """

    origin: int
    destination: int
    sequence: int
    kind_code: int
    hops: int
    index: int
    count: int
    chunk: bytes

    def encode(self) -> bytes:
        """The packet as it goes over the air."""
        destination = WIRE_BROADCAST if self.destination == BROADCAST else self.destination
        header = _HEADER.pack(
            self.sequence, self.origin, destination, self.kind_code, self.hops, self.index, self.count
        )
        return header + self.chunk

    @classmethod
    def decode(cls, data: bytes) -> "Packet":
        """The packet that `encode` gave these bytes."""
        sequence, origin, destination, kind_code, hops, index, count = _HEADER.unpack_from(data)
        destination = BROADCAST if destination == WIRE_BROADCAST else destination
        return cls(origin, destination, sequence, kind_code, hops, index, count, data[HEADER_BYTE:])


def fragments(payload: bytes, chunk_byte: int) -> Iterator[bytes]:
    """Cut a payload into chunks of at most `chunk_byte`; an empty payload is one empty chunk."""
    yield payload[:chunk_byte]
    for start in range(chunk_byte, len(payload), chunk_byte):
        yield payload[start : start + chunk_byte]


class KindTable:
    """One-byte codes of message kinds: what a compiled program would hold as an enumeration, equal on all nodes."""

    def __init__(self) -> None:
        self._codes: dict[str, int] = {}
        self._names: list[str] = []

    def code(self, kind: str) -> int:
        """The code of a kind, new at its first use.

        Raises:
            AlgorithmError: When 256 kinds are in use already.
        """
        if kind not in self._codes:
            if len(self._names) == 256:
                message = f"message kind {kind!r} would be the 257th: a run can tell 256 kinds apart"
                raise AlgorithmError(message)
            self._codes[kind] = len(self._names)
            self._names.append(kind)
        return self._codes[kind]

    def name(self, code: int) -> str:
        """The kind a code stands for."""
        return self._names[code]
