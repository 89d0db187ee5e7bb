"""Numbers, lists and names as the lines of a time line have them."""

import json
from collections.abc import Iterable

SHOWN_ENTRIES = 6
"""Of more numbers or messages only the first so many are told."""


def fields(text: str) -> str:
    """The fields of an algorithm's record, from their JSON."""
    try:
        found = json.loads(text)
    except ValueError:
        return text
    return ", ".join(f"{name} {value}" for name, value in found.items()) if isinstance(found, dict) else text


def listed(texts: Iterable[str]) -> str:
    """The first few texts, and how many there are in all."""
    shown = list(texts)
    more = f", ... ({len(shown)} in all)" if len(shown) > SHOWN_ENTRIES else ""
    return ", ".join(shown[:SHOWN_ENTRIES]) + more


def counted(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def words(name: str) -> str:
    """A name of the trace's vocabulary as words."""
    return name.replace("_", " ")
