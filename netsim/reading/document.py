"""A parsed document: plain values, each with the file and line it came from."""

import re
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from netsim.errors import Finding
from netsim.reading.scalars import Scalar

Path = tuple[Any, ...]
"""Where a value stands: mapping keys and list indices from the root, such as `("nodes", 0, "count")`."""

OVERRIDE = "--set"
"""The `file` of a value that came from the command line."""


@dataclass(frozen=True, slots=True)
class Node:
    """A value with its origin.

    Attributes:
        value: A scalar, a dict of nodes or a list of nodes.
        file: The file it came from, or `OVERRIDE`.
        line: The line of its key (of the item itself in a list), counted from 1; 0 on the command line.
    """

    value: "Scalar | dict[Any, Node] | list[Node]"
    file: str
    line: int

    def child(self, key: object) -> "Node | None":
        """The node under a key or index, or None."""
        if isinstance(self.value, dict):
            return self.value.get(key) if isinstance(key, Hashable) else None
        if isinstance(self.value, list) and isinstance(key, int) and 0 <= key < len(self.value):
            return self.value[key]
        return None

    def moved_to(self, line: int) -> "Node":
        """The same value, said to stand on another line."""
        return replace(self, line=line)


@dataclass(frozen=True, slots=True)
class OverrideFinding(Finding):
    """A finding about a value given on the command line, where there is no line to point at."""

    def __str__(self) -> str:
        """The finding on one line: `--set path: expected ..., got ...; remedy`."""
        remedy = f"; {self.remedy}" if self.remedy else ""
        place = f"{self.file} {self.path}" if self.path else self.file
        what = f"expected {self.expected}, got {self.got}" if self.got else self.expected
        return f"{place}: {what}{remedy}"


@dataclass(frozen=True, slots=True)
class Document:
    """A file after `extends` and overrides.

    Attributes:
        root: The top of the tree.
        problems: What was found while reading that did not stop it, such as duplicate keys; `findings` and `validate`
            report them with their own.
    """

    root: Node
    problems: tuple[Finding, ...] = ()

    def plain(self) -> Any:
        """The values alone, as dicts, lists and scalars; a fresh copy."""
        return plain(self.root)

    def where(self, path: Path) -> tuple[str, int]:
        """The file and line of a value; of the closest mapping or list around it if it is not written anywhere."""
        node = self.root
        for key in path:
            child = node.child(key)
            if child is None:
                break
            node = child
        return node.file, node.line

    def finding(self, path: Path, expected: str, got: str, remedy: str = "") -> Finding:
        """A finding about the value at `path`, for checks that no single field can make."""
        return finding_at(*self.where(path), path, expected, got, remedy)


def plain(node: Node) -> Any:
    """The values below a node, as dicts, lists and scalars."""
    if isinstance(node.value, dict):
        return {key: plain(child) for key, child in node.value.items()}
    if isinstance(node.value, list):
        return [plain(child) for child in node.value]
    return node.value


def finding_at(file: str, line: int, path: Path, expected: str, got: str, remedy: str = "") -> Finding:
    """A finding at a place, worded for a file or for the command line."""
    kind = OverrideFinding if file == OVERRIDE else Finding
    return kind(file, line, path_text(path), expected, got, remedy)


def matches(pattern: Path, path: Path) -> bool:
    """Whether a path fits a pattern in which `"*"` stands for any key or index."""
    return len(pattern) == len(path) and all(want in ("*", key) for want, key in zip(pattern, path, strict=True))


def path_text(path: Path) -> str:
    """A path as text: `nodes[0].radio.channel`; keys that are no plain words are quoted in brackets."""
    return "".join(_path_parts(path)).removeprefix(".")


def _path_parts(path: Path) -> Iterator[str]:
    for key in path:
        word = isinstance(key, str) and re.fullmatch(r"[^\W\d][\w-]{0,60}", key)
        yield f".{key}" if word else f"[{key!r:.60}]"
