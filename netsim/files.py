"""Files that are there whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from netsim.errors import NetsimError, ScenarioError


def check_place(path: Path, *, force: bool, option: str = "") -> None:
    """Make sure that a file can be written, without writing anything.

    Args:
        path: The file.
        force: Whether a file that exists may be replaced.
        option: What asks for it, for messages, such as `--gif`.

    Raises:
        ScenarioError: If the folder does not exist, or there is something of that name that may not be replaced.
    """
    asked = f"{option} {path}".lstrip()
    if not path.parent.is_dir():
        msg = f"{asked}: expected a folder that exists, got {path.parent}; make it, or name another"
        raise ScenarioError(msg)
    if path.is_dir():
        msg = f"{asked}: expected the name of a file, got that of a folder"
        raise ScenarioError(msg)
    if path.exists() and not force:
        msg = f"{asked}: expected a new file, got one that exists; name another, or replace it (--force)"
        raise ScenarioError(msg)


@contextmanager
def whole_file(path: Path, what: str) -> Iterator[Path]:
    """A place to write to that gets its name when all is well, and goes otherwise.

    Args:
        path: The file; where it is a link, what it points to is written.
        what: What it is, for messages, such as `the movie`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    real = path.resolve()
    part = real.with_name(f".{real.name}.part")
    try:
        yield part
        os.replace(part, real)
    except OSError as error:
        msg = f"{path}: cannot write {what}: {error.strerror or error}"
        raise NetsimError(msg) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
