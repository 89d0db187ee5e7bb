"""Laying documents over each other: files over the files they extend, assignments over files."""

import re
from dataclasses import dataclass, replace
from typing import Any

from netsim.errors import Finding, ScenarioError
from netsim.reading.document import OVERRIDE, Document, Node, OverrideFinding, Path, finding_at
from netsim.reading.parse import parse
from netsim.reading.scalars import show
from netsim.reading.shapes import TAG

_ASSIGNED = re.compile(r"[^.\[\]]+(\.[^.\[\]]+|\[\d+\])*")


def overlay(base: Node, over: Node) -> Node:
    """One tree laid over another; every value keeps the position it was written at.

    Mappings are merged key by key, in the base's order with new keys behind. Everything else is replaced, and so is a
    mapping whose `type` differs: its other keys would mean something else.
    """
    if not isinstance(base.value, dict) or not isinstance(over.value, dict) or type_differs(base, over):
        return over
    merged = dict(base.value)
    for key, node in over.value.items():
        merged[key] = overlay(merged[key], node) if key in merged else node
    return replace(over, value=merged)


def type_differs(base: Node, over: Node) -> bool:
    """Whether the upper mapping names a `type` that the lower one does not."""
    old, new = base.child(TAG), over.child(TAG)
    return new is not None and (old is None or Document(old).plain() != Document(new).plain())


def apply_override(document: Document, override: str) -> Document:
    """A document with one value set from the command line.

    The value is YAML (`3.5`, `[1, 2]`, `{type: disk, radius_m: 10}`) and replaces what was there. Setting a `type` to
    another one drops the keys that came from files beside it. Parts of the path that do not exist are made; validation
    finds them if they are misspelt.

    Args:
        document: The document; it is not changed.
        override: `path=value` with dotted keys and list indices: `nodes[0].count=9` or `nodes.0.count=9`.

    Raises:
        ScenarioError: If the text is no assignment, its value no YAML, or an index outside its list.
    """
    target, equals, text = (part.strip() for part in override.partition("="))
    if not equals or not is_assignable(target):
        remedy = "write it like `medium.exponent=3.5` or `nodes[0].count=9`"
        raise ScenarioError([OverrideFinding(OVERRIDE, 0, "", "path=value", show(override), remedy)])
    try:
        parsed = parse(text, OVERRIDE)
    except ScenarioError as error:
        raise ScenarioError(_about(target, error.findings)) from error
    root = _Assignment(OVERRIDE, 0, _from_command_line(parsed.root)).into(document.root, keys_of(target), ())
    return Document(root, document.problems + _about(target, parsed.problems))


def assign(document: Document, target: str, value: Node) -> Document:
    """A document with one value set from another file: like `apply_override`, but findings name the file of the value.

    Args:
        document: The document; it is not changed.
        target: Dotted keys and list indices: `nodes[0].count` or `nodes.0.count`.
        value: The value as it was read.

    Raises:
        ScenarioError: If the target is no path, or an index is outside its list.
    """
    if not is_assignable(target):
        remedy = "write it like `medium.exponent` or `nodes[0].count`"
        raise ScenarioError([finding_at(value.file, value.line, (), "the path of a value", show(target), remedy)])
    root = _Assignment(value.file, value.line, value).into(document.root, keys_of(target), ())
    return Document(root, document.problems)


def is_assignable(target: str) -> bool:
    """Whether a text is a path of dotted keys and list indices."""
    return _ASSIGNED.fullmatch(target) is not None


def keys_of(target: str) -> tuple[str, ...]:
    """The keys and indices of a path, as texts: `nodes[0].count` and `nodes.0.count` are the same."""
    return tuple(re.findall(r"[^.\[\]]+", target))


def _about(target: str, found: tuple[Finding, ...]) -> tuple[Finding, ...]:
    return tuple(OverrideFinding(OVERRIDE, 0, target, item.expected, item.got, item.remedy) for item in found)


def _from_command_line(node: Node) -> Node:
    if isinstance(node.value, dict):
        return Node({key: _from_command_line(child) for key, child in node.value.items()}, OVERRIDE, 0)
    if isinstance(node.value, list):
        return Node([_from_command_line(child) for child in node.value], OVERRIDE, 0)
    return Node(node.value, OVERRIDE, 0)


@dataclass(frozen=True, slots=True)
class _Assignment:
    """A value, and from where it is assigned; what was assigned from there before stays when a `type` changes."""

    file: str
    line: int
    value: Node

    def into(self, node: Node, keys: tuple[str, ...], path: Path) -> Node:
        """The node with the value put in at the keys."""
        if not keys:
            return self.value
        first, rest = keys[0], keys[1:]
        if isinstance(node.value, list):
            index = self._index(node.value, first, path)
            items = list(node.value)
            items[index] = self.into(items[index], rest, (*path, index))
            return replace(node, value=items)
        known: dict[Any, Node] = node.value if isinstance(node.value, dict) else {}
        kept = known
        if keys == (TAG,) and type_differs(node, Node({TAG: self.value}, self.file, self.line)):
            kept = {key: child for key, child in known.items() if child.file == self.file}
        inner = self.into(kept.get(first, Node({}, self.file, self.line)), rest, (*path, first))
        merged = {**kept, first: inner}
        return replace(node, value=merged) if isinstance(node.value, dict) else Node(merged, self.file, self.line)

    def _index(self, items: list[Node], key: str, path: Path) -> int:
        if re.fullmatch(r"[0-9]{1,9}", key) and int(key) < len(items):
            return int(key)
        expected = f"an index from 0 to {len(items) - 1}" if items else "no index: the list is empty"
        remedy = "count the items of the list from 0"
        raise ScenarioError([finding_at(self.file, self.line, path, expected, f"`{key}`", remedy)])
