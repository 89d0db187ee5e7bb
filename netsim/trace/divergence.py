"""Where two traces part: the first event in which they differ, with what both had in common before."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from netsim.trace.events import Event
from netsim.trace.reader import RawMessage, decoded, read_raw


@dataclass(frozen=True, slots=True)
class Recorded:
    """An event with its time.

    Attributes:
        time_ns: When it was recorded.
        event: What happened.
    """

    time_ns: int
    event: Event


@dataclass(frozen=True, slots=True)
class Difference:
    """A field in which two events of a kind differ.

    Attributes:
        name: Name of the field; of one element of an array, with its index, as in `x_m[3]`.
        first: Its value in the first event.
        second: Its value in the second.
    """

    name: str
    first: Any
    second: Any


@dataclass(frozen=True, slots=True)
class Divergence:
    """The first place at which two traces differ.

    Attributes:
        common: How many events they have in common before.
        before: The last of these.
        first: What follows in the first trace; None if it ends there.
        second: What follows in the second; None if it ends there.
    """

    common: int
    before: tuple[Recorded, ...]
    first: Recorded | None
    second: Recorded | None

    @property
    def differences(self) -> list[Difference]:
        """The fields in which the two events differ; empty if they are of different kinds, or one is missing."""
        return [] if self.first is None or self.second is None else differences(self.first.event, self.second.event)


def first_divergence(first: Path | str, second: Path | str, context: int = 3) -> Divergence | None:
    """The first event in which two traces differ in time, kind or content; None if they are the same to the end.

    They are read in step and compared undecoded, so that equal stretches are quickly passed. Two traces whose fingerprints
    differ only by the files they carry are the same here.

    Args:
        first: A trace.
        second: Another.
        context: How many of the common events before to return.

    Warns:
        TruncatedTraceWarning: If one was cut short and they are the same up to there.

    Raises:
        TraceError: If one cannot be read or is damaged.
    """
    before: deque[RawMessage] = deque(maxlen=context)
    for common, (a, b) in enumerate(zip_longest(_known(first), _known(second))):
        if a != b:
            shared = tuple(_recorded(message, first) for message in before)
            return Divergence(common, shared, *(_maybe(*each) for each in ((a, first), (b, second))))
        before.append(a)
    return None


def differences(first: Event, second: Event) -> list[Difference]:
    """The fields in which two events differ; empty for events of different kinds.

    Of arrays of one length the first element that differs is given, of others the whole.
    """
    if type(first) is not type(second):
        return []
    pairs = ((each.name, getattr(first, each.name), getattr(second, each.name)) for each in fields(first))
    return [Difference(name, *map(_plain, values)) for pair in pairs for name, *values in _told(*pair)]


def _told(name: str, first: Any, second: Any) -> Iterator[tuple[str, Any, Any]]:
    if not isinstance(first, list | tuple | np.ndarray):
        if not _same(first, second):
            yield name, first, second
    elif len(first) != len(second):
        yield name, first, second
    else:
        parts = ((f"{name}[{index}]", *pair) for index, pair in enumerate(zip(first, second, strict=True)))
        yield from (next(([part] for part in parts if not _same(part[1], part[2])), []))


def _plain(value: Any) -> Any:
    """Numbers and lists of Python's own."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _same(first: Any, second: Any) -> bool:
    """Equality in which a number that is none is equal to itself."""
    return bool(first == second) or (first != first and second != second)


def _known(path: Path | str) -> Iterator[RawMessage]:
    return (message for message in read_raw(path) if message.event_type is not None)


def _maybe(message: RawMessage | None, path: Path | str) -> Recorded | None:
    return None if message is None else _recorded(message, path)


def _recorded(message: RawMessage, path: Path | str) -> Recorded:
    return Recorded(message.time_ns, decoded(path, message))
