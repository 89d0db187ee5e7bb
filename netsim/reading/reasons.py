"""Why a text file cannot be read, in words for people."""

from pathlib import Path

_GZIP_MAGIC = b"\x1f\x8b"


def why_unreadable(path: Path, error: Exception) -> str:
    """The reason in a few words: that of the system, or what the file is instead of text.

    Args:
        path: The file.
        error: What reading it as text raised.
    """
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    if isinstance(error, UnicodeDecodeError):
        return "a gzip file" if is_gzip(path) else "a file that is not text in UTF-8"
    return str(error)


def is_gzip(path: Path) -> bool:
    """Whether a file begins as gzip files do."""
    try:
        with path.open("rb") as stream:
            return stream.read(2) == _GZIP_MAGIC
    except (OSError, ValueError):
        return False
