"""Signals in arrays over the nodes: where each sender's arrives, what began just now, what each receiver is locked on.

Received powers are whole zeptowatts (1e-18 mW): their sums are exact, in whatever order signals come and go.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.models.reception import log_bit_success_of
from netsim.sim.air import Link
from netsim.units import mw_to_dbm

ZW_PER_MW: Final = 1e18
MOST_RECEIVED_MW: Final = 1.0

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Reach:
    """Where one node's signal arrives; `near` are the positions of the listeners that can decode it at all.

    Attributes:
        index: Array index of every node it reaches, ascending.
        power_zw: Received power there.
        near: Array index of the listeners at which it can be decoded.
        near_zw: Received power there.
        near_ids: Their node ids.
        near_dbm: Received power in dBm.
        alone: ln of the chance of a bit there without interference.
    """

    index: NDArray[np.intp]
    power_zw: Ints
    near: NDArray[np.intp]
    near_zw: Ints
    near_ids: Ints
    near_dbm: Floats
    alone: Floats

    def power_at(self, index: int) -> int:
        """Received power at one node, in zeptowatts."""
        place = int(np.searchsorted(self.index, index))
        return int(self.power_zw[place]) if place < len(self.index) and self.index[place] == index else 0


class Instant:
    """Power of the signals that began at the present instant."""

    def __init__(self, size: int) -> None:
        self._power_zw = np.zeros(size, np.int64)
        self._at_ns = -1
        self._touched: list[NDArray[np.intp]] = []

    def add(self, now_ns: int, index: NDArray[np.intp], power_zw: Ints) -> None:
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


class Locks:
    """What each receiver is locked on; arrays over the nodes.

    Attributes:
        transmission: Number of the transmission; 0 for none.
        start_ns: Its start.
        end_ns: Its end; kept after the reception is over, for channel assessment.
        previous_end_ns: The end of the one before it.
        power_zw: Its received power.
        source: Array index of its sender.
        segment_ns: Start of the segment of constant interference not yet accounted for.
        log_success: ln of the chance that every bit so far is right.
        sinr: Lowest ratio so far.
    """

    def __init__(self, size: int) -> None:
        self.transmission = np.zeros(size, np.int64)
        self.start_ns = np.full(size, -1, np.int64)
        self.end_ns = np.full(size, -1, np.int64)
        self.previous_end_ns = np.full(size, -1, np.int64)
        self.power_zw = np.zeros(size, np.int64)
        self.source = np.zeros(size, np.int64)
        self.segment_ns = np.zeros(size, np.int64)
        self.log_success = np.zeros(size)
        self.sinr = np.zeros(size)


def reach_of(links: Sequence[Link], index: Mapping[int, int], noise_zw: float) -> Reach:
    """Where one node's signal arrives.

    Args:
        links: Its links, ascending by destination.
        index: Array index of every node.
        noise_zw: Noise power.

    Raises:
        ScenarioError: If a node would receive more power than any receiver stands.
    """
    near = [link for link in links if link.decodable]
    near_zw = _zeptowatts(near)
    return Reach(
        index=np.array([index[link.destination] for link in links], np.intp),
        power_zw=_zeptowatts(links),
        near=np.array([index[link.destination] for link in near], np.intp),
        near_zw=near_zw,
        near_ids=np.array([link.destination for link in near], np.int64),
        near_dbm=np.array([mw_to_dbm(link.power_mw) for link in near]),
        alone=log_bit_success_of(near_zw / noise_zw),
    )


def _zeptowatts(links: Sequence[Link]) -> Ints:
    strongest = max((link.power_mw for link in links), default=0.0)
    if strongest > MOST_RECEIVED_MW:
        message = f"a node would receive {mw_to_dbm(strongest):.1f} dBm from another, more than any receiver stands: "
        raise ScenarioError(message + "raise reference_loss_db or reference_distance_m, or lower tx_power_dbm")
    return np.array([round(link.power_mw * ZW_PER_MW) for link in links], np.int64)
