"""The field reference: one row for everything a file can say."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from netsim.reading.describe import expected
from netsim.reading.leaves import bounds, leaf_schema, one_of, schema_words
from netsim.reading.limits import limit_words
from netsim.reading.quantities import Unit, split_key
from netsim.reading.scalars import show
from netsim.reading.schema import OpenTypes, field_default, record_description
from netsim.reading.shapes import (
    TAG,
    ListShape,
    MapShape,
    RecordShape,
    Shape,
    TaggedShape,
    TupleShape,
    record_fields,
    shape_of,
)


@dataclass(frozen=True, slots=True)
class FieldRow:
    """One row of the field reference.

    Attributes:
        path: Where it stands: `nodes[].count`; a record chosen by its type as in `medium{disk}.radius_m`.
        type: What it is, in words.
        default: As it would be written in a file; empty for a required field.
        unit: Its unit in words, or empty.
        range: The values allowed, in words, or empty.
        description: The string under the field; for a record chosen by its type, its docstring.
    """

    path: str
    type: str
    default: str
    unit: str
    range: str
    description: str


def field_reference(record_type: type[Any], open_types: OpenTypes | None = None) -> list[FieldRow]:
    """Every field of a record and of the records in it, in the order of declaration.

    Args:
        record_type: The dataclass at the root.
        open_types: The known types of open records, to list their fields too.
    """
    return list(_record_rows(record_type, "", open_types or {}, ()))


def _record_rows(cls: type[Any], path: str, types: OpenTypes, above: tuple[type[Any], ...]) -> Iterator[FieldRow]:
    if cls in above:
        return  # a record that contains itself is listed once
    for name, known in record_fields(cls).items():
        here = f"{path}.{name}".removeprefix(".")
        default, unit = field_default(cls, name), split_key(name)[1]
        shown = "" if default is dataclasses.MISSING else show(default)
        inner, shape = _below(types, name), shape_of(known.hint)
        kind = type_words(shape, inner)
        yield FieldRow(here, kind, shown, _unit_words(shape, unit), range_words(shape), known.description)
        yield from _inner_rows(shape, here, inner, (*above, cls))


def _inner_rows(shape: Shape, path: str, types: OpenTypes, above: tuple[type[Any], ...]) -> Iterator[FieldRow]:
    if () in types:
        yield from _member_rows(types[()], path, types, above)
    elif isinstance(shape.mapping, RecordShape):
        yield from _record_rows(shape.mapping.cls, path, types, above)
    elif isinstance(shape.mapping, TaggedShape):
        yield from _member_rows(shape.mapping.members, path, types, above)
    elif isinstance(shape.mapping, MapShape):
        yield from _inner_rows(shape_of(shape.mapping.value), f"{path}.*", _below(types, "*"), above)
    if isinstance(shape.sequence, ListShape):
        yield from _inner_rows(shape_of(shape.sequence.item), f"{path}[]", _below(types, "*"), above)


def _member_rows(members: Any, path: str, types: OpenTypes, above: tuple[type[Any], ...]) -> Iterator[FieldRow]:
    for name, cls in members.items():
        here = f"{path}{{{name}}}"
        yield FieldRow(here, "record", "", "", "", record_description(cls))
        yield from _record_rows(cls, here, {key: value for key, value in types.items() if key}, above)


def _below(types: OpenTypes, key: str) -> OpenTypes:
    return {path[1:]: known for path, known in types.items() if path and path[0] in (key, "*")}


def type_words(shape: Shape, types: OpenTypes) -> str:
    """What may stand at a place, without range and unit."""
    if () in types:
        return f"record by `{TAG}`: {', '.join([*types[()], 'module:Class'])}"
    if shape.anything:
        return "anything"
    parts = [] if shape.scalar is None else [schema_words(_unbounded(leaf_schema(shape.scalar)))]
    parts += [] if shape.sequence is None else [_list_type(shape.sequence)]
    parts += [] if shape.mapping is None else [_mapping_type(shape.mapping)]
    return " or ".join(parts + (["nothing"] if shape.nullable else []))


def _list_type(shape: ListShape | TupleShape) -> str:
    if isinstance(shape, ListShape):
        return f"list of {type_words(shape_of(shape.item), {})}"
    return "[" + ", ".join(type_words(shape_of(item), {}) for item in shape.items) + "]"


def _mapping_type(shape: RecordShape | TaggedShape | MapShape) -> str:
    if isinstance(shape, TaggedShape):
        return f"record by `{TAG}`: {one_of(shape.members).removeprefix('one of ')}"
    return "record" if isinstance(shape, RecordShape) else f"mapping to {type_words(shape_of(shape.value), {})}"


def range_words(shape: Shape) -> str:
    """The range of a number, or how many items or keys there may be."""
    schema = {} if shape.scalar is None else leaf_schema(shape.scalar)
    parts = [bounds(part) for part in schema.get("anyOf", [schema])]
    if isinstance(shape.sequence, ListShape):
        parts.append(range_words(shape_of(shape.sequence.item)))
    return ", ".join(filter(None, [*parts, limit_words(shape.checks)]))


def _unbounded(schema: dict[str, Any]) -> dict[str, Any]:
    if "anyOf" in schema:
        return {"anyOf": [_unbounded(part) for part in schema["anyOf"]]}
    return {key: value for key, value in schema.items() if key in ("type", "const", "enum", "pattern")}


def _unit_words(shape: Shape, unit: Unit | None) -> str:
    return unit.name if unit and (shape.sequence or f"({unit.name})" in expected(shape, unit)) else ""
