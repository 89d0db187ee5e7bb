"""What handing a belief to a neighbour costs in joules, as far as the node that decides can know."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LEAST_PRR: Final = 0.1
"""Links that receive less, and those that nothing is known of, are priced as this: no link layer tries on for ever."""
LEAST_SHARE: Final = 1.0 / 255.0
"""Smallest share of its energy that a node can tell in a byte; one that has less is priced as this."""


@dataclass(frozen=True, slots=True)
class HandoffCost:
    """Energy of sender and receiver for a payload, frame by frame.

    Attributes:
        joule_per_byte: Of a byte on the air, sent and received.
        frame_payload_byte: Most of the payload that one frame carries.
        frame_overhead_byte: Besides, for every frame: headers, checksum, acknowledgement.
    """

    joule_per_byte: float
    frame_payload_byte: int = 104
    frame_overhead_byte: int = 40

    def joules(self, payload_byte: int, prr: float) -> float:
        """Energy expected until a neighbour has it all.

        A frame takes 1 / PRR transmissions (De Couto, Aguayo, Bicket, Morris 2003, with acknowledgements that get through).

        Args:
            payload_byte: Bytes to hand over.
            prr: Packet reception ratio of the link.
        """
        frames = math.ceil(payload_byte / self.frame_payload_byte)
        air_byte = payload_byte + frames * self.frame_overhead_byte
        return self.joule_per_byte * air_byte / max(prr, LEAST_PRR)


def weighed_j(costs: Mapping[int, float], energy_left: Mapping[int, float] | None = None) -> dict[int, float]:
    """Costs weighed by how short the energy of each node is: joules over the share that it has left.

    The cost of lifetime routing, with both exponents 1 (Chang and Tassiulas 2004, section IV): a joule of a node that has a
    tenth of its energy left counts ten times.

    Args:
        costs: Joules by node.
        energy_left: Share of its energy that each node has left, from 0 to 1, as far as it has been heard of; the others
            are taken to have all of theirs.
    """
    left = energy_left or {}
    return {node: joules / max(left.get(node, 1.0), LEAST_SHARE) for node, joules in costs.items()}
