"""What a trace says of itself: the topics it announces, and how many events its index counts."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Schema

from netsim.errors import TraceError
from netsim.trace.cdr import MESSAGE_ENCODING, SCHEMA_ENCODING, fields_of, schema_name
from netsim.trace.reader import TYPE_OF_TOPIC
from netsim.trace.records import blame, chunk_records, file_records, from_bytes, uncompressed


@dataclass(frozen=True, slots=True)
class Announced:
    """A topic as a trace announces it.

    Attributes:
        topic: Such as `/frames`.
        is_known: Whether this version of netsim knows it; if not, its events are skipped.
        wrong: What is wrong with how it is described; empty for nothing.
    """

    topic: str
    is_known: bool
    wrong: str


def announced(path: Path | str) -> list[Announced]:
    """The topics that a trace announces: all stand in its first chunk. Nothing for a trace cut short before that.

    Raises:
        TraceError: If the file cannot be read or its first chunk is damaged.
    """
    file = Path(path)
    body = next((body for opcode, body in file_records(file) if opcode == Opcode.CHUNK), None)
    if body is None:
        return []
    with blame(file):
        return list(_topics(uncompressed(Chunk.read(from_bytes(body)))))


def indexed_counts(path: Path | str) -> dict[str, int]:
    """How many events of each topic the index at the end of a complete trace counts, topics without any left out.

    Raises:
        TraceError: If the file cannot be read, or has no such index.
    """
    file = Path(path)
    with blame(file), file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        if summary is None or summary.statistics is None:
            msg = "it has no statistics at its end"
            raise TraceError(msg)
        counts = summary.statistics.channel_message_counts
        return {summary.channels[channel].topic: count for channel, count in counts.items() if count}


def _topics(data: bytes) -> Iterator[Announced]:
    schemas: dict[int, Schema] = {}
    for opcode, body in chunk_records(data):
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(from_bytes(body))
            schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(from_bytes(body))
            is_known = channel.topic in TYPE_OF_TOPIC
            wrong = _wrong(channel, schemas.get(channel.schema_id)) if is_known else ""
            yield Announced(channel.topic, is_known, wrong)


def _wrong(channel: Channel, schema: Schema | None) -> str:
    event_type = TYPE_OF_TOPIC[channel.topic]
    if schema is None:
        return "its schema is missing"
    described = (schema.encoding, channel.message_encoding, schema.name)
    expected = (SCHEMA_ENCODING, MESSAGE_ENCODING, schema_name(event_type))
    if described != expected:
        return f"expected {' '.join(expected)}, got {' '.join(described)}"
    if fields_of(event_type, schema.data.decode()) is None:
        return "its fields are others than this version's, not only fewer or more at the end"
    return ""
