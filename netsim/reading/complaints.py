"""Which settings a record's complaint is about."""

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from netsim.reading.scalars import Scalar, show


def concerned(cls: type[Any], given: Mapping[Any, Any], complaint: str) -> str:
    """The settings that a complaint names, as they are, by default or given; all that were given where it names none.

    Args:
        cls: The record type.
        given: What the document says, as plain values.
        complaint: What its `__post_init__` raised.
    """
    defaults = {each.name: each.default for each in fields(cls)}
    known = {name: value for name, value in (defaults | dict(given)).items() if _is_short(value)}
    order = [each.name for each in fields(cls) if each.name in known and _is_named(each.name, complaint)]
    shown = {name: list(value) if isinstance(value := known[name], tuple) else value for name in order}
    return ", ".join(f"{name}: {show(value)}" for name, value in shown.items()) or show(dict(given))


def _is_short(value: object) -> bool:
    """Whether a value is a scalar or a few of them, such as a covariance."""
    return isinstance(value, Scalar) or (
        isinstance(value, list | tuple) and all(isinstance(each, Scalar) for each in value)
    )


def _is_named(name: str, text: str) -> bool:
    return re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", text) is not None
