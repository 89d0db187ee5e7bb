"""The records of an MCAP file, and what goes wrong in reading them. See https://mcap.dev/spec."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk

from netsim.errors import TraceError

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<HIQQ")
FOOTER = struct.Struct("<QQI")
BROKEN = (McapError, struct.error, ValueError, KeyError, OverflowError, MemoryError, zstandard.ZstdError)
"""What broken bytes can raise."""


def file_records(path: Path) -> Iterator[tuple[int, bytes]]:
    """The records of the data section as opcode and content; ends with `DATA_END` unless the file was cut short."""
    try:
        with path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                msg = f"{path}: not an MCAP file"
                raise TraceError(msg)
            opcode = 0
            while opcode != Opcode.DATA_END:
                head = stream.read(RECORD.size)
                if len(head) < RECORD.size:
                    return
                opcode, length = RECORD.unpack(head)
                if length > path.stat().st_size - stream.tell():
                    return
                yield opcode, stream.read(length)
    except OSError as error:
        raise unreadable(path, error) from error


def chunk_records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The records of an unpacked chunk as opcode and content."""
    at = 0
    while at < len(data):
        opcode, length = RECORD.unpack_from(data, at)
        at += RECORD.size
        yield opcode, data[at : at + length]
        at += length


def uncompressed(chunk: Chunk) -> bytes:
    """The records of a chunk, checked against its checksum."""
    data = zstandard.decompress(chunk.data, chunk.uncompressed_size) if chunk.compression == "zstd" else chunk.data
    if zlib.crc32(data) != chunk.uncompressed_crc:
        msg = "a chunk has a wrong checksum"
        raise ValueError(msg)
    return data


def from_bytes(body: bytes) -> ReadDataStream:
    """The content of a record, for the record classes of `mcap`."""
    return ReadDataStream(BytesIO(body))


@contextmanager
def blame(path: Path) -> Iterator[None]:
    """Turn what broken bytes can raise into a `TraceError` that names the file."""
    try:
        yield
    except (TraceError, *BROKEN) as error:
        raise damaged(path, error) from error


def damaged(path: Path | str, error: Exception) -> TraceError:
    """The error of a file whose bytes are broken."""
    return TraceError(f"{path}: {error}" if isinstance(error, TraceError) else f"{path}: damaged: {error}")


def unreadable(path: Path | str, error: OSError) -> TraceError:
    """The error of a file that cannot be read."""
    return TraceError(f"{path}: cannot read the trace: {error.strerror or error}")
