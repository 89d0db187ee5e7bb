"""Scalars: checked by pydantic, described in words drawn from their JSON Schema."""

import inspect
from collections.abc import Mapping
from enum import Enum
from functools import cache
from pathlib import PurePath
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticInvalidForJsonSchema, PydanticSchemaGenerationError

from netsim.reading.quantities import Unit
from netsim.reading.scalars import show_scalar
from netsim.reading.shapes import is_hashable

_OWN_MESSAGE = ("value_error", "assertion_error")  # from a validator that somebody wrote, worth showing as it is
_BOUNDS = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}


def adapter(hint: Any) -> TypeAdapter[Any]:
    """The pydantic checker of a scalar type: no text for numbers, no bool for int, no infinities."""
    return _cached_adapter(hint) if is_hashable(hint) else _adapter(hint)


def _adapter(hint: Any) -> TypeAdapter[Any]:
    lax = inspect.isclass(hint) and issubclass(hint, Enum | PurePath)  # a file holds their text, never an instance
    config = ConfigDict(strict=not lax, allow_inf_nan=False, arbitrary_types_allowed=True)
    return TypeAdapter(hint, config=config)


_cached_adapter = cache(_adapter)


def check(hint: Any, value: object) -> tuple[Any, str | None]:
    """Check a value against a type.

    Args:
        hint: A scalar type, or `Annotated[Any, ...]` with constraints.
        value: What the file holds.

    Returns:
        The value as the type wants it (an int becomes a float), and None; or None and what is wrong: a message of a
        validator of one's own, or empty where the type's description says it all.
    """
    try:
        return adapter(hint).validate_python(value), None
    except ValidationError as error:
        own = [item["msg"].split(", ", 1)[1] for item in error.errors() if item["type"] in _OWN_MESSAGE]
        return None, "; ".join(own)


def leaf_schema(hint: Any) -> dict[str, Any]:
    """The JSON Schema of a scalar type; empty for a type that has none."""
    try:
        return adapter(hint).json_schema()
    except (PydanticInvalidForJsonSchema, PydanticSchemaGenerationError):
        return {}


def words(hint: Any, unit: Unit | None = None) -> str:
    """A scalar type in words: `a number > 0 (metres)`."""
    return schema_words(leaf_schema(hint), unit)


def schema_words(schema: Mapping[str, Any], unit: Unit | None = None) -> str:
    """A JSON Schema of a scalar in words."""
    if "anyOf" in schema:
        return " or ".join(schema_words(part, unit) for part in schema["anyOf"])
    if "const" in schema:
        return show_scalar(schema["const"])
    if "enum" in schema:
        return one_of(show_scalar(value) for value in schema["enum"])
    kind = schema.get("type")
    if kind in ("number", "integer"):
        return _number_words(schema, unit)
    if kind == "string":
        return _text_words(schema)
    return {"boolean": "true or false", "null": "null"}.get(str(kind), "another value")


def one_of(names: Any) -> str:
    """Alternatives in words: `one of a, b, c`."""
    listed = list(names)
    return listed[0] if len(listed) == 1 else "one of " + ", ".join(listed)


def _number_words(schema: Mapping[str, Any], unit: Unit | None) -> str:
    noun = "a number" if schema["type"] == "number" else "a whole number"
    return f"{noun} {bounds(schema)}".rstrip() + (f" ({unit.name})" if unit else "")


def bounds(schema: Mapping[str, Any]) -> str:
    """The range of a number in words, such as `>= 0 and <= 1`; empty without limits."""
    limits = [f"{sign} {schema[key]:.15g}" for key, sign in _BOUNDS.items() if key in schema]
    limits += [f"in multiples of {schema['multipleOf']:.15g}"] if "multipleOf" in schema else []
    return " and ".join(limits)


def _text_words(schema: Mapping[str, Any]) -> str:
    if "pattern" in schema:
        return f"text that matches `{schema['pattern']}`"
    low, high = schema.get("minLength"), schema.get("maxLength")
    limits = [f"at least {low}"] if low and low > 1 else []
    limits += [f"at most {high}"] if high is not None else []
    noun = "text that is not empty" if low == 1 else "text"
    return f"{noun} of {' and '.join(limits)} characters" if limits else noun
