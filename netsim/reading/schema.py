"""The JSON Schema of a record type (draft 2020-12), for editors: the same declarations that `validate` reads.

A file names it in its first line, `# yaml-language-server: $schema=...`, and the editor completes keys, shows their
meaning and marks mistakes. A file with `extends` is held to a second family of definitions that require nothing.
"""

import dataclasses
import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from netsim.reading.document import Path
from netsim.reading.dump import plain_value
from netsim.reading.files import EXTENDS
from netsim.reading.leaves import leaf_schema
from netsim.reading.limits import length_limits
from netsim.reading.quantities import split_key
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

OpenTypes = Mapping[Path, Mapping[str, type[Any]]]
"""Known types of open records, by path as in `netsim.reading.Resolvers`; others may be named as `module:Class`."""

_OUTSIDE = {"type": "string", "pattern": r"^[\w.]+:\w+$"}
_LAID_OVER = "overlay"


@dataclass(slots=True)
class _Schemas:
    """Collects the definitions of the records met on the way."""

    definitions: dict[str, dict[str, Any]] = field(default_factory=dict)
    names: dict[Any, str] = field(default_factory=dict)

    def schema(self, hint: Any, types: OpenTypes, part: bool) -> dict[str, Any]:
        shape = shape_of(hint)
        if () in types:
            alternatives = [self._open(types[()], types, part)]
        else:
            alternatives = [] if shape.scalar is None else [leaf_schema(shape.scalar)]
            alternatives += [] if shape.sequence is None else [self._sequence(shape, types)]
            alternatives += [] if shape.mapping is None else [self._mapping(shape, types, part)]
        if shape.nullable and (alternatives or not shape.anything):
            alternatives.append({"type": "null"})
        return alternatives[0] if len(alternatives) == 1 else {"anyOf": alternatives} if alternatives else {}

    def _sequence(self, shape: Shape, types: OpenTypes) -> dict[str, Any]:
        inner = _below(types, "*")
        if isinstance(shape.sequence, TupleShape):
            items = [self.schema(hint, inner, False) for hint in shape.sequence.items]
            return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}
        item = self.schema(shape.sequence.item, inner, False) if isinstance(shape.sequence, ListShape) else {}
        return {"type": "array", "items": item, **_limits(shape, "Items")}

    def _mapping(self, shape: Shape, types: OpenTypes, part: bool) -> dict[str, Any]:
        mapping = shape.mapping
        if isinstance(mapping, RecordShape):
            return self.record(mapping.cls, types, part)
        if isinstance(mapping, TaggedShape):
            return self._tagged(mapping.members, types, part, {"enum": list(mapping.members)})
        value = self.schema(mapping.value, _below(types, "*"), part) if isinstance(mapping, MapShape) else {}
        return {"type": "object", "additionalProperties": value, **_limits(shape, "Properties")}

    def _open(self, known: Mapping[str, type[Any]], types: OpenTypes, part: bool) -> dict[str, Any]:
        names = {"anyOf": [{"enum": list(known)}, _OUTSIDE]} if known else _OUTSIDE
        return self._tagged(known, {path: value for path, value in types.items() if path}, part, names)

    def _tagged(self, members: Mapping[str, Any], types: OpenTypes, part: bool, names: Any) -> dict[str, Any]:
        choices = [
            {
                "if": {"properties": {TAG: {"const": name}}, "required": [TAG]},
                "then": self.record(cls, types, part, tag=True),
            }
            for name, cls in members.items()
        ]
        schema = {"type": "object", "properties": {TAG: names}, "required": [] if part else [TAG]}
        return {**schema, "allOf": choices} if choices else schema

    def record(self, cls: type[Any], types: OpenTypes, part: bool, *, tag: bool = False) -> dict[str, Any]:
        key = (cls, part, tag and TAG not in record_fields(cls), tuple(types))
        if key not in self.names:
            self.names[key] = self._free_name(cls.__name__ + (f"-{_LAID_OVER}" if part else ""))
            self.definitions[self.names[key]] = {}  # holds the place, for records that contain themselves
            self.definitions[self.names[key]].update(self._definition(cls, types, part, key[2]))
        return {"$ref": f"#/$defs/{self.names[key]}"}

    def _free_name(self, name: str) -> str:
        taken = [other for other in self.definitions if other.split(".")[0] == name]
        return f"{name}.{len(taken) + 1}" if taken else name

    def _definition(self, cls: type[Any], types: OpenTypes, part: bool, add_tag: bool) -> dict[str, Any]:
        fields = record_fields(cls)
        made: dict[str, Any] = {"type": "object", "additionalProperties": False}
        if text := record_description(cls):
            made["description"] = text
        made["properties"] = {TAG: {"type": "string"}} if add_tag else {}
        for name, known in fields.items():
            made["properties"][name] = {**self.schema(known.hint, _below(types, name), part), **_remarks(cls, name)}
        required = [] if part else [name for name, known in fields.items() if known.required]
        return {**made, "required": required} if required else made


def json_schema(record_type: type[Any], title: str, id: str, open_types: OpenTypes | None = None) -> dict[str, Any]:
    """The JSON Schema of the files that describe a record.

    Args:
        record_type: The dataclass at the root.
        title: A short name for people.
        id: The address of the schema, for `$id`.
        open_types: The known types of open records, to complete and check them too.
    """
    schemas, types = _Schemas(), open_types or {}
    whole, part = schemas.record(record_type, types, False), schemas.record(record_type, types, True)
    extends = {"type": "string", "description": "The file this one is laid over, relative to this one."}
    schemas.definitions[part["$ref"].rpartition("/")[2]]["properties"][EXTENDS] = extends
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": id, "title": title}
    choice = {"if": {"required": [EXTENDS]}, "then": part, "else": whole}
    return {**head, "type": "object", **choice, "$defs": schemas.definitions}


def record_description(cls: type[Any]) -> str:
    """The first paragraph of a record's docstring, on one line; empty if it has none of its own."""
    text = inspect.cleandoc(cls.__doc__ or "")
    return "" if text.startswith(f"{cls.__name__}(") else " ".join(text.split("\n\n")[0].split())


def field_default(cls: type[Any], name: str) -> Any:
    """The default of a field as it would be written in a file; `dataclasses.MISSING` if it has none."""
    declared = next(item for item in dataclasses.fields(cls) if item.name == name)
    factory = declared.default_factory
    default = declared.default if factory is dataclasses.MISSING else factory()
    return default if default is dataclasses.MISSING else plain_value(default, {})


def _remarks(cls: type[Any], name: str) -> dict[str, Any]:
    unit, default, remarks = split_key(name)[1], field_default(cls, name), {}
    words = [record_fields(cls)[name].description, f"In {unit.name}." if unit else ""]
    if any(words):
        remarks["description"] = " ".join(filter(None, words))
    return remarks if default is dataclasses.MISSING else {**remarks, "default": default}


def _below(types: OpenTypes, key: str) -> OpenTypes:
    return {path[1:]: known for path, known in types.items() if path and path[0] in (key, "*")}


def _limits(shape: Shape, noun: str) -> dict[str, Any]:
    low, high = length_limits(shape.checks)
    return ({f"min{noun}": low} if low else {}) | ({} if high is None else {f"max{noun}": high})
