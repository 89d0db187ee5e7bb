"""The JSON Schema and the field reference say what `validate` does."""

import json
import re
from typing import Any

from hypothesis import given, settings
from reading_records import Disk, Gossip, Group, LogDistance, Root
from test_checks import Tree
from test_dump import NAMERS, TYPES, roots

from netsim.reading import field_reference, findings, json_schema, parse, to_plain
from netsim.reading.reference import FieldRow

OPEN = {("nodes", "*", "algorithm"): TYPES}
SCHEMA = json_schema(Root, "Test scenario", "https://example.org/root.json", OPEN)


def test_head() -> None:
    assert {key: value for key, value in SCHEMA.items() if key != "$defs"} == {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "https://example.org/root.json",
        "title": "Test scenario",
        "type": "object",
        "if": {"required": ["extends"]},
        "then": {"$ref": "#/$defs/Root-overlay"},
        "else": {"$ref": "#/$defs/Root"},
    }
    assert json.loads(json.dumps(SCHEMA)) == SCHEMA


def test_a_record_with_units_ranges_defaults_and_descriptions() -> None:
    assert SCHEMA["$defs"]["Disk"] == {
        "type": "object",
        "additionalProperties": False,
        "description": "Everything within a radius is received.",
        "properties": {
            "type": {"type": "string", "const": "disk"},
            "radius_m": {
                "type": "number",
                "exclusiveMinimum": 0,
                "description": "Greatest distance of reception. Beyond it nothing arrives. In metres.",
            },
            "delay_s": {"type": "number", "minimum": 0, "default": 0.0, "description": "Time in the air. In seconds."},
        },
        "required": ["type", "radius_m"],
    }
    assert SCHEMA["$defs"]["Group"]["properties"]["tags"] == {
        "type": "array",
        "items": {"type": "string", "minLength": 1},
        "minItems": 1,
        "maxItems": 3,
        "default": ["all"],
    }


def test_a_file_that_extends_needs_nothing_but_its_list_items_are_whole() -> None:
    overlay = SCHEMA["$defs"]["Root-overlay"]
    assert "required" not in overlay
    assert overlay["properties"]["extends"]["type"] == "string"
    assert "extends" not in SCHEMA["$defs"]["Root"]["properties"]
    assert overlay["properties"]["nodes"]["items"] == {"$ref": "#/$defs/Group"}
    assert SCHEMA["$defs"]["Group"]["required"] == ["count"]


def test_a_record_that_contains_itself() -> None:
    tree = json_schema(Tree, "t", "i")["$defs"]["Tree"]
    assert tree["properties"]["children"]["items"] == {"$ref": "#/$defs/Tree"}
    assert [row.path for row in field_reference(Tree)] == ["label", "children"]


def accepts(schema: dict[str, Any], value: Any, definitions: dict[str, Any]) -> bool:
    """A validator for the part of JSON Schema that is used here."""

    def inner(part: Any, item: Any) -> bool:
        return accepts(part, item, definitions) if isinstance(part, dict) else bool(part)

    if "$ref" in schema and not inner(definitions[schema["$ref"].removeprefix("#/$defs/")], value):
        return False
    parts = (_has_kind, _has_value, _has_alternatives, _has_members, _has_items)
    return all(part(schema, value, inner) for part in parts)


def _has_kind(schema: dict[str, Any], value: Any, inner: Any) -> bool:
    kinds = {"object": dict, "array": list, "string": str, "null": type(None), "boolean": bool, "integer": int}
    if "type" not in schema:
        return True
    numeric = schema["type"] in ("integer", "number")
    return isinstance(value, kinds.get(schema["type"], int | float)) and not (numeric and isinstance(value, bool))


def _has_value(schema: dict[str, Any], value: Any, inner: Any) -> bool:
    good = value == schema.get("const", value) and value in schema.get("enum", [value])
    if isinstance(value, str):
        good = good and len(value) >= schema.get("minLength", 0)
    if isinstance(value, int | float) and not isinstance(value, bool):
        good = good and schema.get("minimum", value) <= value <= schema.get("maximum", value)
        good = good and ("exclusiveMinimum" not in schema or value > schema["exclusiveMinimum"])
    return good and re.search(schema.get("pattern", ""), str(value)) is not None


def _has_alternatives(schema: dict[str, Any], value: Any, inner: Any) -> bool:
    branch = ("then" if inner(schema["if"], value) else "else") if "if" in schema else ""
    some = "anyOf" not in schema or any(inner(part, value) for part in schema["anyOf"])
    every = all(inner(part, value) for part in schema.get("allOf", []))
    return some and every and (branch not in schema or inner(schema[branch], value))


def _has_members(schema: dict[str, Any], value: Any, inner: Any) -> bool:
    if not isinstance(value, dict):
        return True
    known, extra = schema.get("properties", {}), schema.get("additionalProperties", True)
    complete = all(key in value for key in schema.get("required", []))
    return complete and all(inner(known.get(key, extra), item) for key, item in value.items())


def _has_items(schema: dict[str, Any], value: Any, inner: Any) -> bool:
    if not isinstance(value, list):
        return True
    fits = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
    heads = zip(schema.get("prefixItems", []), value, strict=False)
    return (
        fits and all(inner(schema.get("items", True), item) for item in value) and all(inner(*pair) for pair in heads)
    )


@settings(max_examples=60, deadline=None)
@given(roots)
def test_the_schema_accepts_what_validates(record: Root) -> None:
    assert accepts(SCHEMA, to_plain(record, NAMERS), SCHEMA["$defs"])


def test_the_schema_refuses_what_does_not_validate() -> None:
    good = to_plain(Root(seed=1, medium=Disk(type="disk", radius_m=5.0), nodes=(Group(count=1),)), NAMERS)
    assert accepts(SCHEMA, good, SCHEMA["$defs"])
    bad: list[dict[str, Any]] = [
        {"seed": "x"},
        {"seed": True},
        {"medium": {"type": "disk"}},
        {"medium": {"type": "dsk", "radius_m": 1}},
        {"medium": {"radius_m": 1}},
        {"medium": {"type": "log-distance", "radius_m": 1}},
        {"nodes": [{"count": 0}]},
        {"nodes": [{"count": 1, "tags": []}]},
        {"nodes": [{"count": 1, "origin_m": [1]}]},
        {"nodes": [{"count": 1, "algorithm": {"type": "gossip", "period_s": 1}}]},
        {"nodes": [{"count": 1, "algorithm": {"rounds": 1}}]},
        {"loss": 1.5},
        {"zzz": 1},
        {"limit": "some"},
        {"weights": {"a": "b"}},
    ]
    resolvers = {("nodes", "*", "algorithm"): TYPES.__getitem__}
    for change in bad:
        text = json.dumps({**good, **change})
        assert findings(parse(text, "f"), Root, resolvers), change
        assert not accepts(SCHEMA, {**good, **change}, SCHEMA["$defs"]), change


def test_the_schema_lets_a_file_that_extends_leave_things_out() -> None:
    assert accepts(SCHEMA, {"extends": "base.yaml", "medium": {"delay_s": 1}}, SCHEMA["$defs"])
    assert not accepts(SCHEMA, {"extends": "base.yaml", "seed": "x"}, SCHEMA["$defs"])


def test_field_reference() -> None:
    rows = {row.path: row for row in field_reference(Root, OPEN)}
    assert list(rows)[:6] == [
        "seed",
        "medium",
        "medium{disk}",
        "medium{disk}.type",
        "medium{disk}.radius_m",
        "medium{disk}.delay_s",
    ]
    assert [
        rows[path] for path in ("medium", "medium{disk}", "medium{disk}.radius_m", "nodes[].tags", "limit", "supply_v")
    ] == [
        FieldRow("medium", "record by `type`: disk, log-distance", "", "", "", "The shared air."),
        FieldRow("medium{disk}", "record", "", "", "", "Everything within a radius is received."),
        FieldRow(
            "medium{disk}.radius_m",
            "a number",
            "",
            "metres",
            "> 0",
            "Greatest distance of reception. Beyond it nothing arrives.",
        ),
        FieldRow("nodes[].tags", "list of text", "[all]", "", "at least 1 and at most 3", ""),
        FieldRow("limit", "a whole number or none", "none", "", "> 0", ""),
        FieldRow("supply_v", "record or nothing", "null", "", "", ""),
    ]
    assert rows["nodes[].algorithm{gossip}.rounds"].range == "> 0"
    assert rows["nodes[].origin_m"].unit == "metres"
    assert rows["nodes[].battery.low_v"].default == "1.8"
    assert {"nodes[].algorithm{mine:Own}.period_s", "medium{log-distance}.exponent"} <= rows.keys()


def test_every_field_of_every_record_has_a_row() -> None:
    paths = [row.path for row in field_reference(Root, OPEN)]
    assert len(paths) == len(set(paths))
    for record, prefix in [
        (LogDistance, "medium{log-distance}"),
        (Gossip, "nodes[].algorithm{gossip}"),
        (Group, "nodes[]"),
    ]:
        assert {f"{prefix}.{name}" for name in record.__dataclass_fields__} <= set(paths)
