"""Files that are there whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from netsim.errors import NetsimError


@contextmanager
def whole_file(path: Path, what: str) -> Iterator[Path]:
    """A place to write to that gets its name when all is well, and goes otherwise.

    Args:
        path: The file's own name; where it is a link, what it points to is written.
        what: What is written, for messages.

    Raises:
        NetsimError: If the file cannot be written.
    """
    real = path.resolve()
    part = real.with_name(f".{real.name}.part")
    try:
        yield part
        os.replace(part, real)
    except OSError as error:
        msg = f"{path}: cannot write the {what}: {error.strerror or error}"
        raise NetsimError(msg) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
