"""Temporary."""

from typing import Any


def flatten(figures: Any, prefix: str = "") -> dict[str, Any]:
    """Flat."""
    flat = {}
    for name, value in figures.items():
        if isinstance(value, dict):
            flat.update(flatten(value, f"{prefix}{name}."))
        elif not isinstance(value, list):
            flat[prefix + name] = value
    return flat
