"""Signals in arrays over the nodes: where each sender's arrives, and what began just now.

Received powers are whole zeptowatts (1e-18 mW): their sums are exact, in whatever order signals come and go.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.sim.air import Link
from netsim.units import mw_to_dbm

ZW_PER_MW: Final = 1e18
MOST_RECEIVED_MW: Final = 1.0

Ints = NDArray[np.int64]
Indices = NDArray[np.intp]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """Where one signal arrives; `near` picks the listeners that can decode it at all.

    Attributes:
        index: Array index of every node it reaches, ascending.
        ids: Their node ids.
        power_zw: Received power there.
        near: Positions in these arrays of the listeners at which it can be decoded.
        near_index: Array index of those listeners.
        near_ids: Their node ids.
        near_zw: Received power there.
        near_dbm: Received power there.
    """

    index: Indices
    ids: Ints
    power_zw: Ints
    near: Indices
    near_index: Indices
    near_ids: Ints
    near_zw: Ints
    near_dbm: Floats

    @classmethod
    def of(cls, index: Indices, ids: Ints, power_zw: Ints, near: Indices) -> "Reach":
        """A reach from its first four attributes."""
        near_zw = power_zw[near]
        near_dbm = 10.0 * np.log10(near_zw / ZW_PER_MW)
        return cls(index, ids, power_zw, near, index[near], ids[near], near_zw, near_dbm)

    def power_at(self, index: int) -> int:
        """Received power at one node, in zeptowatts."""
        place = int(np.searchsorted(self.index, index))
        return int(self.power_zw[place]) if place < len(self.index) and self.index[place] == index else 0

    def faded(self, gains: Floats) -> "Reach":
        """The same signal after power gains, one for each node it reaches; nobody is near yet."""
        power_zw = np.minimum(np.rint(self.power_zw * gains), MOST_RECEIVED_MW * ZW_PER_MW).astype(np.int64)
        return Reach.of(self.index, self.ids, power_zw, np.empty(0, np.intp))

    def nearer(self, mask: Mask) -> "Reach":
        """The same signal with another choice of who can decode it."""
        return Reach.of(self.index, self.ids, self.power_zw, np.flatnonzero(mask))


class Instant:
    """Power of the signals that began at the present instant."""

    def __init__(self, size: int) -> None:
        self._power_zw = np.zeros(size, np.int64)
        self._at_ns = -1
        self._touched: list[Indices] = []

    def add(self, now_ns: int, index: Indices, power_zw: Ints) -> None:
        """One more signal."""
        self.at(now_ns)
        self._power_zw[index] += power_zw
        self._touched.append(index)

    def at(self, now_ns: int) -> Ints:
        """The power at every node; what belongs to an earlier instant is forgotten."""
        if self._at_ns != now_ns:
            for index in self._touched:
                self._power_zw[index] = 0
            self._touched.clear()
            self._at_ns = now_ns
        return self._power_zw


def reach_of(links: Sequence[Link], index: Mapping[int, int]) -> Reach:
    """Where one node's signal arrives.

    Args:
        links: Its links, ascending by destination.
        index: Array index of every node.

    Raises:
        ScenarioError: If a node would receive more power than any receiver stands.
    """
    return Reach.of(
        index=np.array([index[link.destination] for link in links], np.intp),
        ids=np.array([link.destination for link in links], np.int64),
        power_zw=zeptowatts([link.power_mw for link in links]),
        near=np.flatnonzero([link.decodable for link in links]),
    )


def zeptowatts(powers_mw: Sequence[float]) -> Ints:
    """Received powers in whole zeptowatts.

    Raises:
        ScenarioError: If one is more than any receiver stands.
    """
    strongest = max(powers_mw, default=0.0)
    if strongest > MOST_RECEIVED_MW:
        message = f"a node would receive {mw_to_dbm(strongest):.1f} dBm from another, more than any receiver stands: "
        raise ScenarioError(message + "raise reference_loss_db or reference_distance_m, or lower tx_power_dbm")
    return np.array([round(power * ZW_PER_MW) for power in powers_mw], np.int64)
