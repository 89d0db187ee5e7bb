"""What is expected at a place, in words."""

from typing import Any

from netsim.reading.document import Path, path_text
from netsim.reading.leaves import one_of, words
from netsim.reading.limits import limit_words
from netsim.reading.quantities import Unit, split_key
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

_MAX_KEYS = 8


def expected(hint: Any, unit: Unit | None = None) -> str:
    """What a type, or one alternative of it, allows: `a number > 0 (metres)`, `a list of 2 items`, ...

    Args:
        hint: A type hint, a shape or a part of a shape.
        unit: The unit in the key.
    """
    if isinstance(hint, ListShape | TupleShape):
        return _list_words(hint, unit)
    if isinstance(hint, RecordShape | TaggedShape | MapShape):
        return _mapping_words(hint)
    shape = hint if isinstance(hint, Shape) else shape_of(hint)
    parts = [] if shape.scalar is None else [words(shape.scalar, unit)]
    limits = limit_words(shape.checks)
    limits = f" ({limits} of them)" if limits else ""
    parts += [expected(part, unit) + limits for part in (shape.sequence, shape.mapping) if part is not None]
    parts += ["null"] if shape.nullable else []
    return "anything" if shape.anything else " or ".join(parts)


def _list_words(shape: ListShape | TupleShape, unit: Unit | None) -> str:
    if isinstance(shape, ListShape):
        return f"a list, each item {expected(shape.item, unit)}"
    items = [expected(item, unit) for item in shape.items]
    if len(set(items)) == 1:
        return f"a list of {len(items)} items, each {items[0]}"
    return f"a list of {len(items)} items: {', '.join(items)}"


def _mapping_words(shape: RecordShape | TaggedShape | MapShape) -> str:
    if isinstance(shape, MapShape):
        return f"a mapping from {words(shape.key)} to {expected(shape.value)}"
    if isinstance(shape, TaggedShape):
        return f"a mapping whose `{TAG}` is {one_of(shape.members)}"
    return f"a mapping with the keys {key_list(record_fields(shape.cls))}"


def key_list(names: Any) -> str:
    """The first few of many names."""
    listed = list(names)
    return ", ".join(listed[:_MAX_KEYS]) + (", ..." if len(listed) > _MAX_KEYS else "")


def field_words(field: Field) -> str:
    """A field's type and meaning: `a number > 0 (metres): distance of full reception`."""
    kind = expected(field.hint, split_key(field.name)[1])
    return f"{kind}: {_first_sentence(field.description)}" if field.description else kind


def _first_sentence(text: str) -> str:
    return text.split(". ")[0].rstrip(".")


def missing_words(field: Field, path: Path) -> str:
    """What to do about a missing key."""
    return f"add `{field.name}: ...` {f'under `{path_text(path)}`' if path else 'at the top of the file'}"
