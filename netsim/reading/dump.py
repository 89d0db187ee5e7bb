"""Records back to plain values and YAML, all defaults filled in, in the order of declaration."""

import dataclasses
from collections.abc import Callable, Mapping
from enum import Enum
from io import StringIO
from pathlib import PurePath
from typing import Any

from ruamel.yaml import YAML

from netsim.reading.document import Path, matches
from netsim.reading.shapes import TAG

Namers = Mapping[Path, Callable[[Any], str]]
"""For open records that have no field `type`: the name to write for an instance, by path (`"*"` for any key)."""

_WIDTH = 110


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
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None  # block style, but for the innermost lists and mappings
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = _WIDTH
    yaml.allow_unicode = True
    stream = StringIO()
    yaml.dump(to_plain(record, namers), stream)
    return stream.getvalue()
