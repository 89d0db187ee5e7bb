"""What to do about a wrong key or value: suggestions by spelling and by unit."""

import math
import re
from collections.abc import Collection, Iterable
from typing import Any

from netsim.reading.leaves import leaf_schema
from netsim.reading.quantities import Unit, convert, number_text, parse_quantity, split_key
from netsim.reading.scalars import Scalar, scalar_value, show_scalar

_TRUTHS = {"yes": "true", "on": "true", "no": "false", "off": "false"}
_LONGEST_COMPARED = 60


def edit_distance(first: str, second: str) -> int:
    """Least number of insertions, deletions, substitutions and swaps of neighbours that turn one text into the other.

    The optimal string alignment distance: a swapped pair is not edited again.
    """
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, a in enumerate(first, 1):
        before, last, row = row, before, [i]
        for j, b in enumerate(second, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and a == second[j - 2] and first[i - 2] == b:
                best = min(best, last[j - 2] + 1)
            row.append(best)
    return row[-1]


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name closest in spelling, if one is close: a third of the letters may differ, and one always may."""
    folded = name.lower().replace("-", "_")
    if len(folded) > _LONGEST_COMPARED:
        return None
    near = [(edit_distance(folded, other.lower().replace("-", "_")), other) for other in known]
    near = [(distance, other) for distance, other in near if distance <= max(1, min(len(name), len(other)) // 3)]
    return min(near, default=(0, None))[1]


def unknown_key(key: Any, value: Any, allowed: Collection[str]) -> tuple[str | None, str]:
    """The key that was probably meant, and the remedy in words.

    Args:
        key: The key in the file.
        value: Its value, to be converted if the key that was meant has another unit.
        allowed: The keys of the record.

    Returns:
        The key or None, and the remedy; the words are empty if nothing comes close.
    """
    if not isinstance(key, str):
        return None, ""
    stem, unit = split_key(key)
    for other in allowed:
        other_stem, other_unit = split_key(other)
        if other_unit and other_stem == stem and (unit is None or unit.dimension == other_unit.dimension):
            return other, f"did you mean `{other}`? {_unit_hint(value, unit, other, other_unit)}"
    meant = nearest(key, allowed)
    return meant, f"did you mean `{meant}`?" if meant else ""


def _unit_hint(value: Any, unit: Unit | None, other: str, other_unit: Unit) -> str:
    hint = f"it is in {other_unit.name}"
    quantity = parse_quantity(value) if isinstance(value, str) else None
    amount, source = quantity or (value, unit)
    if source is None or isinstance(amount, bool) or not isinstance(amount, int | float):
        return hint
    rate, converted = convert(1.0, source, other_unit), convert_number(amount, source, other_unit)
    if converted is None:
        return hint
    rate_text = "" if rate is None or "dbm" in (source.suffix, other_unit.suffix) else _rate(rate, source, other_unit)
    return f"{hint}{rate_text}; write `{other}: {converted}`"


def _rate(rate: float, source: Unit, target: Unit) -> str:
    return f" (1 {source.suffix} = {number_text(rate)} {target.suffix})".replace("_per_", "/")


def convert_number(value: float, source: Unit, target: Unit) -> str | None:
    """A number of the file in another unit, as text; None where that is impossible."""
    try:
        converted = convert(float(value), source, target)
    except OverflowError:
        return None
    return None if converted is None else number_text(converted)


def wrong_value(value: Scalar, hint: Any, unit: Unit | None, names: Collection[str] = ()) -> str:
    """The remedy for a scalar of the wrong type or out of range; empty if there is no better one than what is expected.

    Args:
        value: What the file holds.
        hint: The type wanted.
        unit: The unit in the key.
        names: The texts allowed, if only some are.
    """
    kinds = set(_kinds(leaf_schema(hint)))
    if value is None:
        return "write a value, or remove the key if it has a default"
    if isinstance(value, str):
        return _wrong_text(value, kinds, unit, names)
    if "string" in kinds and not names:
        return f'write it in quotes: "{show_scalar(value)}"'
    if isinstance(value, float) and not math.isfinite(value):
        return "write a finite number"
    if isinstance(value, float) and value.is_integer() and "integer" in kinds and "number" not in kinds:
        return f"write {int(value)}" if abs(value) < 1e15 else ""
    return ""


def _wrong_text(value: str, kinds: set[str], unit: Unit | None, names: Collection[str]) -> str:
    if "boolean" in kinds and value.lower() in _TRUTHS:
        return f"write {_TRUTHS[value.lower()]}"
    if kinds & {"number", "integer"} and (remedy := _text_for_number(value, unit)):
        return remedy
    meant = nearest(value, names)
    return f"did you mean `{meant}`?" if meant else ""


def _text_for_number(value: str, unit: Unit | None) -> str:
    quantity = parse_quantity(value)
    if quantity and unit and (converted := convert_number(quantity[0], quantity[1], unit)):
        return f"write {converted}: the unit is in the key"
    if quantity:
        return f"write the number alone; the unit of the key is {unit.name}" if unit else "write the number alone"
    bare = value.strip().replace("_", "")
    if re.fullmatch(r"[-+]?[0-9]+,[0-9]+", bare):
        bare = bare.replace(",", ".")
    if len(bare) <= _LONGEST_COMPARED and isinstance(scalar_value(bare), int | float) and bare.lower() not in _TRUTHS:
        return f"write {bare} without quotes" if bare == value.strip() else f"write {bare}"
    return ""


def _kinds(schema: Any) -> Iterable[str]:
    for part in schema.get("anyOf", [schema]):
        if "type" in part:
            yield part["type"]


def texts_allowed(hint: Any) -> list[str]:
    """The texts a scalar type allows, if it names them one by one."""
    parts = leaf_schema(hint)
    values: list[Any] = []
    for part in parts.get("anyOf", [parts]):
        values += part.get("enum", [part["const"]] if "const" in part else [])
    return [value for value in values if isinstance(value, str)]
