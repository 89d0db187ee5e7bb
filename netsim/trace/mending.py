"""A whole trace of one that was cut short, for readers that want the index at the end of the file.

Without it Rerun's reader loses all messages of some topics. The copy has the bytes of the trace up to its last whole record;
only the index is made anew, so that the size of the file is what it takes, not the number of events in it.
"""

import struct
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, MessageIndex, Schema, Statistics

from netsim.trace.reader import is_complete, warn_cut
from netsim.trace.records import (
    FOOTER,
    MAGIC,
    MESSAGE,
    RECORD,
    blame,
    chunk_records,
    file_records,
    from_bytes,
    uncompressed,
)

_CHANNEL = struct.Struct("<H")
_INDEX_HEAD_BYTE = 6
_INDEX_ENTRY_BYTE = 16
_NO_CHECKSUM = 0


@contextmanager
def mended(path: Path, *, warns: bool = True) -> Iterator[Path]:
    """The trace itself, or for as long as this lasts a whole copy of what there is of one that was cut short.

    Args:
        path: The trace.
        warns: Whether to say that it was cut short.

    Warns:
        TruncatedTraceWarning: If it was cut short, and this is to be said.

    Raises:
        TraceError: If the trace cannot be read or is damaged.
    """
    if is_complete(path):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="netsim-") as folder:
        copy = Path(folder) / path.name
        with copy.open("wb") as stream, blame(path):
            last_ns = _Mender(stream).mend(path)
        if warns:
            warn_cut(path, last_ns)
        yield copy


@dataclass
class _Mender:
    """Copies the data section, and keeps what its index is made of."""

    stream: BinaryIO
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    last: Chunk | None = None
    """The latest chunk, while its index is not known to be whole."""
    waiting: list[bytes] = field(default_factory=list)
    """The messages' index of that chunk, channel by channel."""

    def mend(self, path: Path) -> int:
        """Copy a trace and close it; returns when its last chunk ends."""
        self.stream.write(MAGIC)
        for opcode, body in file_records(path):
            if opcode == Opcode.DATA_END:
                break
            if opcode == Opcode.MESSAGE_INDEX:
                self.waiting.append(body)
                continue
            self._index(self.waiting)
            if opcode == Opcode.CHUNK:
                self._begin_chunk(body)
            self._copy(opcode, body)
        if self.last is not None:  # its index may lack channels
            self._index(list(_message_index(uncompressed(self.last))))
        self._finish()
        return max((chunk.message_end_time for chunk in self.chunks), default=0)

    def _copy(self, opcode: int, body: bytes) -> None:
        self.stream.write(RECORD.pack(opcode, len(body)))
        self.stream.write(body)

    def _begin_chunk(self, body: bytes) -> None:
        self.last = chunk = Chunk.read(from_bytes(body))
        if not self.chunks:  # all topics are announced there
            self._learn(uncompressed(chunk))
        self.chunks.append(
            ChunkIndex(
                chunk_length=RECORD.size + len(body),
                chunk_start_offset=self.stream.tell(),
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=chunk.message_start_time,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _learn(self, data: bytes) -> None:
        for opcode, body in chunk_records(data):
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(from_bytes(body))
                self.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(from_bytes(body))
                self.channels[channel.id] = channel

    def _index(self, bodies: list[bytes]) -> None:
        """Write the messages' index of the latest chunk."""
        if self.last is None:
            return
        index, begin = self.chunks[-1], self.stream.tell()
        for body in bodies:
            (channel,) = _CHANNEL.unpack_from(body)
            index.message_index_offsets[channel] = self.stream.tell()
            self.counts[channel] = self.counts.get(channel, 0) + (len(body) - _INDEX_HEAD_BYTE) // _INDEX_ENTRY_BYTE
            self._copy(Opcode.MESSAGE_INDEX, body)
        index.message_index_length = self.stream.tell() - begin
        self.last, self.waiting = None, []

    def _finish(self) -> None:
        """The end of the data, what there is in it, and the end of the file."""
        builder = RecordBuilder()
        DataEnd(_NO_CHECKSUM).write(builder)
        self.stream.write(_taken(builder))
        begin = self.stream.tell()
        for record in (*self.schemas.values(), *self.channels.values(), self._statistics(), *self.chunks):
            record.write(builder)
        summary = _taken(builder)
        head = RECORD.pack(Opcode.FOOTER, FOOTER.size) + FOOTER.pack(begin, 0, 0)[:-4]
        Footer(summary_start=begin, summary_offset_start=0, summary_crc=zlib.crc32(summary + head)).write(builder)
        self.stream.write(summary + _taken(builder) + MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self.channels),
            channel_message_counts=self.counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.counts.values()),
            message_end_time=max((chunk.message_end_time for chunk in self.chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self.chunks), default=0),
            metadata_count=0,
            schema_count=len(self.schemas),
        )


def _message_index(data: bytes) -> Iterator[bytes]:
    """The index of the messages in an unpacked chunk, a record's content a channel."""
    entries: dict[int, list[tuple[int, int]]] = {}
    at = 0
    for opcode, body in chunk_records(data):
        if opcode == Opcode.MESSAGE:
            channel, _, time_ns, _ = MESSAGE.unpack_from(body)
            entries.setdefault(channel, []).append((time_ns, at))
        at += RECORD.size + len(body)
    for channel, found in entries.items():
        builder = RecordBuilder()
        MessageIndex(channel, found).write(builder)
        yield _taken(builder)[RECORD.size :]


def _taken(builder: RecordBuilder) -> bytes:
    """The records in a builder, which is empty then."""
    return bytes(builder.end())  # type: ignore[no-untyped-call]
