"""What a courier keeps of one peer: what was sent to it, what came from it, and which life of it this is."""

from dataclasses import dataclass, field

from netsim.codec import Record

NUMBERS = 1 << 16
"""Message numbers go round after so many (serial numbers: RFC 1982)."""
WINDOW = 64
HEAD = Record("HHHB")
"""Before each message: the sender's life, the receiver's as the sender knows it or 0, number, whether to confirm."""
STATUS = Record("HHHQB")
"""The two lives; first number that is missing, which of the 64 after it have come, whether what is missing is wanted."""


@dataclass(slots=True, eq=False)
class Peer:
    """One peer of a courier.

    Attributes:
        life: The life of it that messages came from; 0 before the first.
        is_lost: Whether one of the two began a new life, so that nothing can be made up for any more.
        kept: All that was sent to it.
        delivered_ns: When the link layer took a message for delivered that was not confirmed, by number.
        repeated: Numbers that were sent more than once.
        under_way: Numbers that are being sent, or wait to be confirmed.
    """

    life: int = 0
    is_lost: bool = False
    kept: list[bytes] = field(default_factory=list)
    delivered_ns: dict[int, int] = field(default_factory=dict)
    repeated: set[int] = field(default_factory=set)
    under_way: set[int] = field(default_factory=set)
    _confirmed_below: int = 0
    _confirmed: set[int] = field(default_factory=set)
    _first: int = 0
    _beyond: set[int] = field(default_factory=set)

    def takes(self, number: int) -> bool:
        """Note that a message has come, by its number on the air; whether it is new."""
        ahead = (number - self._first) % NUMBERS
        if ahead >= NUMBERS // 2 or self._first + ahead in self._beyond:
            return False
        self._beyond.add(self._first + ahead)
        while self._first in self._beyond:
            self._beyond.remove(self._first)
            self._first += 1
        return True

    def received(self) -> tuple[int, int]:
        """The first number that is missing, as on the air, and a bit for each of those after it that have come."""
        have = sum(1 << (number - self._first - 1) for number in self._beyond if number - self._first <= WINDOW)
        return self._first % NUMBERS, have

    def confirm(self, first: int, have: int) -> tuple[list[int], list[int]]:
        """Take what the peer says it has received.

        Returns:
            Numbers newly confirmed, and those it lacks, up to the end of the window.
        """
        sent = len(self.kept)
        first = sent - (sent - first) % NUMBERS
        after = {first + 1 + bit for bit in range(WINDOW) if have >> bit & 1}
        new = [
            number for number in (*range(self._confirmed_below, first), *sorted(after)) if not self.is_confirmed(number)
        ]
        self._confirmed_below = max(self._confirmed_below, first)
        self._confirmed = {number for number in self._confirmed | after if number >= self._confirmed_below}
        for number in new:
            self.delivered_ns.pop(number, None)
        ends = min(sent, first + WINDOW + 1)
        return new, [number for number in range(first, ends) if not self.is_confirmed(number)]

    def is_confirmed(self, number: int) -> bool:
        """Whether the peer has said that it received a message."""
        return number < self._confirmed_below or number in self._confirmed
