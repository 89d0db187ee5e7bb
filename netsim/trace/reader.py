"""Reading a trace back into events, in the order in which they happened.

The file is read from front to back: its writer guarantees that log times never decrease and that every topic is
announced in the first chunk, so nothing needs sorting, and chunks outside the time asked for are not even unpacked. A
trace cut short by a crash is read up to its last whole record.
"""

import os
import struct
import warnings
import zlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema

from netsim import __version__
from netsim.errors import TraceError
from netsim.trace.cdr import SCHEMA_ENCODING, decode, fields_of
from netsim.trace.events import EVENT_TYPES, Event
from netsim.trace.records import (
    BROKEN,
    FOOTER,
    MAGIC,
    MESSAGE,
    RECORD,
    blame,
    chunk_records,
    damaged,
    file_records,
    from_bytes,
    uncompressed,
    unreadable,
)
from netsim.trace.writer import FORMAT_VERSION, RUN_RECORD
from netsim.units import NS_PER_S

_CHUNK_TIMES = struct.Struct("<QQ")
_TAIL_SIZE_BYTE = RECORD.size + FOOTER.size + len(MAGIC)
_CHECKSUM_AND_MAGIC_BYTE = 4 + len(MAGIC)
TYPE_OF_TOPIC: dict[str, type[Event]] = {event_type.topic: event_type for event_type in EVENT_TYPES}


class TruncatedTraceWarning(UserWarning):
    """A trace ends before its end record: what follows the last whole record is lost."""


@dataclass(frozen=True, slots=True)
class RawMessage:
    """A message of a trace before it is decoded.

    Attributes:
        time_ns: When it was recorded.
        topic: Its topic.
        event_type: The class of the event; None for a topic that only later versions of netsim know.
        data: Its CDR bytes.
        sequence: Its number among those of its topic, from 0.
        fields: How many of its class's fields it has; None for all.
    """

    time_ns: int
    topic: str
    event_type: type[Event] | None
    data: bytes
    sequence: int = 0
    fields: int | None = None


def read_trace(
    path: Path | str,
    topics: Collection[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> Iterator[tuple[int, Event]]:
    """The events of a trace with their times, in order; without those of topics unknown to this version.

    Args:
        path: The trace.
        topics: Only these topics, such as `{"/frames"}`; None for all.
        start_ns: Skip what happened before.
        end_ns: Stop before what happened at or after this time.

    Warns:
        TruncatedTraceWarning: At the end of a trace that was cut short.

    Raises:
        TraceError: If the file cannot be read, is damaged, is not a trace of netsim or has another format version (at
            once), or a record in it is broken (when it is reached).
    """
    messages = read_raw(path, topics, start_ns, end_ns)
    return _decoded(Path(path), messages)


def read_raw(
    path: Path | str,
    topics: Collection[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> Iterator[RawMessage]:
    """Like `read_trace`, but the events stay undecoded, and those of topics unknown to this version are there too."""
    trace_metadata(path)
    low = 0 if start_ns is None else start_ns
    high = 1 << 64 if end_ns is None else end_ns
    return _messages(Path(path), topics, low, high)


def decoded(path: Path | str, message: RawMessage) -> Event:
    """The event in a message of the trace `path`.

    Raises:
        TraceError: If its bytes are broken, or its topic is unknown to this version.
    """
    if message.event_type is None:
        msg = f"{path}: topic {message.topic} is not in this version's vocabulary"
        raise TraceError(msg)
    try:
        return decode(message.event_type, message.data, message.fields)
    except (TraceError, *BROKEN) as error:
        raise damaged(path, error) from error


def trace_metadata(path: Path | str) -> dict[str, str]:
    """What was run: the metadata its writer was given, `format_version` and `netsim_version`.

    Raises:
        TraceError: If the file cannot be read, is not a trace of netsim or has another format version.
    """
    for opcode, body in file_records(Path(path)):
        if opcode == Opcode.METADATA:
            with blame(Path(path)):
                record = Metadata.read(from_bytes(body))
            if record.name == RUN_RECORD:
                _check_version(path, record.metadata)
                return dict(record.metadata)
    msg = f"{path}: not a trace of netsim: it has no {RUN_RECORD} record"
    raise TraceError(msg)


def trace_attachment(path: Path | str, name: str) -> bytes:
    """The content of the file `name` that a trace carries.

    Raises:
        TraceError: If the trace has no such attachment or cannot be read.
    """
    attachments = trace_attachments(path)
    if name not in attachments:
        known = ", ".join(sorted(attachments)) or "none"
        msg = f"{path}: expected an attachment {name}, got {known}"
        raise TraceError(msg)
    return attachments[name]


def trace_attachments(path: Path | str) -> dict[str, bytes]:
    """All files that a trace carries, by name.

    Raises:
        TraceError: If the trace cannot be read.
    """
    trace_metadata(path)
    bodies = [body for opcode, body in file_records(Path(path)) if opcode == Opcode.ATTACHMENT]
    with blame(Path(path)):
        return {record.name: record.data for record in map(Attachment.read, map(from_bytes, bodies))}


def last_time_ns(path: Path | str) -> int:
    """When the last event of a trace was recorded; 0 for a trace without events.

    Raises:
        TraceError: If the trace cannot be read.
    """
    trace_metadata(path)
    ends = (_CHUNK_TIMES.unpack_from(body)[1] for opcode, body in file_records(Path(path)) if opcode == Opcode.CHUNK)
    return max(ends, default=0)


def is_complete(path: Path | str) -> bool:
    """Whether a trace ends as a closed one does; if not, its writer was interrupted.

    Raises:
        TraceError: If the file cannot be read, or the index at its end is damaged.
    """
    try:
        with Path(path).open("rb") as stream:
            size_byte = stream.seek(0, os.SEEK_END)
            stream.seek(max(0, size_byte - _TAIL_SIZE_BYTE))
            tail = stream.read()
            if not tail.endswith(MAGIC) or tail[0] != Opcode.FOOTER:
                return False
            start, _, checksum = FOOTER.unpack_from(tail, RECORD.size)
            stream.seek(min(start, size_byte))
            # The checksum covers the index and the footer up to the checksum itself.
            if zlib.crc32(stream.read()[:-_CHECKSUM_AND_MAGIC_BYTE]) != checksum:
                msg = f"{path}: damaged: the index has a wrong checksum"
                raise TraceError(msg)
    except OSError as error:
        raise unreadable(path, error) from error
    return True


def has_events(path: Path | str) -> bool:
    """Whether there is a whole part of events in a trace: one that was cut short early has none.

    Raises:
        TraceError: If the file cannot be read.
    """
    return any(opcode == Opcode.CHUNK for opcode, _ in file_records(Path(path)))


def _decoded(path: Path, messages: Iterator[RawMessage]) -> Iterator[tuple[int, Event]]:
    for message in messages:
        if message.event_type is not None:
            yield message.time_ns, decoded(path, message)


@dataclass(slots=True)
class _Contents:
    """What the file has announced so far, and which of its channels are asked for."""

    topics: Collection[str] | None
    schemas: dict[int, Schema] = field(default_factory=dict)
    kinds: dict[int, tuple[str, type[Event] | None, int | None]] = field(default_factory=dict)

    def announce(self, channel: Channel) -> None:
        if self.topics is None or channel.topic in self.topics:
            self.kinds[channel.id] = (channel.topic, *_event_type(channel, self.schemas[channel.schema_id]))


def _messages(path: Path, topics: Collection[str] | None, low: int, high: int) -> Iterator[RawMessage]:
    contents = _Contents(topics)
    opcode = last_ns = 0
    for opcode, body in file_records(path):
        if opcode != Opcode.CHUNK:
            continue
        with blame(path):
            chunk = Chunk.read(from_bytes(body))
            last_ns = chunk.message_end_time
            if chunk.message_start_time >= high and contents.schemas:
                return
            if chunk.message_end_time >= low or not contents.schemas:
                yield from _chunk_messages(uncompressed(chunk), contents, low, high)
    if opcode != Opcode.DATA_END:
        warn_cut(path, last_ns)


def warn_cut(path: Path, last_ns: int) -> None:
    """Warn that there is nothing in a trace after an instant, because it was cut short."""
    message = (
        f"{path}: the trace is cut short: what came after {last_ns / NS_PER_S:.6g} s is lost; copy the file again, or "
        "run the scenario again"
    )
    warnings.warn(message, TruncatedTraceWarning, stacklevel=3)


def _chunk_messages(data: bytes, contents: _Contents, low: int, high: int) -> Iterator[RawMessage]:
    """The messages among the records of a chunk; schemas and channels go into `contents`."""
    for opcode, body in chunk_records(data):
        if opcode == Opcode.MESSAGE:
            channel, sequence, time_ns, _ = MESSAGE.unpack_from(body)
            kind = contents.kinds.get(channel)
            if kind is not None and low <= time_ns < high:
                topic, event_type, count = kind
                yield RawMessage(time_ns, topic, event_type, body[MESSAGE.size :], sequence, count)
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(from_bytes(body))
            contents.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            contents.announce(Channel.read(from_bytes(body)))


def _event_type(channel: Channel, schema: Schema) -> tuple[type[Event] | None, int | None]:
    """The event class of a channel, and how many of its fields are there if not all; no class for an unknown topic."""
    event_type = TYPE_OF_TOPIC.get(channel.topic)
    if event_type is None:
        return None, None
    count = fields_of(event_type, schema.data.decode()) if schema.encoding == SCHEMA_ENCODING else None
    if count is None:
        msg = f"topic {channel.topic} is laid out otherwise than in this version"
        raise TraceError(msg)
    return event_type, None if count == len(fields(event_type)) else count


def _check_version(path: Path | str, run: Mapping[str, str]) -> None:
    """Refuse a format that is not ours: which it is, which we read, what to do."""
    version, writer = run.get("format_version", "none"), run.get("netsim_version", "")
    if version == FORMAT_VERSION:
        return
    is_newer = version.isdecimal() and int(version) > int(FORMAT_VERSION)
    remedy = "upgrade netsim" if is_newer else "read it with the netsim that wrote it, or run the scenario again"
    wrote = f" (netsim {writer} wrote it)" if writer else ""
    msg = (
        f"{path}: expected trace format version {FORMAT_VERSION} (this is netsim {__version__}), got {version}{wrote}; "
        f"{remedy}"
    )
    raise TraceError(msg)
