"""What stands at each instant, of things that are told now and then and hold for a while."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from typing import TypeVar

from netsim.replay.beliefs import HOLD_NS
from netsim.replay.options import Pace

T = TypeVar("T")


def standing(told: Iterable[tuple[int, int, T]], pace: Pace) -> dict[int, Mapping[int, T]]:
    """What holds from each instant on at which that changes.

    Args:
        told: Instant, number of what it is told of (such as a track), and what is told, in any order.
        pace: The window: what was told before it stands at its begin.

    Returns:
        By instant, in order: the last that was told of each number, unless nobody has spoken of it for `HOLD_NS`.
    """
    shown: dict[int, Mapping[int, T]] = {}
    latest: dict[int, tuple[int, T]] = {}
    for time_ns, each in groupby(_with_ends(told, pace), key=lambda change: change[0]):
        for _, number, value in each:
            if value is not None:
                latest[number] = time_ns, value
            elif number in latest and latest[number][0] + HOLD_NS <= time_ns:
                del latest[number]
        shown[max(time_ns, pace.start_ns)] = {number: value for number, (_, value) in sorted(latest.items())}
    return shown


def _with_ends(told: Iterable[tuple[int, int, T]], pace: Pace) -> Iterator[tuple[int, int, T | None]]:
    """The changes in order, and when each of them would be over."""
    changes = list(told)
    ends = [(time_ns + HOLD_NS, number, None) for time_ns, number, _ in changes if time_ns + HOLD_NS < pace.end_ns]
    yield from sorted([*changes, *ends], key=lambda change: change[0])
