"""The journal of a study: every finished trial on a line of its own, on disk as soon as it is finished.

One process writes it. A line torn by a crash or a full disk is cut off when the study is resumed: its trial is run again.
"""

import errno
import json
import os
from collections.abc import Iterator
from dataclasses import asdict
from io import FileIO
from pathlib import Path
from types import TracebackType

from netsim.errors import NetsimError, TraceError
from netsim.study.info import JOURNAL_FILE
from netsim.study.trial import Outcome


class StudyInUse(NetsimError):
    """Another process works in the study's folder."""


class Journal:
    """Appends outcomes to a file; a context manager. Only one process at a time may hold it.

    Args:
        path: The file; made if it is not there. What follows its last whole line is cut off.
        afresh: Whether what it holds is thrown away.

    Raises:
        StudyInUse: If another process holds it.
        TraceError: If it cannot be opened.
    """

    def __init__(self, path: Path, *, afresh: bool = False) -> None:
        self._path = path
        try:
            self._stream = path.open("ab", buffering=0)  # a buffer would try again to write what a full disk refused
            _lock(self._stream, path)
            self._stream.truncate(0 if afresh else _whole_byte(path))
        except OSError as error:
            raise _failed(path, error) from error

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stream.close()

    def add(self, outcome: Outcome) -> None:
        """Write an outcome; when this returns it is on the disk, and outlives a crash of the machine.

        Raises:
            TraceError: If it cannot be written.
        """
        left = memoryview(json.dumps(asdict(outcome), allow_nan=False).encode() + b"\n")
        try:
            while left:
                left = left[self._stream.write(left) :]
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


def outcomes_of(folder: Path) -> dict[str, Outcome]:
    """What the journal of a study holds, by `Task.key`; of several outcomes the one with figures, else the last.

    Raises:
        TraceError: If it cannot be read.
    """
    outcomes: dict[str, Outcome] = {}
    for outcome in read_journal(folder / JOURNAL_FILE):
        if outcome.status == "ok" or outcome.key not in outcomes or outcomes[outcome.key].status == "failed":
            outcomes[outcome.key] = outcome
    return outcomes


def _lock(stream: FileIO, path: Path) -> None:
    """Hold the file until it is closed or its process ends, however that ends: there are no stale locks."""
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        return
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        stream.close()
        message = (
            f"{path.parent}: another `netsim study` is at work in this folder; wait for it, or choose another --out"
        )
        raise StudyInUse(message) from error
    except OSError as error:  # a file system without locks is no reason not to work
        if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS):
            raise


def _whole_byte(path: Path) -> int:
    content = path.read_bytes() if path.exists() else b""
    return content.rfind(b"\n") + 1


def _failed(path: Path, error: OSError) -> TraceError:
    return TraceError(f"{path}: cannot write or read the study's journal: {error.strerror or error}")
