"""In which settings scenarios differ: the same walk through several nested documents at once."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from netsim.reading import path_text

TAG = "type"
SHOWN_CHARACTERS = 60


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that is not the same everywhere.

    Attributes:
        path: Where it stands, as after `--set`.
        values: What it is in each document, as text; `(none)` where it is missing.
    """

    path: str
    values: tuple[str, ...]


class _Absent:
    """Stands for a value that is not there."""


_ABSENT = _Absent()


def differing(documents: Sequence[Any]) -> list[Setting]:
    """The values in which documents of dicts, lists and scalars differ, in the order of the first that has them.

    Where sections of different `type` stand, or lists of different length, they are told as a whole.
    """
    return list(_walk((), documents))


def _walk(path: tuple[Any, ...], values: Sequence[Any]) -> Iterator[Setting]:
    first = values[0]
    if all(
        isinstance(value, Mapping) and isinstance(first, Mapping) and value.get(TAG) == first.get(TAG)
        for value in values
    ):
        for key in dict.fromkeys(key for value in values for key in value):
            yield from _walk((*path, key), [value.get(key, _ABSENT) for value in values])
    elif all(isinstance(value, list) and isinstance(first, list) and len(value) == len(first) for value in values):
        for index, items in enumerate(zip(*values, strict=True)):
            yield from _walk((*path, index), items)
    elif not all(type(value) is type(first) and value == first for value in values):
        yield Setting(path_text(path), tuple(map(_text, values)))


def _text(value: Any) -> str:
    if value is _ABSENT:
        return "(none)"
    if isinstance(value, Mapping) and TAG in value:
        return f"{TAG}: {value[TAG]}"
    text = "null" if value is None else str(value).lower() if isinstance(value, bool) else " ".join(str(value).split())
    return text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 3] + "..."
