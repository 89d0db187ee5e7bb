"""Frames in the order in which they begin, out of a trace that has them in the order in which they were recorded."""

import heapq
from pathlib import Path

from netsim.trace.cdr import leading_scalars
from netsim.trace.events import Frame
from netsim.trace.reader import read_raw


class ByStart:
    """Holds records back until nothing can come any more that begins earlier.

    Args:
        longest_ns: No frame is recorded longer than this after its beginning.
    """

    def __init__(self, longest_ns: int) -> None:
        self._longest_ns = longest_ns
        self._held: list[tuple[int, int, bytes]] = []

    def add(self, start_ns: int, recorded_ns: int, number: int, record: bytes) -> list[bytes]:
        """Take the next record, as they were recorded; returns those whose turn it is now.

        Of those that begin at one instant the one with the lower number comes first.
        """
        heapq.heappush(self._held, (start_ns, number, record))
        return self._before(recorded_ns - self._longest_ns)

    def rest(self) -> list[bytes]:
        """All that is still held back, when nothing more comes."""
        records = [record for _, _, record in sorted(self._held)]
        self._held = []
        return records

    def _before(self, instant_ns: int) -> list[bytes]:
        ready = []
        while self._held and self._held[0][0] < instant_ns:
            ready.append(heapq.heappop(self._held)[2])
        return ready


def longest_wait_ns(trace: Path, start_ns: int = 0, end_ns: int | None = None) -> int:
    """How long after its beginning a frame of a part of a trace was recorded, at most; 0 without any.

    That is its airtime, on the ideal medium with its delay. One that a crash breaks off is recorded at once, so that frames
    are not even recorded in the order of their ends.

    Raises:
        TraceError: If the trace cannot be read or is damaged.
    """
    longest_ns = 0
    for message in read_raw(trace, {Frame.topic}, start_ns, end_ns):
        _, begin_ns, *_ = leading_scalars(Frame, message.data)
        longest_ns = max(longest_ns, message.time_ns - begin_ns)
    return longest_ns
