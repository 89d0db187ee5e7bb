"""Records back to plain values and YAML, all defaults filled in, in the order of declaration."""

import dataclasses
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

from netsim.reading.document import Path, matches
from netsim.reading.scalars import show_scalar
from netsim.reading.shapes import TAG

Namers = Mapping[Path, Callable[[Any], str]]
"""For open records that have no field `type`: the name to write for an instance, by path (`"*"` for any key)."""

_WIDTH = 100


def to_plain(record: Any, namers: Namers | None = None) -> dict[str, Any]:
    """A record as nested dicts, lists and scalars that `validate` turns into an equal record.

    Args:
        record: An instance of a record type.
        namers: What a resolver did, undone: see `Namers`.
    """
    made: dict[str, Any] = plain_value(record, namers or {})
    return made


def plain_value(value: Any, namers: Namers, path: Path = ()) -> Any:
    """A field's value as nested dicts, lists and scalars; sets in sorted order."""
    if dataclasses.is_dataclass(value):
        return _plain_record(value, namers, path)
    if isinstance(value, Mapping):
        return {key: plain_value(item, namers, (*path, key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain_value(item, namers, (*path, i)) for i, item in enumerate(value)]
    if isinstance(value, frozenset | set):
        return sorted(plain_value(item, namers, path) for item in value)
    if isinstance(value, Enum):
        return value.value
    return str(value) if isinstance(value, PurePath) else value


def _plain_record(record: Any, namers: Namers, path: Path) -> dict[str, Any]:
    names = [field.name for field in dataclasses.fields(record) if field.init]
    made = {name: plain_value(getattr(record, name), namers, (*path, name)) for name in names}
    namer = next((namer for pattern, namer in namers.items() if matches(pattern, path)), None)
    return made if namer is None or TAG in made else {TAG: namer(record), **made}


def dump_yaml(record: Any, namers: Namers | None = None) -> str:
    """A record as YAML; see `to_plain`. Equal records give equal text."""
    return "\n".join(_block(to_plain(record, namers))) + "\n"


def _block(value: Any) -> list[str]:
    """Lines in block style; what is short and holds scalars only stands on one line in flow style."""
    if (line := _one_line(value)) is not None and not (isinstance(value, dict) and value):
        return [line]
    lines: list[str] = []
    for mark, item in _items(value):
        line, inner = _one_line(item), "  "
        if line is not None:
            lines.append(f"{mark} {line}")
        elif mark == "-":
            first, *rest = _block(item)
            lines += [f"- {first}", *(inner + text for text in rest)]
        else:
            lines += [mark, *(inner + text for text in _block(item))]
    return lines


def _items(value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [(f"{show_scalar(key)}:", item) for key, item in value.items()]
    return [("-", item) for item in value]


def _one_line(value: Any) -> str | None:
    if not isinstance(value, dict | list):
        return show_scalar(value)
    if any(isinstance(item, dict | list) and item for item in (value.values() if isinstance(value, dict) else value)):
        return None
    if isinstance(value, dict):
        line = "{" + ", ".join(f"{show_scalar(key)}: {_one_line(item)}" for key, item in value.items()) + "}"
    else:
        line = "[" + ", ".join(str(_one_line(item)) for item in value) + "]"
    return line if len(line) <= _WIDTH or not value else None
