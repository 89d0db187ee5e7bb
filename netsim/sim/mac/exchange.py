"""Both ends of a link-layer exchange, as every MAC with acknowledgements has them (IEEE 802.15.4-2006 7.5.6)."""

from netsim.api import BROADCAST
from netsim.models.devices import RadioDevice
from netsim.sim.frames import ACK_PSDU_BYTE, LinkFrame
from netsim.sim.mac.link import Deliver, Duplicates, LinkJob
from netsim.sim.radio import Radio

UNIT_BACKOFF_SYMBOLS = 20
"""aUnitBackoffPeriod, IEEE 802.15.4-2006 table 85."""


def ack_wait_ns(device: RadioDevice) -> int:
    """How long a sender waits for an acknowledgement after its frame: unit back-off, turnaround, acknowledgement.

    This is macAckWaitDuration of IEEE 802.15.4-2006 7.4.2: 20 + 12 + 22 = 54 symbols, 864 us, at 2.4 GHz.
    """
    backoff_ns = UNIT_BACKOFF_SYMBOLS * device.symbol_ns
    return backoff_ns + device.turnaround_ns + device.airtime_ns(ACK_PSDU_BYTE)


class Outgoing:
    """The sender's end: numbers the frame of each job and knows its acknowledgement.

    Args:
        node: The sender.
        first: Number before that of the first frame, 0 to 255.
        acknowledge: Whether unicast frames ask for an acknowledgement.

    Attributes:
        attempt: Transmissions of the present job so far.
        awaits_ack: Whether an acknowledgement is being waited for.
    """

    def __init__(self, node: int, first: int, acknowledge: bool) -> None:
        self._node = node
        self._sequence = first
        self._acknowledge = acknowledge
        self.attempt = 0
        self.awaits_ack = False

    def begin(self) -> None:
        """A new job: the next number."""
        self._sequence = (self._sequence + 1) % 256
        self.attempt = 0
        self.awaits_ack = False

    def frame(self, job: LinkJob) -> LinkFrame:
        """The frame of the present job."""
        return LinkFrame(
            source=self._node,
            destination=job.destination,
            sequence=self._sequence,
            is_ack=False,
            wants_ack=self._acknowledge and job.destination != BROADCAST,
            packet=job.packet,
            kind=job.kind,
            message_id=job.message_id,
            attempt=min(self.attempt, 255),
        )

    def strobe(self, job: LinkJob, destination: int, psdu_byte: int) -> LinkFrame:
        """A wake-up frame for the present job, of a given size."""
        frame = self.frame(job)
        packet = bytes(psdu_byte - (frame.psdu_byte - len(job.packet)))
        return LinkFrame(
            self._node, destination, self._sequence, False, False, packet, job.kind, job.message_id, frame.attempt, True
        )

    def is_answered_by(self, frame: LinkFrame) -> bool:
        """Whether this is the acknowledgement that is being waited for.

        It tells by the number alone, as on the air, where an acknowledgement carries no address: that of somebody else's
        frame of the same number is taken for one's own.
        """
        return self.awaits_ack and frame.is_ack and frame.sequence == self._sequence


class Incoming:
    """The receiver's end: acknowledges what asks for it and hands up what is new.

    Args:
        radio: The node's radio.
        deliver: Where received packets go.
    """

    def __init__(self, radio: Radio, deliver: Deliver) -> None:
        self._radio = radio
        self._deliver = deliver
        self._duplicates = Duplicates()

    def take(self, frame: LinkFrame) -> None:
        """A data frame came for this node.

        It is acknowledged where it asks for that, unless the radio is busy sending (possible only over the ideal medium).
        """
        if frame.wants_ack and self._radio.can_transmit:
            self.acknowledge(frame)
        if frame.destination == BROADCAST or self._duplicates.is_new(frame):
            self._deliver(frame.packet, frame.source)

    def acknowledge(self, frame: LinkFrame) -> None:
        """Answer after the turnaround, without contention (7.5.6.4.2)."""
        node = self._radio.node
        self._radio.transmit(
            LinkFrame(node, frame.source, frame.sequence, True, False, b"", frame.kind, frame.message_id)
        )

    def forget(self) -> None:
        """The node lost its memory."""
        self._duplicates = Duplicates()
