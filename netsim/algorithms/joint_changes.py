"""What becomes of identities, as leaders number it: meetings and evidence, starts of rows, and places of leaders."""

from dataclasses import dataclass
from typing import Final

EVIDENCE, EVEN, SHARES = 0, 1, 2
"""Kinds of changes: something was learned of a track; tracks met, evenly mixed or by given shares."""

Number = tuple[int, int, int]
"""Of a change: a clock that is above all that its author knew of, the author's node, and the lowest of its tracks."""

EXACT: Final = 0xFFFF
"""As `Epoch.heard`: the rows are not from hearsay."""


@dataclass(frozen=True, slots=True)
class Change:
    """A meeting of tracks, or evidence about one.

    Attributes:
        number: Its place in the order.
        era: The group's last when it was made: it is part of what later epochs begin with.
        kind: `EVIDENCE`, `EVEN` or `SHARES`.
        tracks: Who met, or of whom something was learned.
        values: Likelihood of each identity, or shares row by row; nothing for `EVEN`.
    """

    number: Number
    era: int
    kind: int
    tracks: tuple[int, ...]
    values: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, order=True)
class Epoch:
    """What a row's start is the start of. Of two the greater counts; equal ones are of equal rows.

    Attributes:
        era: Goes up where one leader has all the group's tracks: nobody else has anything to add, and a new start is made.
        heard: Clock of the last change that is in rows from hearsay; `EXACT` if they are not.
        check: Of the group's rows.
    """

    era: int
    heard: int
    check: int

    def has(self, change: Change) -> bool:
        """Whether a change is in the rows already."""
        return change.era < self.era or (
            change.era == self.era and self.heard != EXACT and change.number[0] <= self.heard
        )


FIRST: Final = Epoch(0, EXACT, 0)
"""Of tracks that have met nobody."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a track's leader is: node, as of a turn of its group."""

    turn: int
    leader: int
