"""Writing a trace: events in the order in which they happen, into an MCAP file that describes itself.

Equal events give equal bytes: no wall clock, no random id, every topic announced at the start in the vocabulary's
order. While it is being written a trace is called `NAME.partial.mcap`; only a closed one gets its own name.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from mcap.writer import CompressionType, Writer

from netsim import __version__
from netsim.errors import InvariantError, TraceError
from netsim.trace.cdr import MESSAGE_ENCODING, SCHEMA_ENCODING, encode, schema_name, schema_text
from netsim.trace.events import EVENT_TYPES, Event

FORMAT_VERSION = "1"
RUN_RECORD = "netsim.run"
"""Name of the metadata record that says what was run."""

_CHUNK_SIZE_BYTE = 4 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Attachment:
    """A file carried inside a trace, such as the resolved scenario.

    Attributes:
        name: File name, such as `scenario.yaml`.
        media_type: Media (MIME) type, such as `application/yaml`.
        data: Its content.
    """

    name: str
    media_type: str
    data: bytes


def partial_path(path: Path) -> Path:
    """Where the trace `path` is kept while it is being written."""
    return path.with_name(f"{path.stem}.partial{path.suffix}")


class TraceWriter:
    """Writes one trace. Use as a context manager, or end with `close` (whole) or `abort` (the run failed).

    Args:
        path: Where the closed trace shall be; its folder must exist.
        metadata: What was run (seed, scenario name, ...); `format_version` and `netsim_version` are added.
        attachments: Files to carry from the start; more can follow by `attach`.

    Raises:
        TraceError: If the file cannot be written.
    """

    def __init__(self, path: Path | str, metadata: Mapping[str, str], attachments: Iterable[Attachment] = ()) -> None:
        self.path = Path(path)
        self._last_ns = 0
        self._open = True
        try:
            self._stream = partial_path(self.path).open("wb")
            self._mcap = Writer(self._stream, chunk_size=_CHUNK_SIZE_BYTE, compression=CompressionType.ZSTD)
            self._mcap.start(profile="netsim", library=f"netsim {__version__}")
            self._mcap.add_metadata(RUN_RECORD, _run_record(metadata))
            self._channels = {event_type: _Channel(self._announce(event_type)) for event_type in EVENT_TYPES}
            self._stream.flush()  # a run killed early leaves a trace that says what it is
        except OSError as error:
            raise _unwritable(self.path, error) from error
        for attachment in attachments:
            self.attach(attachment.name, attachment.media_type, attachment.data)

    def write(self, event: Event, time_ns: int) -> None:
        """Append an event that happened at `time_ns`.

        Raises:
            InvariantError: If time runs backwards.
            TraceError: If the event cannot be encoded or the file not be written.
        """
        if time_ns < self._last_ns:
            msg = f"an event at {time_ns} ns was recorded after one at {self._last_ns} ns: {event!r}"
            raise InvariantError(msg)
        data = encode(event)
        channel = self._channels[type(event)]
        try:
            self._mcap.add_message(channel.id, time_ns, data, time_ns, channel.sequence)
        except OSError as error:
            raise _unwritable(self.path, error) from error
        self._last_ns = time_ns
        channel.sequence += 1

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file into the trace; see `Attachment`.

        Raises:
            TraceError: If the file cannot be written.
        """
        try:
            self._mcap.add_attachment(0, 0, name, media_type, data)
        except OSError as error:
            raise _unwritable(self.path, error) from error

    def close(self) -> None:
        """Finish the trace and give it its name. Closing twice does nothing.

        Raises:
            TraceError: If the file cannot be written.
        """
        if self._open:
            self.abort()
            try:
                partial_path(self.path).replace(self.path)
            except OSError as error:
                raise _unwritable(self.path, error) from error

    def abort(self) -> None:
        """Finish the file, so that it can be read, but leave it under its partial name."""
        if not self._open:
            return
        self._open = False
        try:
            with self._stream:
                self._mcap.finish()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise _unwritable(self.path, error) from error

    def __enter__(self) -> "TraceWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close after success, abort after an exception."""
        if kind is None:
            self.close()
        else:
            self.abort()

    def _announce(self, event_type: type[Any]) -> int:
        """Describe an event class in the file; returns the number of its channel."""
        text = schema_text(event_type).encode()
        schema_id = self._mcap.register_schema(schema_name(event_type), SCHEMA_ENCODING, text)
        return self._mcap.register_channel(event_type.topic, MESSAGE_ENCODING, schema_id)


@dataclass(slots=True)
class _Channel:
    id: int
    sequence: int = 0


def _run_record(metadata: Mapping[str, str]) -> dict[str, str]:
    record = {**metadata, "format_version": FORMAT_VERSION, "netsim_version": __version__}
    return dict(sorted(record.items()))


def _unwritable(path: Path, error: OSError) -> TraceError:
    return TraceError(f"{path}: cannot write the trace: {error.strerror or error}")
