"""Files: `extends` chains, overlays, overrides from the command line."""

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path as FilePath
from typing import TypeVar

from netsim.errors import Finding, ScenarioError
from netsim.reading.checks import Resolvers, validate
from netsim.reading.document import Document, Node
from netsim.reading.overlays import apply_override, overlay
from netsim.reading.parse import parse
from netsim.reading.scalars import show

EXTENDS = "extends"
MAX_BYTE = 1_000_000

T = TypeVar("T")


def read_document(path: str | PathLike[str], overrides: Sequence[str] = ()) -> Document:
    """Read a YAML file with what it extends.

    `extends: other.yaml` at the top, relative to the file that says so, lays the file over the other one: mappings are
    merged, lists and scalars replaced, and so is a mapping whose `type` differs from the other's.

    Args:
        path: The file.
        overrides: Assignments such as `medium.exponent=3.5`, applied in turn; see `apply_override`.

    Raises:
        ScenarioError: If a file cannot be read or parsed, if files extend each other in a circle, or for an override
            that cannot be applied.
    """
    document = _read_chain(FilePath(path), ())
    for override in overrides:
        document = apply_override(document, override)
    return document


def read_record(path: str | PathLike[str], record_type: type[T], resolvers: Resolvers | None = None) -> T:
    """Read a file and make its record in one go; see `read_document` and `validate`."""
    return validate(read_document(path), record_type, resolvers)


def _read_chain(path: FilePath, above: tuple[FilePath, ...]) -> Document:
    document = parse(_read_text(path), str(path))
    if not isinstance(document.root.value, dict) or EXTENDS not in document.root.value:
        return document
    link = document.root.value[EXTENDS]
    root = replace(document.root, value={key: node for key, node in document.root.value.items() if key != EXTENDS})
    base_path = _base_path(link, path, (*above, path))
    base = _read_chain(base_path, (*above, path))
    return Document(overlay(base.root, root), base.problems + document.problems)


def _base_path(link: Node, path: FilePath, chain: tuple[FilePath, ...]) -> FilePath:
    if not isinstance(link.value, str) or not link.value:
        got = "nothing" if link.value is None else show(Document(link).plain())
        raise _at_link(link, "the name of a YAML file", got, "write one path, relative to this file")
    base = path.parent / link.value
    if not _is_file(base):
        remedy = "the path is relative to the file that extends"
        raise _at_link(link, "an existing file", f"`{link.value}` (looked for {base})", remedy)
    seen = [file.resolve() for file in chain]
    if base.resolve() in seen:
        circle = " -> ".join([*(file.name for file in chain[seen.index(base.resolve()) :]), base.name])
        raise _at_link(link, "a file that does not extend this one", circle, "break the circle")
    return base


def _is_file(path: FilePath) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a null character
        return False


def _at_link(link: Node, expected: str, got: str, remedy: str) -> ScenarioError:
    return ScenarioError([Finding(link.file, link.line, EXTENDS, expected, got, remedy)])


def _read_text(path: FilePath) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _unreadable(path, 1, "a file that can be read", reason, "check the path") from error
    if len(content) > MAX_BYTE:
        raise _unreadable(path, 1, f"at most {MAX_BYTE} bytes", "a larger file", "make the file smaller")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        got = f"the byte {content[error.start]:#04x}"
        raise _unreadable(path, line, "UTF-8 text", got, "save the file as UTF-8") from error


def _unreadable(path: FilePath, line: int, expected: str, got: str, remedy: str) -> ScenarioError:
    return ScenarioError([Finding(str(path), line, "", expected, got, remedy)])
