"""A document against a record type: every error at once, each at its line and in words.

Mappings and lists are walked here, so that the alternatives of a union which were not chosen stay silent and the types
of open records are found on the way; pydantic checks the scalars and the constraints.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

from netsim.errors import Finding, ScenarioError
from netsim.reading.complaints import concerned
from netsim.reading.describe import expected, field_words, missing_words
from netsim.reading.document import Document, Node, Path, finding_at, matches, plain
from netsim.reading.leaves import check, one_of
from netsim.reading.quantities import Unit, split_key
from netsim.reading.remedies import nearest, texts_allowed, unknown_key, wrong_value
from netsim.reading.scalars import show, show_scalar
from netsim.reading.shapes import (
    TAG,
    Field,
    ListShape,
    MapShape,
    RecordShape,
    Shape,
    TaggedShape,
    TupleShape,
    record_fields,
    shape_of,
)

T = TypeVar("T")

_VALUE = "value"  # a field of this name has the unit in the key above it: `supply_v: {value: 3, source: ...}`
_MOST_OWNERS = 6
_MOST_SUGGESTIONS = 100  # comparing spellings takes time; a file so full of errors needs no more of them


@dataclass(frozen=True, slots=True)
class Unknown:
    """A resolver's answer to a name it does not know.

    Attributes:
        expected: What it would have known, in words.
        remedy: What to do.
    """

    expected: str
    remedy: str = ""


Resolver = Callable[[str], type[Any] | Unknown]
"""Finds the record type for a name under `type`, as in `type: my_module:MyAlgorithm`."""

Resolvers = Mapping[Path, Resolver]
"""Resolvers by the path of the mapping that holds the `type`; `"*"` stands for any key or index."""


class _Missing:
    """Stands for a value that could not be made; what is wrong has been noted."""


_MISSING = _Missing()


@dataclass(slots=True)
class _Checker:
    """One pass over a document.

    `value` and its helpers return the value made, or `_MISSING` after noting why there is none.
    """

    document: Document
    resolvers: Resolvers
    relatives: Mapping[str, type[Any]] = field(default_factory=dict)
    found: list[Finding] = field(default_factory=list)

    def value(self, node: Node, path: Path, hint: Any, unit: Unit | None = None) -> Any:
        shape = shape_of(hint)
        resolver = next((r for pattern, r in self.resolvers.items() if matches(pattern, path)), None)
        if resolver is not None and not (node.value is None and shape.nullable):
            return self._open_record(node, path, resolver)
        if shape.anything:
            return plain(node)
        if node.value is None and shape.nullable:
            return None
        if isinstance(node.value, dict) and shape.mapping is not None:
            return self._constrained(self._mapping(node, path, shape.mapping, unit), node, path, shape)
        if isinstance(node.value, list) and shape.sequence is not None:
            return self._constrained(self._sequence(node, path, shape.sequence, unit), node, path, shape)
        return self._scalar(node, path, hint, shape, unit)

    def _note(self, node: Node, path: Path, wanted: str, got: str, remedy: str = "") -> Any:
        self.found.append(finding_at(node.file, node.line, path, wanted, got, remedy))
        return _MISSING

    def _scalar(self, node: Node, path: Path, hint: Any, shape: Shape, unit: Unit | None) -> Any:
        if isinstance(node.value, dict | list):
            return self._note(node, path, expected(hint, unit), show(plain(node)))
        if shape.scalar is None:
            remedy = "write its keys or items below it, or remove the key if it has a default"
            remedy = remedy if node.value is None and path else ""
            return self._note(node, path, expected(hint, unit), _got(node.value), remedy)
        made, wrong = check(shape.scalar, node.value)
        if wrong is None:
            return made
        remedy = wrong_value(node.value, shape.scalar, unit, texts_allowed(shape.scalar))
        return self._note(node, path, wrong or expected(hint, unit), _got(node.value), remedy)

    def _constrained(self, made: Any, node: Node, path: Path, shape: Shape) -> Any:
        if made is _MISSING or not shape.checks:
            return made
        checked, wrong = check(Annotated[Any, *shape.checks], made)
        if wrong is None:
            return checked
        return self._note(node, path, wrong or expected(shape), show(plain(node)))

    def _sequence(self, node: Node, path: Path, shape: ListShape | TupleShape, unit: Unit | None) -> Any:
        items: list[Node] = node.value  # type: ignore[assignment]
        if isinstance(shape, TupleShape) and len(items) != len(shape.items):
            return self._note(node, path, expected(shape, unit), show(plain(node)))
        hints = shape.items if isinstance(shape, TupleShape) else [shape.item] * len(items)
        made = [
            self.value(item, (*path, i), hint, unit) for i, (item, hint) in enumerate(zip(items, hints, strict=True))
        ]
        if any(value is _MISSING for value in made):
            return _MISSING
        return tuple(made) if isinstance(shape, TupleShape) else shape.build(made)

    def _mapping(self, node: Node, path: Path, shape: Any, unit: Unit | None) -> Any:
        if isinstance(shape, RecordShape):
            return self._record(node, path, shape.cls, unit=unit)
        return self._tagged(node, path, shape) if isinstance(shape, TaggedShape) else self._free(node, path, shape)

    def _free(self, node: Node, path: Path, shape: MapShape) -> Any:
        made = {}
        for key, child in _children(node).items():
            name, wrong = check(shape.key, key)
            if wrong is not None:
                name = self._note(child, (*path, key), f"{expected(shape.key)} as key", _got(key))
            made[name] = self.value(child, (*path, key), shape.value, _key_unit(key))
        return _MISSING if any(value is _MISSING for pair in made.items() for value in pair) else made

    def _tagged(self, node: Node, path: Path, shape: TaggedShape) -> Any:
        name = self._tag(node, path, one_of(shape.members))
        if name is _MISSING:
            return _MISSING
        if name in shape.members:
            return self._record(node, path, shape.members[name], relatives=shape.members)
        meant = nearest(name, shape.members)
        remedy = f"did you mean `{meant}`?" if meant else ""
        return self._note(_children(node)[TAG], (*path, TAG), one_of(shape.members), _got(name), remedy)

    def _tag(self, node: Node, path: Path, wanted: str) -> Any:
        tag = _children(node).get(TAG)
        if tag is None:
            return self._note(node, (*path, TAG), wanted, "no such key", f"add `{TAG}: ...` here")
        if not isinstance(tag.value, str):
            return self._note(tag, (*path, TAG), wanted, _got(plain(tag)))
        return tag.value

    def _open_record(self, node: Node, path: Path, resolver: Resolver) -> Any:
        if not isinstance(node.value, dict):
            return self._note(node, path, f"a mapping with the key `{TAG}`", _got(plain(node)))
        name = self._tag(node, path, "a name")
        if name is _MISSING:
            return _MISSING
        answer = resolver(name)
        if isinstance(answer, Unknown):
            return self._note(node.value[TAG], (*path, TAG), answer.expected, _got(name), answer.remedy)
        ignored = () if TAG in record_fields(answer) else (TAG,)
        return self._record(node, path, answer, ignored=ignored, relatives=self.relatives)

    def _record(
        self,
        node: Node,
        path: Path,
        cls: type[Any],
        ignored: Sequence[str] = (),
        unit: Unit | None = None,
        relatives: Mapping[str, type[Any]] | None = None,
    ) -> Any:
        before, fields = len(self.found), record_fields(cls)
        children = {key: child for key, child in _children(node).items() if key not in ignored}
        unknown = {key: child for key, child in children.items() if key not in fields}
        meant = {self._unknown(child, (*path, key), fields, relatives or {}) for key, child in unknown.items()}
        made = {}
        for name, known in fields.items():
            if name in children:
                made[name] = self.value(
                    children[name], (*path, name), known.hint, unit if name == _VALUE else split_key(name)[1]
                )
            elif known.required and name not in meant:
                self._note(node, (*path, name), field_words(known), "no such key", missing_words(known, path))
        return self._made(cls, made, node, path) if len(self.found) == before else _MISSING

    def _unknown(
        self, node: Node, path: Path, fields: Mapping[str, Field], relatives: Mapping[str, type[Any]]
    ) -> str | None:
        owners = [name for name, cls in relatives.items() if path[-1] in record_fields(cls)]
        if owners:
            remedy = f"it belongs to {', '.join(owners[:_MOST_OWNERS])}: leave it out, or choose such a {TAG}"
            self._note(node, path, f"a key of this {TAG}", f"`{show(path[-1])}`", remedy)
            return None
        allowed = fields if len(self.found) < _MOST_SUGGESTIONS else ()
        meant, remedy = unknown_key(path[-1], plain(node), allowed)
        wanted = one_of(fields) if fields else "no keys"
        if remedy:
            wanted = "a known key"
        self._note(node, path, wanted, f"the unknown key `{show(path[-1])}`", remedy)
        return meant

    def _made(self, cls: type[Any], values: Mapping[str, Any], node: Node, path: Path) -> Any:
        try:
            return cls(**values)
        except ScenarioError as error:
            wrong = "; ".join(f"{item.path}: {item.expected}" for item in error.findings) or str(error)
        except (ValueError, ArithmeticError) as error:
            wrong = str(error)
        return self._note(node, path, wrong, concerned(cls, plain(node), wrong))


def _children(node: Node) -> dict[Any, Node]:
    return node.value if isinstance(node.value, dict) else {}


def _key_unit(key: object) -> Unit | None:
    return split_key(key)[1] if isinstance(key, str) else None


def _got(value: object) -> str:
    if value is None:
        return "nothing"
    return (
        show(value)
        if not isinstance(value, str)
        else (show(value) if '"' in show_scalar(value) else f"`{show(value)}`")
    )


def check_document(
    document: Document,
    record_type: type[T],
    resolvers: Resolvers | None = None,
    relatives: Mapping[str, type[Any]] | None = None,
) -> tuple[T, list[Finding]]:
    """The record a document describes, and everything wrong with it; the record is meaningless if anything is.

    Args:
        document: What was read.
        record_type: The dataclass at the root.
        resolvers: How to find the types of open records.
        relatives: Known types of open records, by name, to say whose setting a misplaced one is.
    """
    checker = _Checker(document, resolvers or {}, relatives or {})
    made = checker.value(document.root, (), record_type)
    return made, sorted([*document.problems, *checker.found], key=lambda item: (item.file, item.line))


def findings(document: Document, record_type: type[Any], resolvers: Resolvers | None = None) -> list[Finding]:
    """Everything wrong with a document, by file and line; see `validate`."""
    return check_document(document, record_type, resolvers)[1]


def validate(document: Document, record_type: type[T], resolvers: Resolvers | None = None) -> T:
    """The record a document describes.

    Args:
        document: What was read.
        record_type: The dataclass at the root, declared with `netsim.parameters.parameters`.
        resolvers: How to find the types of open records: resolvers by path, as in
            `{("nodes", "*", "algorithm"): resolver}`. The value there becomes an instance of the type found; the key
            `type` is passed on if that type has a field of the name.

    Returns:
        An instance of `record_type`.

    Raises:
        ScenarioError: With a finding for everything that is wrong.
    """
    made, wrong = check_document(document, record_type, resolvers)
    if wrong:
        raise ScenarioError(wrong)
    return made
