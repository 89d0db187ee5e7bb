"""An MCAP file with Foxglove's messages (protobuf) and with figures (JSON), each topic announced when it is first used.

Equal messages give equal bytes: the file holds no wall clock.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import Message
from mcap.writer import CompressionType, Writer

from netsim import __version__

RUN_RECORD = "netsim.export"
"""Name of the metadata record that says what was run; not that of a trace, for this is none."""
_CHUNK_BYTE = 4 * 1024 * 1024


@dataclass(slots=True)
class _Channel:
    id: int
    sequence: int = 0


class SceneFile:
    """Writes one file.

    Args:
        path: Where to.
        run: What was run.

    Raises:
        OSError: If it cannot be written.
    """

    def __init__(self, path: Path, run: Mapping[str, str]) -> None:
        self._stream = path.open("wb")
        self._mcap = Writer(self._stream, chunk_size=_CHUNK_BYTE, compression=CompressionType.ZSTD)
        self._mcap.start(profile="", library=f"netsim {__version__}")
        self._mcap.add_metadata(RUN_RECORD, dict(sorted(run.items())))
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[str, int] = {}

    def send(self, topic: str, message: Message, time_ns: int) -> None:
        """Append a message of Foxglove's."""
        channel = self._channels.get(topic)
        if channel is None:
            descriptor = message.DESCRIPTOR
            description = _description(descriptor.file)
            channel = self._announce(topic, descriptor.full_name, "protobuf", description, "protobuf")
        self._add(channel, message.SerializeToString(deterministic=True), time_ns)

    def send_figures(self, topic: str, name: str, properties: Mapping[str, Any], value: Any, time_ns: int) -> None:
        """Append figures.

        Args:
            topic: Topic.
            name: Name of their schema.
            properties: The properties of the object, as in JSON Schema.
            value: The object.
            time_ns: When they hold.
        """
        channel = self._channels.get(topic)
        if channel is None:
            schema = json.dumps({"title": name, "type": "object", "properties": properties}).encode()
            channel = self._announce(topic, name, "jsonschema", schema, "json")
        self._add(channel, json.dumps(value).encode(), time_ns)

    def close(self) -> None:
        """Write index and end."""
        with self._stream:
            self._mcap.finish()  # type: ignore[no-untyped-call]

    def abort(self) -> None:
        """Close the file as it is."""
        self._stream.close()

    def _announce(self, topic: str, name: str, encoding: str, description: bytes, content: str) -> _Channel:
        if name not in self._schemas:
            self._schemas[name] = self._mcap.register_schema(name, encoding, description)
        channel = _Channel(self._mcap.register_channel(topic, content, self._schemas[name]))
        self._channels[topic] = channel
        return channel

    def _add(self, channel: _Channel, data: bytes, time_ns: int) -> None:
        self._mcap.add_message(channel.id, time_ns, data, time_ns, channel.sequence)
        channel.sequence += 1


def _description(file: FileDescriptor) -> bytes:
    """A file of message definitions with all that it builds on, what is built on first."""
    found: dict[str, FileDescriptor] = {}

    def visit(each: FileDescriptor) -> None:
        for dependency in each.dependencies:
            visit(dependency)
        found.setdefault(each.name, each)

    visit(file)
    described = FileDescriptorSet()
    for each in found.values():
        each.CopyToProto(described.file.add())
    return bytes(described.SerializeToString(deterministic=True))
