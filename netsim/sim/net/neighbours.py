"""What a node knows of its neighbours from their beacons and from its own data: the four-bit link estimator.

Fonseca, Gnawali, Jamieson, Levis, "Four-bit wireless link estimation", HotNets 2007, and its program in TinyOS
(`tos/lib/net/4bitle/LinkEstimatorP.nc`). No time is drawn and nothing sent here: whoever owns the table tells it both.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from netsim.api import Delivery
from netsim.sim.net.planar import Point
from netsim.sim.net.settings import BeaconDiscovery

_SEQUENCES = 0x10000


@dataclass(slots=True, eq=False)
class Known:
    """A neighbour.

    Attributes:
        heard_ns: When its last beacon came.
        sequence: The number of that beacon.
        position_m: Where it said it was.
        prr_in: Share of its beacons that arrive here; None until a window of them is over.
        prr_out: Share of our beacons that arrive there, as it reports; None until it does.
        etx: Expected transmissions of a frame until it is acknowledged; None while one of the two is missing.
    """

    heard_ns: int
    sequence: int
    position_m: Point | None = None
    prr_in: float | None = None
    prr_out: float | None = None
    etx: float | None = None
    beacons: int = 0
    beacons_heard: int = 0
    attempts: int = 0
    acknowledged: int = 0


class NeighbourTable:
    """See the module.

    Args:
        settings: Weights, windows, size.
        validity_ns: After how long without a beacon a neighbour is forgotten.
    """

    def __init__(self, settings: BeaconDiscovery, validity_ns: int) -> None:
        self._settings = settings
        self._validity_ns = validity_ns
        self.known: dict[int, Known] = {}
        self._costs: dict[float, dict[int, float]] = {}  # by threshold, until an estimate changes

    def two_way(self) -> Iterator[tuple[int, Known, float, float]]:
        """Neighbours heard that report to hear us: (id, entry, share there, share back), ascending."""
        for node, entry in sorted(self.known.items()):
            if entry.prr_in is not None and entry.prr_out is not None:
                yield node, entry, entry.prr_out, entry.prr_in

    def costs(self, minimum_prr: float) -> Mapping[int, float]:
        """Expected transmissions to each neighbour whose link is good enough in both directions."""
        if minimum_prr not in self._costs:
            most_etx = self._settings.evict_etx
            self._costs[minimum_prr] = {
                node: entry.etx
                for node, entry, there, back in self.two_way()
                if entry.etx is not None and min(there, back) >= minimum_prr and entry.etx <= most_etx
            }
        return self._costs[minimum_prr]

    def clear(self) -> None:
        """Forget everybody."""
        self.known.clear()
        self._costs.clear()

    def on_beacon(self, node: int, sequence: int, position_m: Point | None, now_ns: int) -> bool:
        """A beacon came; False where there is no room for its sender."""
        entry = self.known.get(node)
        if entry is None:
            if not self._make_room():
                return False
            entry = self.known[node] = Known(now_ns, sequence)
        else:
            self._count(entry, (sequence - entry.sequence) % _SEQUENCES)
        entry.sequence, entry.heard_ns, entry.position_m = sequence, now_ns, position_m
        return True

    def on_report(self, node: int, share: float | None) -> None:
        """A neighbour reports what share of our beacons it hears; None where it does not hear us."""
        entry = self.known[node]
        was, entry.prr_out = entry.prr_out, share
        if share != was:
            self._costs.clear()
        if share is None or entry.prr_in is None:
            entry.etx = None
        elif was is None:
            self._learn_from_beacons(entry)

    def on_data(self, node: int, delivery: Delivery) -> None:
        """A unicast packet to a neighbour was acknowledged or not, after some transmissions."""
        entry = self.known.get(node)
        if entry is None or delivery.attempts == 0:
            return
        entry.attempts += delivery.attempts
        entry.acknowledged += delivery.acknowledged
        if entry.attempts >= self._settings.data_window:
            estimate = entry.attempts / max(1, entry.acknowledged)
            entry.attempts = entry.acknowledged = 0
            if entry.etx is not None:
                entry.etx = self._mean(entry.etx, estimate)
                self._costs.clear()

    def expire(self, now_ns: int) -> list[int]:
        """Forget who was not heard for too long; returns who that was."""
        gone = [node for node, entry in self.known.items() if now_ns - entry.heard_ns >= self._validity_ns]
        for node in gone:
            del self.known[node]
            self._costs.clear()
        return gone

    def _count(self, entry: Known, gap: int) -> None:
        """Count a beacon and those missed before it.

        The first beacon of all does not count, and a window is over after so many beacons, heard or not: an estimate
        taken whenever one is heard would be too good.
        """
        if gap == 0 or gap > self._settings.largest_gap + 1:
            entry.prr_in = entry.etx = None  # a copy, or a neighbour that began anew
            entry.beacons = entry.beacons_heard = 0
            self._costs.clear()
            return
        for missed in reversed(range(gap)):
            entry.beacons += 1
            entry.beacons_heard += missed == 0
            if entry.beacons == self._settings.beacon_window:
                entry.prr_in = self._mean(entry.prr_in, entry.beacons_heard / entry.beacons)
                entry.beacons = entry.beacons_heard = 0
                self._costs.clear()
                self._learn_from_beacons(entry)

    def _learn_from_beacons(self, entry: Known) -> None:
        if entry.prr_in and entry.prr_out:
            entry.etx = self._mean(entry.etx, 1.0 / (entry.prr_in * entry.prr_out))

    def _mean(self, past: float | None, new: float) -> float:
        """Exponentially weighted; the first value counts whole."""
        weight = self._settings.ewma_weight
        return new if past is None else weight * past + (1.0 - weight) * new

    def _make_room(self) -> bool:
        if len(self.known) < self._settings.most_neighbours:
            return True
        worst = max(self.known, key=lambda node: (self.known[node].etx or 0.0, node))
        if (self.known[worst].etx or 0.0) <= self._settings.evict_etx:
            return False
        del self.known[worst]
        self._costs.clear()
        return True
