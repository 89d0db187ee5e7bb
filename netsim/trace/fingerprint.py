"""One short text for all that a trace says, to compare runs.

It covers when what was recorded, in which order, and the files inside; not how the file is compressed or chunked, nor the
comments of its schemas. Equal scenarios and seeds must give equal fingerprints, on every machine and version.
"""

import struct
import warnings
from collections.abc import Iterator
from hashlib import blake2b
from pathlib import Path

from netsim.errors import TraceError
from netsim.trace.reader import RawMessage, TruncatedTraceWarning, is_complete, read_raw, trace_attachments

_DIGEST_SIZE_BYTE = 16
_HEAD = struct.Struct("<QI")


def fingerprint(path: Path | str) -> str:
    """The fingerprint of a trace: 32 hexadecimal digits of BLAKE2b over times, topics, events and attachments.

    Raises:
        TraceError: If the trace is damaged or cut short, so that its end is not known.
    """
    if not is_complete(path):
        msg = f"{path}: the trace is cut short, so it has no fingerprint"
        raise TraceError(msg)
    digest = blake2b(digest_size=_DIGEST_SIZE_BYTE)
    for message in _all_messages(path):
        digest.update(_HEAD.pack(message.time_ns, len(message.data)))
        digest.update(message.topic.encode() + b"\0")
        digest.update(message.data)
    for name, data in sorted(trace_attachments(path).items()):
        digest.update(_HEAD.pack(0, len(data)) + name.encode() + b"\0" + data)
    return digest.hexdigest()


def _all_messages(path: Path | str) -> Iterator[RawMessage]:
    """The messages of a trace that has its end, so that records which break off before it are damage."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", TruncatedTraceWarning)
            yield from read_raw(path)
    except TruncatedTraceWarning as error:
        msg = f"{path}: damaged: a record has a wrong length, so that what follows it is lost"
        raise TraceError(msg) from error
