"""What travels on the air: link-layer frames, their transmissions, and what became of them at each listener."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.trace.events import BROADCAST

MAC_HEADER_BYTE = 9
"""IEEE 802.15.4-2006 7.2.1 with short addresses and one PAN id: frame control 2, sequence 1, PAN 2, addresses 2 + 2."""
FCS_BYTE = 2
MAC_OVERHEAD_BYTE = MAC_HEADER_BYTE + FCS_BYTE
ACK_PSDU_BYTE = 5
"""IEEE 802.15.4-2006 7.2.2.3: frame control 2, sequence 1, checksum 2."""


@dataclass(slots=True, eq=False)
class LinkFrame:
    """A link-layer unit.

    Attributes:
        source: Transmitting node.
        destination: Next hop, or `BROADCAST`.
        sequence: Data sequence number, 0..255; an acknowledgement carries that of the frame it answers.
        is_ack: Whether this is an acknowledgement.
        wants_ack: Whether the destination is to answer with one.
        packet: Network-layer bytes; empty for an acknowledgement.
        kind: Kind of the message served, for ledger and trace.
        message_id: Number of the message served, for the trace.
        attempt: 0 for the first transmission, 1 for the first retry.
        is_strobe: Whether this is a wake-up frame of low-power listening; its bytes are filling.
    """

    source: int
    destination: int
    sequence: int
    is_ack: bool
    wants_ack: bool
    packet: bytes
    kind: str
    message_id: int
    attempt: int = 0
    is_strobe: bool = False

    @property
    def concerns_all(self) -> bool:
        """Whether nodes it is not addressed to learn from it too.

        A strobe lets them sleep on; an acknowledgement has no address on the air (IEEE 802.15.4-2006 7.2.2.3).
        """
        return self.is_ack or self.is_strobe

    @property
    def psdu_byte(self) -> int:
        """Size of the physical-layer payload."""
        return ACK_PSDU_BYTE if self.is_ack else MAC_OVERHEAD_BYTE + len(self.packet)

    def is_for(self, node: int) -> bool:
        """Whether the address filter of a node lets it through."""
        return self.destination in (node, BROADCAST)


@dataclass(slots=True, eq=False)
class Receptions:
    """One transmission at each audible listener; the arrays have one entry a listener, ascending by node.

    Attributes:
        node: Node ids.
        outcome: Codes in `netsim.trace.events.OUTCOMES`, final at the end of the transmission.
        power_dbm: Received power.
        sinr: Lowest signal to interference and noise ratio so far (linear).
    """

    node: NDArray[np.int64]
    outcome: NDArray[np.int64]
    power_dbm: NDArray[np.float64]
    sinr: NDArray[np.float64]


@dataclass(slots=True, eq=False)
class Transmission:
    """A frame on the air over the half-open interval [start_ns, end_ns)."""

    id: int
    frame: LinkFrame
    start_ns: int
    end_ns: int
    tx_power_dbm: float
    receptions: Receptions
    truncated: bool = False
    is_over: bool = False
