"""Link-layer frames of IEEE 802.15.4 as bytes: data frames and acknowledgements with short addresses and one PAN id.

After IEEE 802.15.4-2006, clauses 7.2.1 (frame format), 7.2.1.9 (checksum), 7.2.2.2 (data), 7.2.2.3 (acknowledgement).
"""

import struct
from binascii import crc_hqx

PAN_ID = 0x4E53
"""Of all frames: a run is one network."""
BROADCAST_ADDRESS = 0xFFFF
MAX_ADDRESS = 0xFFFE
FCS_BYTE = 2

_HEAD = struct.Struct("<HBHHH")
_ACK_HEAD = struct.Struct("<HB")
_DATA_CONTROL = 0x8841
"""Data, PAN id compressed, 16-bit addresses of destination (bits 10, 11) and source (14, 15)."""
_ACK_REQUEST = 0x0020
_ACK_CONTROL = 0x0002
_FIRST_BYTE = b"\x3f"
"""Of the payload: to a dissector the mark of something that is no 6LoWPAN; after zero it would take filling for a header."""
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))

DATA_OVERHEAD_BYTE = _HEAD.size + FCS_BYTE
ACK_BYTE = _ACK_HEAD.size + FCS_BYTE


def data_frame(source: int, destination: int, sequence: int, size_byte: int, *, wants_ack: bool) -> bytes:
    """A data frame with filling for a payload.

    Args:
        source: Short address of the sender.
        destination: Short address of the receiver, or `BROADCAST_ADDRESS`.
        sequence: Data sequence number, 0 to 255.
        size_byte: Size of the whole, checksum included; at least `DATA_OVERHEAD_BYTE`.
        wants_ack: Whether it asks for an acknowledgement.
    """
    control = _DATA_CONTROL | (_ACK_REQUEST if wants_ack else 0)
    payload = (_FIRST_BYTE + bytes(size_byte))[: size_byte - DATA_OVERHEAD_BYTE]
    return _closed(_HEAD.pack(control, sequence, PAN_ID, destination, source) + payload)


def acknowledgement(sequence: int) -> bytes:
    """The answer to the frame with this sequence number; it carries no address."""
    return _closed(_ACK_HEAD.pack(_ACK_CONTROL, sequence))


def checksum(data: bytes) -> bytes:
    """The frame check sequence: the 16-bit cyclic redundancy check of ITU-T, x^16 + x^12 + x^5 + 1, low bit first."""
    remainder = crc_hqx(data.translate(_REVERSED), 0)
    return bytes((_REVERSED[remainder >> 8], _REVERSED[remainder & 0xFF]))


def _closed(data: bytes) -> bytes:
    return data + checksum(data)
