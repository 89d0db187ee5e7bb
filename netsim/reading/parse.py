"""YAML text to nodes, within limits: size, depth and the number of values after aliases are written out.

The tree is built from the parser's events with a stack of our own, so that neither deep nesting nor aliases of aliases
can exhaust the machine. Tags that construct objects do not exist here: a tag is a problem to report.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.reader import ReaderError

from netsim.errors import Finding, ScenarioError
from netsim.reading.document import Document, Node, path_text
from netsim.reading.scalars import Scalar, scalar_value, show
from netsim.reading.syntax import syntax_finding

MAX_DEPTH = 40
MAX_VALUES = 200_000


class _Merge(str):
    """An unquoted `<<`: the merge key of YAML 1.1."""

    __slots__ = ()


@dataclass(slots=True)
class _Open:
    """A mapping or list whose end has not been seen yet."""

    node: Node
    anchor: str | None
    key: Node | None = None
    size: int = 1
    height: int = 1


@dataclass(slots=True)
class _Builder:
    """Builds the tree of one file from its events."""

    file: str
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Node, int, int]] = field(default_factory=dict)
    problems: list[Finding] = field(default_factory=list)
    root: Node | None = None
    documents: int = 0

    def take(self, event: Any) -> None:
        line = event.start_mark.line + 1
        if isinstance(event, DocumentStartEvent):
            self._start_document(line)
        elif isinstance(event, ScalarEvent):
            self._refuse_tag(event, line)
            plain = event.implicit[0] and not event.style
            self._add(Node(_plain_value(event.value) if plain else event.value, self.file, line), event.anchor)
        elif isinstance(event, MappingStartEvent | SequenceStartEvent):
            self._refuse_tag(event, line)
            self._open(Node({} if isinstance(event, MappingStartEvent) else [], self.file, line), event.anchor)
        elif isinstance(event, MappingEndEvent | SequenceEndEvent):
            done = self.stack.pop()
            self._add(done.node, done.anchor, done.size, done.height)
        elif isinstance(event, AliasEvent):
            self._alias(event.anchor, line)

    def _start_document(self, line: int) -> None:
        self.documents += 1
        if self.documents > 1:
            self._stop(line, "one document", "a second one after `---`", "put it into a file of its own")

    def _open(self, node: Node, anchor: str | None) -> None:
        if len(self.stack) >= MAX_DEPTH:
            self._too_deep(node.line)
        self.stack.append(_Open(node, anchor))

    def _alias(self, anchor: str, line: int) -> None:
        if anchor not in self.anchors:
            wanted = "the name of an anchor (`&name`) whose value ends above"
            self._stop(line, wanted, f"`*{show(anchor)}`", "write the value itself")
        node, size, height = self.anchors[anchor]
        self._add(node.moved_to(line), None, size, height)

    def _add(self, node: Node, anchor: str | None, size: int = 1, height: int = 1) -> None:
        if anchor:
            self.anchors[anchor] = (node, size, height)
        if not self.stack:
            self.root = node
            return
        top = self.stack[-1]
        top.size += size
        top.height = max(top.height, height + 1)
        if len(self.stack) + height > MAX_DEPTH + 1:
            self._too_deep(node.line)
        if top.size > MAX_VALUES:
            self._stop(node.line, f"at most {MAX_VALUES} values", "more (aliases written out)", "make the file smaller")
        if isinstance(top.node.value, list):
            top.node.value.append(node)
        elif top.key is None:
            top.key = node
        elif isinstance(top.node.value, dict):
            key, top.key = top.key, None
            self._add_to_mapping(top.node.value, key, node)

    def _add_to_mapping(self, mapping: dict[Any, Node], key: Node, node: Node) -> None:
        if isinstance(key.value, dict | list):
            self._problem(key.line, "a word as key", "a list or mapping as key", "write one word before the colon")
        elif isinstance(key.value, _Merge):
            remedy = "write the keys out, or move them to a file of their own and name it under `extends`"
            self._problem(key.line, "a key", "the merge key `<<`, which YAML 1.2 does not have", remedy)
        elif key.value in mapping:
            got = f"`{show(key.value)}` again (first on line {mapping[key.value].line})"
            self._problem(key.line, "each key once", got, "remove one of the two")
        else:
            mapping[key.value] = node.moved_to(key.line)

    def _refuse_tag(self, event: Any, line: int) -> None:
        if event.tag is not None:
            remedy = "remove the tag; put text that looks like a number in quotes"
            tag = show(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
            self._problem(line, "a value without a tag", f"the tag {tag}", remedy)

    def _problem(self, line: int, expected: str, got: str, remedy: str) -> None:
        self.problems.append(Finding(self.file, line, path_text(self._path()), expected, got, remedy))

    def _path(self) -> tuple[Any, ...]:
        return tuple(key for entry in self.stack for key in _position(entry))

    def _too_deep(self, line: int) -> None:
        wanted = f"at most {MAX_DEPTH} levels of nesting"
        raise ScenarioError([*self.problems, Finding(self.file, line, "", wanted, "more", "nest less")])

    def _stop(self, line: int, expected: str, got: str, remedy: str) -> None:
        self._problem(line, expected, got, remedy)
        raise ScenarioError(self.problems)


def _plain_value(text: str) -> Scalar:
    return _Merge(text) if text == "<<" else scalar_value(text)


def _position(entry: _Open) -> tuple[Any, ...]:
    if isinstance(entry.node.value, list):
        return (len(entry.node.value),)
    return () if entry.key is None or isinstance(entry.key.value, dict | list) else (entry.key.value,)


def parse(text: str, file: str) -> Document:
    """Parse YAML text.

    Args:
        text: The content of the file.
        file: Its name, for findings.

    Returns:
        The document; an empty text gives the value None.

    Raises:
        ScenarioError: For a syntax error, nesting beyond `MAX_DEPTH`, more than `MAX_VALUES` values, an alias without
            its anchor, or a second document.
    """
    builder = _Builder(file)
    for event in _events(text, file):
        builder.take(event)
    return Document(builder.root or Node(None, file, 1), tuple(builder.problems))


def _events(text: str, file: str) -> Iterator[Any]:
    line = 1
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            line = event.end_mark.line + 1
            yield event
    except MarkedYAMLError as error:
        raise ScenarioError([syntax_finding(file, text, error)]) from error
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        got = f"the character {error.character:#06x}" if isinstance(error.character, int) else error.reason
        raise ScenarioError([Finding(file, line, "", "printable text", got, "remove the character")]) from error
    except Exception as error:  # malformed escapes, directives and characters reach us as various built-in errors
        remedy = "look for a control character, a malformed escape or a directive (`%`)"
        raise ScenarioError([Finding(file, line, "", "YAML", "something that cannot be read", remedy)]) from error
