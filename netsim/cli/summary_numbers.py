"""How the figures of a run's table are written."""

from collections.abc import Mapping


def percent(share: float | None) -> str:
    """A share as a percentage."""
    return "-" if share is None else f"{100 * share:.2f} %"


def number(value: float | None) -> str:
    """A number that an exact computation gives, if it is within reach."""
    return "beyond reach" if value is None else f"{value:.4g}"


def seconds(time_s: float | None) -> str:
    """A duration."""
    return "-" if time_s is None else f"{time_s:.4g} s"


def metres(distance_m: float | None) -> str:
    """A distance."""
    return "-" if distance_m is None else f"{distance_m:.4g} m"


def counted_parts(total: int, parts: Mapping[str, int]) -> str:
    """A total with its parts."""
    return f"{total:,} ({counts(parts)})" if total else "0"


def largest(parts: Mapping[str, int], most: int) -> dict[str, int]:
    """Parts as they are if they are few; else the largest ones, with the sum of the others."""
    if len(parts) <= most:
        return dict(parts)
    ordered = sorted(parts.items(), key=lambda item: -item[1])
    return {**dict(ordered[: most - 1]), "other": sum(count for _, count in ordered[most - 1 :])}


def counts(parts: Mapping[str, int]) -> str:
    """Counts with their names."""
    return ", ".join(f"{count:,} {name}" for name, count in parts.items())
