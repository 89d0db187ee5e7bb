"""What a type hint allows in a file, as a small tree: which records, lists and scalars may stand there.

YAML knows three kinds of value, and every type is a choice with at most one alternative a kind: scalars (checked by
pydantic as one union), a list, and a mapping (a record, several records told apart by their tag, or free keys).
"""

import ast
import dataclasses
import functools
import inspect
import operator
import textwrap
import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

TAG = "type"


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a record.

    Attributes:
        name: Its key.
        hint: Its type with its annotations.
        required: Whether it has no default.
        description: The string under it, on one line.
    """

    name: str
    hint: Any
    required: bool
    description: str


@dataclass(frozen=True, slots=True)
class RecordShape:
    """A mapping with known keys that becomes an instance of a dataclass."""

    cls: type[Any]


@dataclass(frozen=True, slots=True)
class TaggedShape:
    """One of several records, told apart by the value under `type`."""

    members: Mapping[str, type[Any]]


@dataclass(frozen=True, slots=True)
class MapShape:
    """A mapping with free keys."""

    key: Any
    value: Any


@dataclass(frozen=True, slots=True)
class ListShape:
    """A list of any length."""

    item: Any
    build: type[Any]


@dataclass(frozen=True, slots=True)
class TupleShape:
    """A list of a fixed length."""

    items: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class Shape:
    """What may stand at one place.

    Attributes:
        scalar: A type for pydantic, or None if no scalar may stand here.
        sequence: The list that may stand here.
        mapping: The mapping that may stand here.
        checks: Constraints on a list or mapping as a whole, for pydantic.
        nullable: Whether nothing (`null`) may stand here.
        anything: Whether whatever stands here is taken as it is.
    """

    scalar: Any = None
    sequence: ListShape | TupleShape | None = None
    mapping: RecordShape | TaggedShape | MapShape | None = None
    checks: tuple[Any, ...] = ()
    nullable: bool = False
    anything: bool = False


def record_fields(cls: Any) -> Mapping[str, Field]:
    """The fields of a record by name, in the order of their declaration."""
    return _record_fields(cls)


@functools.cache
def _record_fields(cls: Any) -> Mapping[str, Field]:
    hints = get_type_hints(cls, include_extras=True)
    texts = field_descriptions(cls)
    return {
        field.name: Field(field.name, hints[field.name], _is_required(field), texts.get(field.name, ""))
        for field in dataclasses.fields(cls)
        if field.init
    }


def _is_required(field: "dataclasses.Field[Any]") -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def field_descriptions(cls: type[Any]) -> dict[str, str]:
    """The strings under the fields of a class and its bases, each on one line."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
        except (OSError, TypeError, SyntaxError):
            continue  # built-in, or made without a source file
        if tree.body and isinstance(tree.body[0], ast.ClassDef):
            texts.update(_strings_under_fields(tree.body[0].body))
    return texts


def _strings_under_fields(body: Sequence[ast.stmt]) -> Iterable[tuple[str, str]]:
    for field, below in pairwise(body):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            text = below.value
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                yield field.target.id, " ".join(text.value.split())


def shape_of(hint: Any) -> Shape:
    """What a type hint allows.

    Raises:
        TypeError: For a hint with two lists, or two mappings that no tag tells apart: a defect in the declaration.
    """
    return _cached_shape(hint) if is_hashable(hint) else _shape_of(hint)


def is_hashable(hint: Any) -> bool:
    """Whether a hint can be a key of a cache; an annotation may hold anything."""
    try:
        hash(hint)
    except TypeError:
        return False
    return True


def _shape_of(hint: Any) -> Shape:
    checks: tuple[Any, ...] = ()
    bare = hint
    while get_origin(bare) is Annotated:
        bare, *more = get_args(bare)
        checks = (*more, *checks)
    if bare is Any or bare is object:
        return Shape(checks=checks, anything=True, nullable=True)
    if get_origin(bare) in (Union, types.UnionType):
        return _union_shape(get_args(bare), checks, hint)
    return _single_shape(bare, checks, hint)


_cached_shape = functools.cache(_shape_of)


def _single_shape(bare: Any, checks: tuple[Any, ...], hint: Any) -> Shape:
    origin, arguments = get_origin(bare) or bare, get_args(bare)
    if bare is None or bare is type(None):
        return Shape(nullable=True)
    if dataclasses.is_dataclass(bare):
        return Shape(mapping=RecordShape(bare), checks=checks)  # type: ignore[arg-type]
    if origin in (dict, Mapping):
        return Shape(mapping=MapShape(*(arguments or (str, Any))), checks=checks)
    if origin is tuple and arguments and arguments[-1] is not Ellipsis:
        return Shape(sequence=TupleShape(arguments), checks=checks)
    if origin in (tuple, list, Sequence, frozenset, set):
        build = {list: list, set: frozenset, frozenset: frozenset}.get(origin, tuple)
        return Shape(sequence=ListShape(arguments[0] if arguments else Any, build), checks=checks)
    return Shape(scalar=hint)


def _union_shape(members: tuple[Any, ...], checks: tuple[Any, ...], hint: Any) -> Shape:
    shapes = [shape_of(member) for member in members]
    scalars = [shape.scalar for shape in shapes if shape.scalar is not None]
    sequences = [shape.sequence for shape in shapes if shape.sequence is not None]
    mappings = [shape.mapping for shape in shapes if shape.mapping is not None]
    if len(sequences) > 1:
        message = f"{hint}: a file cannot tell two kinds of list apart"
        raise TypeError(message)
    scalar = functools.reduce(operator.or_, scalars) if scalars else None
    inner = tuple(check for shape in shapes if shape.sequence or shape.mapping for check in shape.checks)
    return Shape(
        scalar=Annotated[scalar, *checks] if scalar is not None and checks else scalar,
        sequence=sequences[0] if sequences else None,
        mapping=_join(mappings, hint),
        checks=inner + checks if sequences or mappings else (),
        nullable=any(shape.nullable for shape in shapes),
        anything=any(shape.anything for shape in shapes),
    )


def _join(mappings: Sequence[Any], hint: Any) -> RecordShape | TaggedShape | MapShape | None:
    if len(mappings) < 2:
        return mappings[0] if mappings else None
    members: dict[str, type[Any]] = {}
    for mapping in mappings:
        found = mapping.members if isinstance(mapping, TaggedShape) else _tags(mapping)
        if not found or found.keys() & members.keys():
            message = f"{hint}: records of a union need a field `{TAG}: Literal[...]`, each with its own value"
            raise TypeError(message)
        members.update(found)
    return TaggedShape(members)


def _tags(shape: Any) -> dict[str, type[Any]]:
    field = record_fields(shape.cls).get(TAG) if isinstance(shape, RecordShape) else None
    if field is None or get_origin(field.hint) is not Literal:
        return {}
    return dict.fromkeys(get_args(field.hint), shape.cls)
