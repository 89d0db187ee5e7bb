"""Traces that were cut short, for readers that want every chunk to be followed by something."""

import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from mcap.opcode import Opcode

from netsim.trace.reader import MAGIC, RECORD, file_records

_NO_MESSAGES = struct.pack("<HI", 1, 0)
"""The content of a message index of the first channel that lists none."""


@contextmanager
def followed_chunks(path: Path) -> Iterator[Path]:
    """The trace itself; a copy of it for the time being, where it was cut just after a chunk, or in the index after it.

    Rerun takes the last chunk of a file for incomplete if no whole record follows, and leaves it out: the copy has an empty
    index there.

    Raises:
        TraceError: If the file cannot be read.
    """
    last, size_byte = 0, len(MAGIC)
    for opcode, body in file_records(path):
        last, size_byte = opcode, size_byte + RECORD.size + len(body)
    if last != Opcode.CHUNK:
        yield path
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        shutil.copyfile(path, copy)
        with copy.open("r+b") as stream:
            stream.truncate(size_byte)
            stream.seek(size_byte)
            stream.write(RECORD.pack(Opcode.MESSAGE_INDEX, len(_NO_MESSAGES)) + _NO_MESSAGES)
        yield copy
