"""How long a list or mapping may be."""

from typing import Any

from annotated_types import Len, MaxLen, MinLen


def length_limits(checks: tuple[Any, ...]) -> tuple[int, int | None]:
    """The least and greatest length that constraints allow."""
    low, high = 0, None
    flat = [part for check in checks for part in getattr(check, "metadata", [check])]
    for limit in flat:
        if isinstance(limit, MinLen | Len):
            low = max(low, limit.min_length)
        if isinstance(limit, MaxLen | Len) and limit.max_length is not None:
            high = limit.max_length if high is None else min(high, limit.max_length)
    return low, high


def limit_words(checks: tuple[Any, ...]) -> str:
    """The limits in words, such as `at least 1 and at most 4`; empty without limits."""
    low, high = length_limits(checks)
    limits = ([f"at least {low}"] if low else []) + ([] if high is None else [f"at most {high}"])
    return " and ".join(limits)
