"""The journal of a study: every finished trial on a line of its own, on disk as soon as it is finished.

One process writes it. A line torn by a crash or a full disk is cut off when the study is resumed: its trial is run again.
"""

import json
import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from netsim.errors import TraceError
from netsim.study.trial import Outcome


class Journal:
    """Appends outcomes to a file; a context manager.

    Args:
        path: The file; made if it is not there. What follows its last whole line is cut off.

    Raises:
        TraceError: If it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            whole_byte = _whole_byte(path)
            self._stream: BinaryIO = path.open("ab")
            self._stream.truncate(whole_byte)
        except OSError as error:
            raise _failed(path, error) from error

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stream.close()

    def add(self, outcome: Outcome) -> None:
        """Write an outcome; when this returns it is on the disk.

        Raises:
            TraceError: If it cannot be written.
        """
        try:
            self._stream.write(json.dumps(asdict(outcome), allow_nan=False).encode() + b"\n")
            self._stream.flush()
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise _failed(self._path, error) from error


def read_journal(path: Path) -> Iterator[Outcome]:
    """The outcomes of a journal, in the order in which they came; nothing if there is no journal.

    A torn last line is left out.

    Raises:
        TraceError: If it cannot be read, or a line before the last is damaged.
    """
    if not path.exists():
        return
    try:
        lines = path.read_bytes().splitlines(keepends=True)
    except OSError as error:
        raise _failed(path, error) from error
    for number, line in enumerate(lines, 1):
        if not line.endswith(b"\n"):
            return
        try:
            yield Outcome(**json.loads(line))
        except (ValueError, TypeError) as error:
            message = f"{path}:{number}: damaged: {error}; delete the line to have its trial run again"
            raise TraceError(message) from error


def _whole_byte(path: Path) -> int:
    content = path.read_bytes() if path.exists() else b""
    return content.rfind(b"\n") + 1


def _failed(path: Path, error: OSError) -> TraceError:
    return TraceError(f"{path}: cannot write or read the study's journal: {error.strerror or error}")
