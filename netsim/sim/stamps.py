"""Time stamps of the link layer: written into a frame as it leaves, taken as its start comes in.

What lies between a message and the air (waiting in queues, back-off) varies by milliseconds; a stamp written at the moment
of transmission does not contain it. The stamp of a real radio is captured at the start-of-frame delimiter on both sides;
here it is the start of the frame on both sides, which differs by the same constant.
"""

import struct
from typing import Final

from netsim.sim.clock import Clock
from netsim.sim.frames import LinkFrame
from netsim.sim.local_clock import LocalClock

STAMP: Final = struct.Struct("<q")
STAMP_BYTE: Final = STAMP.size
MOST_STAMPED_BYTE: Final = 32
"""Longest payload that can be stamped: it must travel in one frame of any radio."""


class Stamps:
    """The link layer's time stamps at one node.

    Args:
        clock: True time.
        local: The node's clock.
    """

    def __init__(self, clock: Clock, local: LocalClock) -> None:
        self._clock = clock
        self._local = local
        self._sent: set[int] = set()
        self._received_ns = -1
        self._began_ns = 0

    def fill(self, payload: bytes) -> bytes:
        """A payload with the clock's present reading in its last eight bytes."""
        return payload[:-STAMP_BYTE] + STAMP.pack(self._local.now_ns)

    def expect(self, message_id: int) -> None:
        """Frames of this message are to be stamped."""
        self._sent.add(message_id)

    def forget(self, message_id: int) -> None:
        """The link layer has finished with a message."""
        self._sent.discard(message_id)

    def leaving(self, frame: LinkFrame) -> None:
        """A frame of this node begins now: stamp it, if that was asked for. A packet ends with its payload."""
        if frame.message_id in self._sent and not frame.is_ack and len(frame.packet) >= STAMP_BYTE:
            frame.packet = self.fill(frame.packet)

    def came_in(self, airtime_ns: int) -> None:
        """A frame that lasted so long has just been received."""
        self._received_ns = self._clock.now_ns
        self._began_ns = self._received_ns - airtime_ns

    @property
    def began_ns(self) -> int | None:
        """When the frame received just now began, by this node's counter; None if none was received just now."""
        return self._local.stamped(self._began_ns) if self._received_ns == self._clock.now_ns else None
