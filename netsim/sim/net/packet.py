"""The network layer's packets: a 12-byte header, fields that only some forms have, and a fragment of a message.

The header, big-endian: form (4 bits), fragment index (14 bits), fragment count (14 bits), sequence (16), origin (16),
destination (16), kind code (8), hops (8). Fields of a form follow it, see `Form`. Beacons and route updates are never
forwarded; after their first byte, whose upper half is the form too, they are laid out by whoever sends them.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

from netsim.errors import AlgorithmError
from netsim.sim.net.regions import region_byte
from netsim.trace.events import BROADCAST

_HEADER = struct.Struct(">IHHHBB")
HEADER_BYTE = _HEADER.size
WIRE_BROADCAST = 0xFFFF
MAX_NODE_ID = WIRE_BROADCAST - 1
MAX_FRAGMENTS = 0x3FFF
GREEDY, PERIMETER = 0, 1
GREEDY_BYTE = 1 + 8
PERIMETER_BYTE = GREEDY_BYTE + 8 + 8 + 4


class Form(IntEnum):
    """What a packet is, and the fields it has after the header."""

    DATA = 0
    """To one node by a table of next hops, or to all in reach; no further fields."""
    BEACON = 1
    """See `netsim.sim.net.beacons`."""
    ROUTE = 2
    """See `netsim.sim.net.distance_vector`."""
    FLOOD = 3
    """Forwarded once by everybody: hop limit (8 bits)."""
    GEOGRAPHIC = 4
    """By position: mode (8), destination x, y (32 each); in perimeter mode the points L_p and L_f (32 each) and the first
    edge e_0 (two ids of 16) of Karp and Kung 2000, table 1."""
    COLLECT = 5
    """Towards a sink: the sender's cost in hundredths of a transmission (16)."""
    GEOCAST_WAY = 6
    """On the way to a region: the region (see `netsim.sim.net.regions`), then as GEOGRAPHIC."""
    GEOCAST = 7
    """Flooded inside a region: the region."""
    MULTICAST = 8
    """One transmission for several neighbours: how many (8), and their ids (16 each)."""


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
        form: What it is.
        fields: The bytes between header and chunk that belong to the form.
    """

    origin: int
    destination: int
    sequence: int
    kind_code: int
    hops: int
    index: int
    count: int
    chunk: bytes
    form: Form = Form.DATA
    fields: bytes = b""

    def encode(self) -> bytes:
        """The packet as it goes over the air."""
        destination = WIRE_BROADCAST if self.destination == BROADCAST else self.destination
        first = self.form << 28 | self.index << 14 | self.count
        header = _HEADER.pack(first, self.sequence, self.origin, destination, self.kind_code, self.hops)
        return header + self.fields + self.chunk

    @classmethod
    def decode(cls, data: bytes) -> "Packet | None":
        """The packet that `encode` gave these bytes; None for bytes that are no packet of an algorithm's message."""
        if len(data) < HEADER_BYTE:
            return None
        first, sequence, origin, destination, kind_code, hops = _HEADER.unpack_from(data)
        index, count = first >> 14 & MAX_FRAGMENTS, first & MAX_FRAGMENTS
        size_byte = fields_byte(first >> 28, data[HEADER_BYTE:])
        if size_byte is None or index >= count:
            return None
        destination = BROADCAST if destination == WIRE_BROADCAST else destination
        end = HEADER_BYTE + size_byte
        form, fields, chunk = Form(first >> 28), data[HEADER_BYTE:end], data[end:]
        return cls(origin, destination, sequence, kind_code, hops, index, count, chunk, form, fields)

    @property
    def key(self) -> tuple[int, int, int]:
        """What tells this fragment from all others of its time."""
        return self.origin, self.sequence, self.index


def fields_byte(form: int, data: bytes) -> int | None:
    """How many of the bytes after the header belong to a form; None if they cannot be that form's."""
    if form in (Form.DATA, Form.FLOOD, Form.COLLECT):
        size_byte: int | None = {Form.DATA: 0, Form.FLOOD: 1, Form.COLLECT: 2}[Form(form)]
    elif form == Form.GEOGRAPHIC:
        size_byte = _geographic_byte(data)
    elif form == Form.GEOCAST_WAY:
        size_byte = _way_byte(data)
    elif form == Form.GEOCAST:
        size_byte = region_byte(data)
    else:
        size_byte = 1 + 2 * data[0] if form == Form.MULTICAST and data else None
    return size_byte if size_byte is not None and size_byte <= len(data) else None


def _geographic_byte(data: bytes) -> int | None:
    size_byte = {GREEDY: GREEDY_BYTE, PERIMETER: PERIMETER_BYTE}.get(data[0]) if data else None
    if size_byte is None or len(data) < size_byte:
        return None
    numbers = struct.unpack_from(f">{2 if size_byte == GREEDY_BYTE else 6}f", data, 1)
    return size_byte if all(math.isfinite(number) for number in numbers) else None


def _way_byte(data: bytes) -> int | None:
    area_byte = region_byte(data)
    way_byte = None if area_byte is None else _geographic_byte(data[area_byte:])
    return None if area_byte is None or way_byte is None else area_byte + way_byte


def encode_ids(nodes: list[int]) -> bytes:
    """The fields of a multicast packet."""
    return struct.pack(f">B{len(nodes)}H", len(nodes), *nodes)


def decode_ids(fields: bytes) -> tuple[int, ...]:
    """The nodes a multicast packet is for."""
    return struct.unpack_from(f">{fields[0]}H", fields, 1)


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

    def name(self, code: int) -> str | None:
        """The kind a code stands for; None for a code that a broken packet made up."""
        return self._names[code] if code < len(self._names) else None
