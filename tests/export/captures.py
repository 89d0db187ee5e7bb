"""Reads a capture by the book, for tests: libpcap's file format and the header of IEEE 802.15.4 TAP."""

import struct
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Captured:
    """One record: its time, the fields of its header by number, the frame itself."""

    time_ns: int
    fields: dict[int, bytes]
    psdu: bytes

    @property
    def rss_dbm(self) -> float | None:
        return struct.unpack("<f", self.fields[1])[0] if 1 in self.fields else None

    @property
    def channel(self) -> tuple[int, int] | None:
        return struct.unpack("<HB", self.fields[3]) if 3 in self.fields else None

    @property
    def span_ns(self) -> tuple[int, int]:
        return struct.unpack("<Q", self.fields[5])[0], struct.unpack("<Q", self.fields[6])[0]

    @property
    def sequence(self) -> int:
        return self.psdu[2]

    @property
    def addresses(self) -> tuple[int, int]:
        """Destination and source of a data frame."""
        return struct.unpack("<HH", self.psdu[5:9])


def read_capture(path: Path) -> list[Captured]:
    data = path.read_bytes()
    magic, major, minor, _, _, snap, link = struct.unpack_from("<IHHiIII", data)
    assert (magic, major, minor, link) == (0xA1B23C4D, 2, 4, 283)
    at, found = 24, []
    while at < len(data):
        seconds, rest_ns, kept, length = struct.unpack_from("<IIII", data, at)
        assert kept == length <= snap
        assert rest_ns < 10**9
        found.append(_record(seconds * 10**9 + rest_ns, data[at + 16 : at + 16 + kept]))
        at += 16 + kept
    assert at == len(data)
    return found


def _record(time_ns: int, packet: bytes) -> Captured:
    version, reserved, length = struct.unpack_from("<BBH", packet)
    assert (version, reserved, length % 4) == (0, 0, 0)
    fields, at = {}, 4
    while at < length:
        number, size = struct.unpack_from("<HH", packet, at)
        fields[number] = packet[at + 4 : at + 4 + size]
        at += 4 + (size + 3) // 4 * 4
    assert at == length
    return Captured(time_ns, fields, packet[length:])
